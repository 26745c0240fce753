"""What stands beside the arm: the time, what the colours mean, numbers and plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from urdyn.report.digits import MISSING
from urdyn.report.names import spoken
from urdyn.view.film import Film, Moment
from urdyn.view.paint import LINES, PAINTS

SPEEDS = ("0.25", "1", "4", "16", "64")
POINTS = 400  # per line of a plot
PLOTS = {
    "friction": "friction since commissioning [%], over time [s]",
    "torque": "residual torque [N·m], over time [s]",
}
TIMES = 50.0  # [-] of a ghost's distance at first: what a calibration corrects is hardly visible


@dataclass(frozen=True)
class Asked:
    """What its user wants to see."""

    paint: str  # one of PAINTS
    ghost: bool
    times: float  # [-] by which the ghost stands further off
    arrows: bool
    arrow: float  # [m/(N·m)] length of an arrow


@dataclass(frozen=True, eq=False)
class Panel:
    """Handles of a browser's controls."""

    joints: tuple[str, ...]
    controls: Mapping[str, Any]  # time, play, speed; paint, ghost, times, arrows, arrow
    legend: Any
    apart: Any
    table: Any
    plots: Mapping[str, Any]

    def asked(self) -> Asked:
        """The controls as they stand."""
        told = {name: self.controls[name].value for name in Asked.__annotations__}
        return Asked(**told)

    def tell(self, moment: Moment, past: Film, apart: tuple[float, float]) -> None:
        """Show the numbers of a moment, and the plots of what led there."""
        legend = PAINTS[self.asked().paint].legend()
        if self.legend.content != legend:
            self.legend.content = legend
        self.table.content = numbers(self.joints, moment)
        metres, radians = apart
        self.apart.content = f"Tool: {1e3 * metres:.2f} mm, {1e3 * radians:.2f} mrad apart"
        for name, plot in self.plots.items():
            plot.data = lines(past, name)


def make_panel(
    gui: Any, joints: Sequence[str], title: str, end: float, arrow: float, ghost: bool
) -> Panel:
    """The controls, in a browser's side bar.

    Args:
        end: of the film [s]; 0: it is live, and cannot be wound back.
        ghost: whether the nominal arm is shown at first.
    """
    gui.add_html(f'<div style="padding:0 12px"><b>{escape(title)}</b></div>')
    controls: dict[str, Any] = {}
    if end:
        controls["time"] = gui.add_slider("time [s]", 0.0, end, min(0.01, end), 0.0)
        controls["play"] = gui.add_checkbox("play", True)
        controls["speed"] = gui.add_dropdown("speed", SPEEDS, initial_value="1")
    controls["paint"] = gui.add_dropdown("colour by", tuple(PAINTS), initial_value="friction")
    legend = gui.add_html("")
    table = gui.add_html("")
    with gui.add_folder("Residual torque"):
        controls["arrows"] = gui.add_checkbox("arrows", True)
        controls["arrow"] = gui.add_number("m per N·m", arrow, min=0.0, step=arrow / 10.0)
    with gui.add_folder("Ghost of the nominal arm", expand_by_default=ghost):
        controls["ghost"] = gui.add_checkbox("show", ghost)
        controls["times"] = gui.add_slider("times as far", 1.0, 200.0, 1.0, TIMES)
        apart = gui.add_markdown("")
    nothing = tuple(np.zeros(1) for _ in range(len(joints) + 1))
    plots = {name: _plot(gui, label, joints, nothing) for name, label in PLOTS.items()}
    return Panel(tuple(joints), controls, legend, apart, table, plots)


def lines(past: Film, name: str) -> tuple[Any, ...]:
    """Time and one line per joint of a quantity, thinned; where it is not known the line is held.

    uPlot draws nothing at all on an axis where a number is missing, which is right where nothing is
    known of any joint.
    """
    thin = past.slice(0, len(past), max(1, len(past) // POINTS))
    rows = np.arange(len(thin))[:, None]
    y = getattr(thin, name)
    if np.isnan(y).all():
        return (np.array(thin.t), *np.array(y).T.copy())
    last = np.maximum.accumulate(np.where(np.isfinite(y), rows, 0), axis=0)
    held = np.nan_to_num(np.take_along_axis(y, last, axis=0))
    return (np.array(thin.t), *held.T.copy())


def numbers(joints: Sequence[str], moment: Moment) -> str:
    """HTML of every joint's numbers, so that no colour has to be read off."""
    head = "".join(f"<th>{word}</th>" for word in ("", "friction", "health", "residual"))
    rows = zip(joints, moment.friction, moment.health, moment.torque, strict=True)
    body = "".join(
        f'<tr><td style="text-align:left">{_stroke(j)} {escape(spoken(name))}</td>'
        f"<td>{_said(f, '%')}</td><td>{_said(h, '%')}</td><td>{_said(tau, 'N·m')}</td></tr>"
        for j, (name, f, h, tau) in enumerate(rows)
    )
    style = "width:100%;font-size:12px;text-align:right;font-variant-numeric:tabular-nums"
    return f'<div style="padding:0 12px"><table style="{style}"><tr>{head}</tr>{body}</table></div>'


def _stroke(joint: int) -> str:
    """A sample of the line that a joint has in the plots."""
    return (
        f'<i style="display:inline-block;width:14px;height:3px;vertical-align:middle;'
        f'background:{LINES[joint % len(LINES)]}"></i>'
    )


def _said(value: float, unit: str) -> str:
    if not np.isfinite(value):
        return MISSING
    rounded = round(value, 1) + 0.0
    return f"{rounded:+.1f} {unit}".replace("-", "−") if rounded else f"0 {unit}"


def _plot(gui: Any, label: str, joints: Sequence[str], data: tuple[Any, ...]) -> Any:
    """An empty plot, one line per joint."""
    series = tuple(
        {"label": spoken(name), "stroke": LINES[j % len(LINES)], "width": 1.5}
        for j, name in enumerate(joints)
    )
    return gui.add_uplot(
        data,
        ({"label": "t [s]"}, *series),
        title=label,
        scales={"x": {"time": False, "auto": True}, "y": {"auto": True}},
        legend={"show": False},
        aspect=2.2,
        padding=(14, 14, 0, 0),
    )
