"""What a calibration leaves unexplained."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from urdyn.report.canvas import JOINTS, OURS, dots, figure
from urdyn.report.digits import number
from urdyn.report.markup import Html, grid, plot, section
from urdyn.report.names import spoken
from urdyn.types import Array, Index, Mask

SHOWN = 3000  # poses that a plot shows
AXES = ("x", "y", "z")


def residuals_section(e: Array, sound: Mask, q: Array, joints: Sequence[str]) -> Html:
    """Residuals e (N, 6) over the poses, their size, and over each joint's angle."""
    length = 1e3 * np.linalg.norm(e[:, :3], axis=1)
    rows = np.linspace(0, len(e) - 1, min(len(e), SHOWN)).round().astype(np.intp)
    rows = rows[sound[rows]]
    lead = (
        "Measured less predicted, in the axes of the robot’s base, a UR’s as its pendant shows it. "
        "What is left should look like noise: a wave over a joint’s angle is something that the "
        "model does not know."
    )
    if not sound.all():
        lead += (
            f" {int((~sound).sum())} gross errors, up to {number(length.max())} mm, are left out."
        )
    along = [plot(_over_angle(e, q, j, rows), spoken(name), "") for j, name in enumerate(joints)]
    return section(
        "What is left",
        lead,
        grid(
            plot(
                _in_order(e, rows),
                "In the order of the file",
                "",
                dict(zip(AXES, JOINTS, strict=False)),
            ),
            plot(_sizes(length[sound]), "Distance from prediction", f"{int(sound.sum()):,} poses"),
            kind="two",
        ),
        grid(*along),
    )


def _in_order(e: Array, rows: Index) -> go.Figure:
    traces = [
        dots(rows, 1e3 * e[rows, k], axis, JOINTS[k], 3, opacity=0.6) for k, axis in enumerate(AXES)
    ]
    return figure(traces, "pose", "residual [mm]", 260)


def _sizes(length: Array) -> go.Figure:
    counts, edges = np.histogram(length, bins=50)
    bar = go.Bar(x=0.5 * (edges[1:] + edges[:-1]), y=counts, marker={"color": OURS})
    return figure([bar], "distance [mm]", "poses", 260, bargap=0.02)


def _over_angle(e: Array, q: Array, joint: int, rows: Index) -> go.Figure:
    angle = np.degrees(np.angle(np.exp(1j * q[rows, joint])))
    traces = [
        dots(angle, 1e3 * e[rows, k], axis, JOINTS[k], 2.5, opacity=0.5)
        for k, axis in enumerate(AXES)
    ]
    return figure(traces, "angle [deg]", "residual [mm]", 190).update_xaxes(range=[-180, 180])
