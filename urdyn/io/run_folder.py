"""What lies in the folder of a tracked run: its files, and a finding as findings.json has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypedDict

HISTORY, PARTS = "history.parquet", "history.parts"  # whole, or of a run in progress
FINDINGS, REPORT = "findings.json", "report.html"
SEVERITIES = ("notice", "warning", "critical")  # of a finding, rising
PUSH = "collision"  # the kind that comes, lasts, and is over
MISSES = 1.5  # [-] average surprise of a history above which its intervals cannot be trusted


class Entry(TypedDict):
    """What a list of many robots shows of a finding; `urdyn.diagnose.Finding` has it all."""

    kind: str
    joint: int | None  # from 0; None: the tool
    name: str
    onset_s: float
    severity: str  # of SEVERITIES
    confidence: float  # [-]
    time_to_failure_s: Mapping[str, float] | None  # median, lo, hi
    acknowledged: bool
    older: bool
    gone: bool
    evidence: Mapping[str, Any]


def over(finding: Mapping[str, Any]) -> bool:
    """Whether it is past, and no more than a notice by now: a push, what ended, what is gone."""
    evidence = finding.get("evidence")
    ended = isinstance(evidence, Mapping) and "until_s" in evidence  # a sensor that is well again
    return finding.get("kind") == PUSH or ended or bool(finding.get("gone"))


def quiet(finding: Mapping[str, Any]) -> bool:
    """Whether it calls for nobody: somebody has seen it, or nothing is left of it."""
    return bool(finding.get("acknowledged") or finding.get("gone"))
