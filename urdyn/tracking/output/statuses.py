"""An arm's state as /diagnostics statuses: one line per joint, and one for the arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from urdyn.io.run_folder import urgency
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Level, Status, of_finding
from urdyn.types import NORMAL90, Array

HEALTH = {Level.WARN: 0.9, Level.ERROR: 0.75}  # [-] drive health below
FRICTION = {Level.WARN: 1.5, Level.ERROR: 2.0}  # [-] of commissioned, above; warmth changes 0.2
STALE = 1.0  # [s] without a sample

WELL = "as commissioned"


def statuses(
    now: Snapshot,
    commissioned: Array,
    findings: Sequence[Mapping[str, Any]] = (),
    serial: str = "",
) -> tuple[Status, ...]:
    """Lines of the joints, then of the arm, at the worst level of all.

    Of several at one level, the line that has the most urgent finding is the worst.

    Args:
        now: the arm as it is believed to be.
        commissioned: friction of the commissioned arm, (J,) [N·m].
        findings: as in findings.json.
        serial: number of the arm.
    """
    urgent = sorted(findings, key=urgency, reverse=True)
    told = [of_finding(finding, serial, now.joints) for finding in urgent]
    joints = tuple(
        _worst(_joint(now, joint, float(f), serial), [s for s in told if s.name == _name(joint)])
        for joint, f in zip(now.joints, commissioned, strict=True)
    )
    arm = [status for status in told if status.name == _name("arm")]
    order = list(dict.fromkeys((*(status.name for status in told), *map(_name, now.joints))))
    worst = max([*joints, *arm], key=lambda s: (*_gravity(s), -order.index(s.name)))
    message = f"{worst.name}: {worst.message}" if any(_gravity(worst)) else WELL
    found = tuple(pair for status in arm for pair in status.values)
    whole = Status(worst.level, _name("arm"), message, (*_values(now, "payload"), *found), serial)
    return (*joints, whole)


def limited(lines: Sequence[Status], doubt: str, behind: str) -> tuple[Status, ...]:
    """The lines, the last of which, the arm's, first says what limits them all.

    They are `behind` the robot, which is a warning; and of findings there is a `doubt`.
    """
    *parts, arm = lines
    level = max(arm.level, Level.WARN) if behind else arm.level
    said = (behind, doubt if arm.level else "", arm.message)
    return (*parts, replace(arm, level=level, message="; ".join(filter(None, said))))


def stale(lines: Sequence[Status], age: float) -> tuple[Status, ...]:
    """The lines when nothing has come for `age` [s]."""
    told = f"no sample for {age:.1f} s"
    return tuple(replace(s, level=Level.STALE, message=told) for s in lines)


def _joint(now: Snapshot, joint: str, commissioned: float, serial: str) -> Status:
    mean, sd = now.mean[joint], now.sd[joint]
    # A limit counts as crossed where 95 % of the belief lies beyond it.
    at_most = mean["health"] + NORMAL90 * sd["health"]
    at_least = (mean["friction"] - NORMAL90 * sd["friction"]) / commissioned
    level, message = Level.OK, WELL
    for grade in (Level.WARN, Level.ERROR):
        if at_least > FRICTION[grade]:
            level = grade
            message = f"friction {mean['friction'] / commissioned:.1f} times that when commissioned"
        if at_most < HEALTH[grade]:
            level, message = grade, f"drive health {mean['health']:.2f}"
    return Status(level, _name(joint), message, _values(now, joint), serial)


def _name(part: str) -> str:
    return f"urdyn: {part}"


def _worst(own: Status, findings: Sequence[Status]) -> Status:
    """The line of a joint or the arm, combined with its findings."""
    worst = max([own, *findings], key=_gravity)
    found = [pair for finding in findings for pair in finding.values]
    return replace(worst, name=own.name, values=(*own.values, *found))


def _gravity(status: Status) -> tuple[Level, bool]:
    """What is acknowledged is more than what is well, or gone, at the same level."""
    return status.level, status.acknowledged


def _values(now: Snapshot, part: str) -> tuple[tuple[str, str], ...]:
    """Estimates with their 90 % intervals."""
    return tuple(
        (name, f"{value:.4g} ± {NORMAL90 * now.sd[part][name]:.2g} {now.units[name]}")
        for name, value in now.mean[part].items()
    )
