"""An arm's health, as /diagnostics publishes it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

from urdyn.io.bags.joints import JOINTS
from urdyn.io.run_folder import over
from urdyn.io.spans import NEVER, span


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Status:
    """One line of a diagnostics table: of a joint, or of the arm."""

    level: Level
    name: str  # "urdyn: elbow_joint"
    message: str  # for people
    values: tuple[tuple[str, str], ...] = ()  # for programs, and for a closer look
    hardware_id: str = ""  # serial number of the arm
    acknowledged: bool = False  # somebody has seen what it would warn of

    def seen(self) -> Status:
        """The same, which somebody has seen: it is shown, but no longer warned of."""
        told = f"acknowledged: {self.message}"
        return replace(self, level=Level.OK, message=told, acknowledged=True)


def of_finding(
    finding: Mapping[str, Any], hardware_id: str = "", joints: Sequence[str] = JOINTS
) -> Status:
    """A finding of `urdyn track` as a line: ERROR where it is critical or its time is over.

    Only WARN where the fault itself is over, OK where it needs no attention.
    """
    joint = finding.get("joint")
    whose = joints[joint] if isinstance(joint, int) and 0 <= joint < len(joints) else joint
    kind = str(finding.get("kind", "finding")).replace("_", " ")
    left = _left(finding)
    message = kind + _in_time(left)
    values = tuple((key, _said(value)) for key, value in finding.items())
    grave = finding.get("severity") == "critical" or left == 0.0
    level = Level.ERROR if grave and not over(finding) else Level.WARN
    status = Status(level, f"urdyn: {whose or 'arm'}", message, values, hardware_id)
    if finding.get("gone"):
        return replace(status, level=Level.OK, message=f"gone by now: {message}")
    return status.seen() if finding.get("acknowledged") else status


def _left(finding: Mapping[str, Any]) -> float | None:
    """Median time to failure [s], 0 where it has passed; None: unknown."""
    told = finding.get("time_to_failure_s")
    median = told.get("median") if isinstance(told, Mapping) else None
    if not isinstance(median, int | float) or not median < NEVER:
        return None
    return max(float(median), 0.0)


def _in_time(left: float | None) -> str:
    if left is None:
        return ""
    return f", {span(left)} left" if left else ", time is over"


def _said(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
