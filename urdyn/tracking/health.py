"""An arm's state in the words of /diagnostics: one line a joint, one for the arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from urdyn.io.ros2.status import Level, Status, of_finding
from urdyn.types import Array

SURE = 1.645  # [sd] beyond which a limit counts as crossed: 95 of 100
HEALTH = {Level.WARN: 0.9, Level.ERROR: 0.75}  # [-] drive health below
FRICTION = {Level.WARN: 1.5, Level.ERROR: 2.0}  # [-] over that when commissioned; warmth moves 0.2
STALE = 1.0  # [s] without a sample

Values = Mapping[str, Mapping[str, float]]


def statuses(
    mean: Values,
    sd: Values,
    units: Mapping[str, str],
    commissioned: Array,
    findings: Sequence[Mapping[str, Any]],
    serial: str,
) -> tuple[Status, ...]:
    """Lines of the joints, then of the arm, the worst of all.

    Args:
        mean: joint or "payload" -> quantity -> value; the joints lead, base first.
        sd: of those.
        units: quantity -> its unit.
        commissioned: Coulomb friction of the commissioned arm, (J,) [N·m].
        findings: as in findings.json.
        serial: number of the arm.
    """
    told = [of_finding(finding, serial) for finding in findings]
    joints = [part for part in mean if part != "payload"]
    lines = [
        _worst(
            _joint(joint, mean[joint], sd[joint], units, float(f), serial),
            [s for s in told if s.name == f"urdyn: {joint}"],
        )
        for joint, f in zip(joints, commissioned, strict=True)
    ]
    ranked = [*lines, *(s for s in told if s.name == "urdyn: arm")]
    worst = max(ranked, key=lambda status: status.level)
    message = "as commissioned" if worst.level == Level.OK else f"{worst.name}: {worst.message}"
    arm = Status(worst.level, "urdyn: arm", message, _values(mean["payload"], sd["payload"], {}))
    return (*lines, Status(arm.level, arm.name, arm.message, arm.values, serial))


def stale(lines: Sequence[Status], age: float) -> tuple[Status, ...]:
    """The lines when nothing has come for `age` [s]."""
    told = f"no sample for {age:.1f} s"
    return tuple(Status(Level.STALE, s.name, told, s.values, s.hardware_id) for s in lines)


def _joint(
    joint: str,
    mean: Mapping[str, float],
    sd: Mapping[str, float],
    units: Mapping[str, str],
    commissioned: float,
    serial: str,
) -> Status:
    at_most = mean["health"] + SURE * sd["health"]
    at_least = (mean["coulomb"] - SURE * sd["coulomb"]) / commissioned
    level, message = Level.OK, "as commissioned"
    for grade in (Level.WARN, Level.ERROR):
        if at_least > FRICTION[grade]:
            level = grade
            message = f"friction {mean['coulomb'] / commissioned:.1f} times that when commissioned"
        if at_most < HEALTH[grade]:
            level, message = grade, f"drive health {mean['health']:.2f}"
    return Status(level, f"urdyn: {joint}", message, _values(mean, sd, units), serial)


def _worst(own: Status, findings: Sequence[Status]) -> Status:
    """The line of a joint, with what was found of it."""
    worst = max([own, *findings], key=lambda status: status.level)
    found = [pair for finding in findings for pair in finding.values]
    values = (*own.values, *found)
    return Status(worst.level, own.name, worst.message, values, own.hardware_id)


def _values(
    mean: Mapping[str, float], sd: Mapping[str, float], units: Mapping[str, str]
) -> tuple[tuple[str, str], ...]:
    return tuple(
        (name, f"{value:.4g} ± {sd[name]:.2g} {units.get(name, '')}".rstrip())
        for name, value in mean.items()
    )
