"""A calibration on the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from urdyn.identify.kinematics import Calibration
from urdyn.model.geometry.hayati import KINDS
from urdyn.report.calibrate.words import answer, deviation, label, tool, trust
from urdyn.report.digits import percent
from urdyn.report.names import maker, spoken
from urdyn.report.terminal import terminal_table

HEADS = ("a\n[mm]", "alpha\n[mrad]", "beta\n[mrad]", "d\n[mm]", "theta\n[mrad]")


def calibrate_table(c: Calibration) -> Table:
    """How far each coordinate is from the drawing, ± its 90 % interval."""
    title = f"{maker(c.arm.name)}: differences from the drawing ± 90 %; (…) not determined"
    told = dict(
        zip(
            c.drawing.form.names,
            zip(c.found.placement.deviations, c.sd, c.spread, strict=False),
            strict=True,
        )
    )
    rows = (
        (spoken(joint), *(_cell(told.get(f"{joint}.{kind}")) for kind in KINDS))
        for joint in c.arm.joint_names
    )
    return terminal_table(title, ("joint", *HEADS), rows)


def _cell(told: tuple[float, float, float] | None) -> str:
    if told is None:
        return ""
    value, sd, prior = told
    text = deviation(value, sd)
    return f"({text})" if sd > 0.9 * prior else text


def calibrate_words(c: Calibration, summary: Mapping[str, Any]) -> list[str]:
    """The answer in sentences."""
    words = [answer(summary), trust(summary), tool(summary)]
    words += [
        f"{label(w.name)} is open ({percent(w.left)} of what it was before){_partners(w.partners)}"
        for w in c.weak
    ]
    return words


def _partners(partners: tuple[tuple[str, float], ...]) -> str:
    names = ", ".join(name for name, _ in partners)
    return f": it trades off with {names}" if names else ""
