"""The folder of a tracked run: its files, and a finding as findings.json contains it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

HISTORY, PARTS = "history.parquet", "history.parts"  # whole, or of a run in progress
FINDINGS, REPORT = "findings.json", "report.html"
SEVERITIES = ("notice", "warning", "critical")  # of a finding, rising
RANKS = {name: 1.0 + k for k, name in enumerate(SEVERITIES)}  # any other word is lower
PUSH = "collision"  # the kind that ends by itself
MISSES = 1.5  # [-] average surprise of a history above which its intervals cannot be trusted


class Entry(TypedDict):
    """What a list of many robots shows of a finding; `urdyn.diagnose.Finding` is complete."""

    kind: str
    joint: int | None  # from 0; None: the tool
    name: str
    onset_s: float
    onset_interval_s: Sequence[float]
    severity: str  # of SEVERITIES
    confidence: float  # [-]
    time_to_failure_s: Mapping[str, float] | None  # median, lo, hi
    acknowledged: bool
    older: bool
    gone: bool
    evidence: Mapping[str, Any]


def over(finding: Mapping[str, Any]) -> bool:
    """Whether a finding is over, and only a notice by now: a push, or one that ended or is gone."""
    evidence = finding.get("evidence")
    ended = isinstance(evidence, Mapping) and "until_s" in evidence  # a sensor that works again
    return finding.get("kind") == PUSH or ended or bool(finding.get("gone"))


def quiet(finding: Mapping[str, Any]) -> bool:
    """Whether it needs no attention: somebody has seen it, or nothing is left of it."""
    return bool(finding.get("acknowledged") or finding.get("gone"))


def urgency(finding: Mapping[str, Any]) -> tuple[float, float, float]:
    """The more urgent, the greater: severity, then time left, then confidence."""
    median = (finding.get("time_to_failure_s") or {}).get("median")
    left = math.inf if median is None else median
    return gravity(finding), -left, finding.get("confidence", 0.0)


def gravity(finding: Mapping[str, Any]) -> float:
    """Rank of its severity; quiet ones rank below all, past ones as a notice."""
    rank = 0.0 if quiet(finding) else RANKS.get(finding.get("severity", ""), 0.0)
    return min(rank, RANKS["notice"]) if over(finding) else rank
