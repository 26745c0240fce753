"""Where the tool will be: expected error all over the workspace, drawn on the arm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from urdyn.identify.kinematics import Calibration
from urdyn.model.geometry.turns import places_of, turn_z
from urdyn.report.calibrate.words import MODELS
from urdyn.report.canvas import CONTROLLER, MEASURED, OURS, TRUTH, brief, figure, line
from urdyn.report.digits import number
from urdyn.report.markup import Html, grid, plot
from urdyn.types import Array

POSTURE = np.radians([0.0, -70.0, 95.0, -25.0, -90.0, 0.0])  # in which the arm is drawn
INK = "#8A8F98"
COLOURS = {
    "nominal": MEASURED,
    "geometry": CONTROLLER,
    "compliance": TRUTH,
    "transmission": OURS,
    "geometry and joints": OURS,
}


def space_section(c: Calibration, summary: Mapping[str, Any]) -> Html:
    """The map, and the error by model beside it."""
    held = {name: told["rms_mm"] for name, told in summary["held_out"].items()}
    errors = {"nominal": summary["nominal_rms_mm"], **held}
    note = "in regions held out; of the drawing, over all poses"
    return grid(
        plot(_map(c), "Expected error of the tool [mm]", "RMS over poses free of self-collision"),
        plot(
            bars(errors),
            "Error by model [mm]",
            note,
            models_key(errors),
        ),
        kind="wide-first",
    )


def bars(errors: Mapping[str, float]) -> go.Figure:
    """Error by model [mm]."""
    drawing = figure(
        [
            go.Bar(
                x=[k],
                y=[value],
                marker={"color": COLOURS[name]},
                text=[number(value)],
                textposition="outside",
                cliponaxis=False,
                hovertemplate=f"{MODELS[name]}: %{{y:.3f}} mm",
            )
            for k, (name, value) in enumerate(errors.items())
        ],
        "",
        "RMS [mm]",
        340,
    )
    return drawing.update_xaxes(showticklabels=False)


def models_key(errors: Mapping[str, float]) -> dict[str, str]:
    """Which bar is which model."""
    return {MODELS[name]: COLOURS[name] for name in errors}


def _map(c: Calibration) -> go.Figure:
    """The arm from the side, every pose of the tool at its distance from the first axis."""
    space, error = c.space, 1e3 * c.space.error
    arm = skeleton(c)
    across = np.hypot(space.place[:, 0], space.place[:, 1])
    order = np.argsort(error)
    marks = go.Scatter(
        x=brief(across[order]),
        y=brief(space.place[order, 2]),
        mode="markers",
        marker={
            "size": 6,
            "color": brief(error[order]),
            "colorscale": "Viridis",
            "cmin": float(np.quantile(error, 0.02)),
            "cmax": float(np.quantile(error, 0.98)),
            "colorbar": {"thickness": 12, "title": {"text": "mm"}},
        },
        hovertemplate="%{marker.color:.3f} mm",
    )
    side = np.sign(arm[-1, 0]) * arm[:, 0]
    body = line(side, arm[:, 2], "the arm", INK, 9, hoverinfo="skip")
    spine = go.Scatter(
        x=brief(side), y=brief(arm[:, 2]), mode="lines+markers", hoverinfo="skip",
        line={"color": "#ffffff", "width": 1.5}, marker={"color": "#ffffff", "size": 7},
    )  # fmt: skip
    drawing = figure([marks, body, spine], "distance from the first axis [m]", "height [m]", 420)
    drawing.update_xaxes(rangemode="tozero")
    return drawing.update_yaxes(scaleanchor="x", constrain="domain")


def skeleton(c: Calibration) -> Array:
    """Where the base, the joints and the tool of the drawn arm are, (J + 2, 3) [m]."""
    form, tool = c.drawing.form, c.found.placement.tool
    q = POSTURE if len(form.joint_names) == len(POSTURE) else np.zeros(len(form.joint_names))
    pose, places = np.eye(4), [np.zeros(3)]
    for origin, angle in zip(places_of(form.nominal), q, strict=True):
        pose = pose @ origin @ turn_z(float(angle))
        places.append(pose[:3, 3])
    return np.array([*places, (pose @ tool)[:3, 3]])
