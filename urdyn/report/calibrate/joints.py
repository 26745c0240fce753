"""Effects of joints beyond geometry: error over a turn, and compliance under gravity."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from urdyn.identify.kinematics import Calibration
from urdyn.report.canvas import OURS, band, figure, line
from urdyn.report.digits import interval90
from urdyn.report.markup import Html, grid, plot, section, table, text
from urdyn.report.names import spoken
from urdyn.types import NORMAL90

POINTS = 361


def joints_section(c: Calibration) -> Html:
    """A curve per joint, and the compliances."""
    effects = c.found.placement.effects
    curves = [
        plot(_curve(c, j), spoken(name), "error of its angle, round a turn")
        for j, name in enumerate(c.arm.joint_names)
    ]
    return section(
        "What the joints do",
        "Regions that were held out prefer a model in which angles are a little wrong: periodic "
        "round a turn, as encoders and gears are, and yielding to gravity. No file of other tools "
        "can carry this; calibration.toml does. Bands hold 90 %; they are wide where no pose was.",
        *([_soft(c)] if effects.compliant else []),
        *([grid(*curves)] if effects.harmonics else []),
    )


def _soft(c: Calibration) -> Html:
    """Compliances [mrad/(kN m)]."""
    first = len(c.sd) - len(c.found.placement.coefficients)
    rows = []
    for k, j in enumerate(c.found.placement.effects.compliant):
        value, sd = float(c.found.placement.coefficients[k]), float(c.sd[first + k])
        name = spoken(c.arm.joint_names[j])
        rows.append([text(name), text(interval90(1e6 * value, 1e6 * sd))])
    return table(["joint", "compliance ± 90 % [mrad/(kN m)]"], rows)


def _curve(c: Calibration, joint: int) -> go.Figure:
    """The joint's error over a turn."""
    effects, arm = c.found.placement.effects, c.arm
    q = np.zeros((POINTS, arm.joints))
    q[:, joint] = np.linspace(-np.pi, np.pi, POINTS)
    own = (effects.owners == joint) & (effects.orders > 0.0)
    phi = effects.columns(q)[:, own]
    first = len(c.sd) - len(c.found.placement.coefficients)
    rows = first + np.flatnonzero(own)
    value = 1e3 * phi @ c.found.placement.coefficients[own]
    cov = c.found.posterior.cov[np.ix_(rows, rows)]
    sd = 1e3 * np.sqrt(np.einsum("np,pq,nq->n", phi, cov, phi, optimize=True))
    angle = np.degrees(q[:, joint])
    low, high = value - NORMAL90 * sd, value + NORMAL90 * sd
    traces = [*band(angle, low, high, "90 %"), line(angle, value, "error", OURS)]
    drawing = figure(traces, "angle [deg]", "error [mrad]", 200)
    return drawing.update_xaxes(range=[-180, 180], dtick=90)
