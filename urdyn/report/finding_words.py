"""A finding of `findings.json` in the words and units that people use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.report.digits import interval90, number

BEFORE = "before this run"
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
    evidence = finding.get("evidence", {})
    if mode := evidence.get("mode"):
        return SHOWS.get(mode, str(mode)) + (", over" if "until_s" in evidence else "")
    by = factor(finding)
    value, sd = by * finding["size"], by * (finding["size_sd"] or 0.0)
    return f"{interval90(value, sd) if sd else number(value)} {unit(finding)}"
