"""The arm in space while it moves: one pose at a time, and where its tool goes."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from urdyn.identify.excite import Excitation
from urdyn.report.canvas import LEFT, MEASURED, OURS, brief, figure
from urdyn.report.markup import Html, plot, section
from urdyn.types import Array

POSES = 48  # that the slider passes through
TRACK = 400  # points of the tool's track
LEAD = (
    "Drag the slider through the motion; turn the view with the mouse. Lines join the joints, the "
    "thin line is where the tool goes."
)


def scene(found: Excitation) -> Html:
    """The section with the arm in space."""
    drawing = _drawing(found)
    axes = "axes of the root link, a UR's base_link [m]"
    return section("The arm in its cell", LEAD, plot(drawing, "Pose over time", axes))


def _drawing(found: Excitation) -> go.Figure:
    rows = found.trajectory
    some = np.linspace(0, len(rows) - 1, POSES).astype(int)
    skeletons = _skeletons(found, rows.q[some])
    track = found.arm.pose(rows.q[np.linspace(0, len(rows) - 1, TRACK).astype(int)])[:, :3, 3]
    fixed = [_line(track, "tool", MEASURED, 2.0), *_solids(found)]
    poses = [
        _line(points, f"{rows.t[k]:.1f} s", OURS, 9.0, visible=k == some[0], mode="lines+markers")
        for k, points in zip(some, skeletons, strict=True)
    ]
    steps = [
        {
            "method": "restyle",
            "label": f"{rows.t[k]:.1f}",
            "args": ["visible", [True] * len(fixed) + [n == m for m in range(POSES)]],
        }
        for n, k in enumerate(some)
    ]
    slider = {"steps": steps, "currentvalue": {"prefix": "time [s] "}, "pad": {"t": 10}}
    drawing = figure(
        [*fixed, *poses], "", "", 520, sliders=[slider], margin={"l": 0, "t": 0, "r": 0, "b": 80}
    )
    return drawing.update_layout(scene=_axes(found, np.concatenate([track, *skeletons])))


def _skeletons(found: Excitation, q: Array) -> Array:
    """Places of the root, every joint and the tool, (N, J + 2, 3) [m]."""
    arm = found.arm
    joints = [arm.pose(q, link)[:, :3, 3] for link in arm.link_names]
    return np.stack([np.zeros((len(q), 3)), *joints, arm.pose(q)[:, :3, 3]], axis=1)


def _line(points: Array, name: str, colour: str, width: float, **more: Any) -> go.Scatter3d:
    x, y, z = (brief(column) for column in points.T)
    style = {"color": colour, "width": width}
    dot = {"color": colour, "size": 4}
    more = {"mode": "lines"} | more
    return go.Scatter3d(x=x, y=y, z=z, name=name, line=style, marker=dot, **more)


def _solids(found: Excitation) -> list[go.Scatter3d]:
    """Edges of the cell's boxes, other solids as the boxes around them."""
    edges = []
    for solid in found.ask.cell.solids:
        half = 0.5 * solid.size if solid.shape == "box" else np.full(3, solid.size[0])
        if solid.shape == "cylinder":
            half = np.array([solid.size[0], solid.size[0], 0.5 * solid.size[1]])
        edges.append(_line(_box(half) @ _turned(solid.rpy).T + solid.xyz, solid.name, LEFT, 4.0))
    return edges


def _box(half: Array) -> Array:
    """Corners of a box in an order that draws all its edges, (16, 3)."""
    walk = "000 100 110 010 000 001 101 100 101 111 110 111 011 010 011 001"
    corners = np.array([[int(digit) for digit in corner] for corner in walk.split()])
    return np.asarray((2.0 * corners - 1.0) * half)


def _turned(rpy: Array) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_euler("xyz", rpy).as_matrix())


def _axes(found: Excitation, points: Array) -> dict[str, Any]:
    """Equal scales, and the floor where there is one."""
    reach = float(np.abs(points).max()) + 0.1
    low, high = np.full(3, -reach), np.full(3, reach)
    for wall in found.ask.cell.walls:
        if wall.name == "floor":
            low[2] = wall.point[2]
    quiet = {"showbackground": False, "gridcolor": "rgba(138,143,152,0.35)", "zeroline": False}
    floor = {"showbackground": True, "backgroundcolor": "rgba(138,143,152,0.16)"}
    named = {
        f"{axis}axis": quiet | {"title": {"text": f"{axis} [m]"}, "range": [low[k], high[k]]}
        for k, axis in enumerate("xyz")
    }
    named["zaxis"] |= floor
    camera = {"eye": {"x": 1.75, "y": 1.4, "z": 0.8}, "center": {"x": 0.0, "y": 0.0, "z": -0.15}}
    return named | {"aspectmode": "data", "camera": camera}
