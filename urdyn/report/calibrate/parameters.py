"""The geometry's coordinates with their intervals, beside the prior's."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from urdyn.identify.kinematics import Calibration
from urdyn.report.calibrate.words import deviation, label
from urdyn.report.canvas import MEASURED, OURS, figure
from urdyn.report.digits import percent
from urdyn.report.markup import Html, cell, grid, plot, section, table, tag, text
from urdyn.types import NORMAL90


def parameters_section(c: Calibration) -> Html:
    """Differences from the drawing."""
    units = c.drawing.form.units
    marks = {"this arm, 90 %": OURS, "arms of all types, 90 %": MEASURED}
    return section(
        "How the arm differs from its drawing",
        "Coordinates of each joint’s axis in the frame of the joint before: a and d along, alpha "
        "and beta across, theta about the axis. Grey is what factory calibrations of other arms "
        "spread; where blue is as wide as grey, the poses told nothing.",
        grid(
            plot(_drawn(c, units, "m"), "Lengths", "difference from the drawing", marks),
            plot(_drawn(c, units, "rad"), "Angles", "difference from the drawing", marks),
            kind="two",
        ),
        tag("details", tag("summary", text("The same in numbers")), _numbers(c)),
    )


def _drawn(c: Calibration, units: tuple[str, ...], unit: str) -> go.Figure:
    """Dots with bars, over the prior's."""
    rows = [k for k, u in enumerate(units) if u == unit]
    names = [label(c.drawing.form.names[k]) for k in rows]
    values = 1e3 * c.found.placement.deviations[rows]
    traces = [
        _interval(np.zeros(len(rows)), 1e3 * c.spread[rows], names, MEASURED, 7, 0),
        _interval(values, 1e3 * c.sd[rows], names, OURS, 2, 8),
    ]
    drawing = figure(traces, f"[m{unit}]", "", 60 + 22 * len(rows))
    return drawing.update_yaxes(autorange="reversed", automargin=True)


def _interval(
    values: np.ndarray, sd: np.ndarray, names: list[str], colour: str, width: float, size: float
) -> go.Scatter:
    return go.Scatter(
        x=values,
        y=names,
        mode="markers",
        marker={"color": colour, "size": max(size, 1)},
        opacity=1.0 if size else 0.35,
        error_x={"array": NORMAL90 * sd, "color": colour, "thickness": width, "width": 0},
        hovertemplate="%{y}: %{x:.4f}",
    )


def _numbers(c: Calibration) -> Html:
    rows = []
    form = c.drawing.form
    for k, (name, unit) in enumerate(zip(form.names, form.units, strict=True)):
        left = float(c.sd[k] / c.spread[k])
        value = deviation(float(c.found.placement.deviations[k]), float(c.sd[k]))
        rows.append([text(label(name)), cell(value), text(f"m{unit}"), cell(percent(min(left, 1)))])
    return table(["", "difference ± 90 %", "unit", "left of prior’s spread"], rows)
