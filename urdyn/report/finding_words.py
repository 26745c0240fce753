"""A finding of `findings.json` in the words and units that people use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.report.digits import interval90, number

BEFORE = "before this run"
NEVER = 1e9  # [s] that may as well be for ever
SPANS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"))
KINDS = {
    "friction_increase": "friction increase",
    "health_degradation": "drive health",
    "joint_backlash": "backlash",
    "controller_instability": "instability",
    "payload_change": "payload change",
    "collision": "collision",
    "encoder_offset": "encoder offset",
    "sensor_fault": "sensor fault",
}
SHOWS = {"dropped": "silent", "encoder": "stuck or silent"}  # modes of a sensor, in words


def kind(finding: Mapping[str, Any]) -> str:
    """What it is, in words."""
    name = str(finding["kind"])
    return KINDS.get(name, name.replace("_", " "))


def factor(finding: Mapping[str, Any]) -> float:
    """By which a size reads well: ratios in per cent."""
    return 100.0 if finding["unit"] == "-" else 1.0


def unit(finding: Mapping[str, Any]) -> str:
    """In which it then is."""
    return "%" if finding["unit"] == "-" else str(finding["unit"])


def amount(finding: Mapping[str, Any], value: float) -> str:
    """A size of the finding, signed, with its unit."""
    return f"{'+' if value > 0.0 else ''}{number(factor(finding) * value)} {unit(finding)}"


def size(finding: Mapping[str, Any]) -> str:
    """How large it is, with its 90 % interval; how it shows where that has no size."""
    if mode := finding.get("evidence", {}).get("mode"):
        return SHOWS.get(mode, str(mode))
    by = factor(finding)
    value, sd = by * finding["size"], by * (finding["size_sd"] or 0.0)
    return f"{interval90(value, sd) if sd else number(value)} {unit(finding)}"


def span(seconds: float | None) -> str:
    """A time, in the largest unit of which it has two."""
    length, name = _unit_of(seconds)
    return f"{_in(seconds, length)} {name}".strip()


def span_of(left: Mapping[str, float | None]) -> str:
    """A time to a level, with its 90 % interval in the same unit."""
    length, _ = _unit_of(left["median"])
    lo, hi = (_in(left[end], length) for end in ("lo", "hi"))
    return f"{span(left['median'])} ({lo} to {hi})"


def _unit_of(seconds: float | None) -> tuple[float, str]:
    if seconds is None or seconds >= NEVER:
        return 1.0, ""
    return next((unit for unit in SPANS if seconds >= 2.0 * unit[0]), (1.0, "s"))


def _in(seconds: float | None, length: float) -> str:
    return "no end" if seconds is None or seconds >= NEVER else number(seconds / length)
