"""What a diagnosis found, as `findings.json` tells it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io.plain import plain
from urdyn.report.digits import number
from urdyn.report.names import spoken
from urdyn.report.track_history import Clock, clock

FILE = "findings.json"
RANKS = {"critical": 3.0, "warning": 2.0, "notice": 1.0}  # of a severity; any other word is lower
LEFT = ("median", "lo", "hi")
DAMAGE = (LookupError, TypeError, ValueError, AttributeError)


@dataclass(frozen=True)
class Finding:
    """One fault that grows, or has come."""

    kind: str  # "friction_increase", ...
    joint: int | None  # from 0; None: no joint's fault
    name: str  # of the joint, of the link, or of what else has it
    onset: float  # [s] stamp of the log
    severity: str
    confidence: float  # [-] in [0, 1]
    left: tuple[float, float, float] | None  # [s] median, 5 % and 95 % of the time to failure
    acknowledged: bool = False  # somebody knows already

    @property
    def rank(self) -> tuple[float, float, float]:
        """The more urgent, the greater: severity, then time left, then confidence."""
        median = self.left[0] if self.left else np.inf
        severity = 0.0 if self.acknowledged else RANKS.get(self.severity, 0.0)
        return severity, -median, self.confidence

    def sentence(self, start: float, time: Clock) -> str:
        """The finding as people say it; `start` is the log's first stamp [s]."""
        where = f"{spoken(self.name)} " if self.name else ""
        since = time(self.onset - start)
        known = ", acknowledged" if self.acknowledged else ""
        what = self.kind.replace("_", " ")
        return f"{where}{what} since {since}, {self.severity}{known}{self._left()}"

    def _left(self) -> str:
        if self.left is None:
            return ""
        unit = clock(self.left[0])
        median, low, high = (number(t / unit.seconds) for t in self.left)
        return f"; {median} {unit.unit} left ({low} to {high})"


def read_findings(folder: Path, joints: Sequence[str]) -> tuple[Finding, ...] | None:
    """The findings in a track folder, most urgent first; None: nobody has diagnosed it.

    Raises:
        InputError: the file is damaged; the reason, without the folder's name.
    """
    path = folder / FILE
    if not path.exists():
        return None
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        entries = told["findings"] if isinstance(told, dict) else told
        found = [_finding(entry, joints) for entry in entries]
    except OSError as error:
        raise InputError(f"its {FILE} cannot be read: {error.strerror}") from error
    except DAMAGE as error:
        raise InputError(f"its {FILE} is damaged ({error}); diagnose it again") from error
    return tuple(sorted(found, key=lambda finding: finding.rank, reverse=True))


def ranked(entries: Sequence[Mapping[str, Any]], joints: Sequence[str]) -> list[Mapping[str, Any]]:
    """Findings as a run's summary has them, most urgent first."""
    return sorted(entries, key=lambda entry: _finding(entry, joints).rank, reverse=True)


def _finding(entry: Mapping[str, Any], joints: Sequence[str]) -> Finding:
    joint, left = entry["joint"], entry["time_to_failure_s"]
    if joint is not None and not 0 <= int(joint) < len(joints):
        raise ValueError(f"joint {joint} of {len(joints)}")
    name = "" if joint is None else joints[int(joint)]
    return Finding(
        kind=str(entry["kind"]),
        joint=None if joint is None else int(joint),
        name=str(entry.get("name", name)),
        onset=float(entry["onset_s"]),
        severity=str(entry["severity"]),
        confidence=float(entry["confidence"]),
        left=left and (_time(left["median"]), _time(left["lo"]), _time(left["hi"])),
        acknowledged=bool(entry.get("acknowledged", False)),
    )


def told(finding: Finding) -> dict[str, Any]:
    """A finding in plain numbers, under the names of the file."""
    left = finding.left
    times = left and dict(zip(LEFT, map(plain, left), strict=True))
    return {
        "kind": finding.kind,
        "joint": finding.joint,
        "name": finding.name,
        "onset_s": plain(finding.onset),
        "severity": finding.severity,
        "confidence": plain(finding.confidence),
        "acknowledged": finding.acknowledged,
        "time_to_failure_s": times,
    }


def _time(value: float | None) -> float:
    """A time to failure [s]; none is one that never comes."""
    return np.inf if value is None else float(value)
