"""How much the data determine each kind of parameter, and what rests on the prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from urdyn.identify import Fit, Score
from urdyn.model.body import BODY
from urdyn.report.canvas import dots, figure, joint_colours
from urdyn.report.markup import Html, plot, section
from urdyn.report.names import QUANTITIES, joints
from urdyn.types import Array

STILL = np.radians(5.0)  # [rad] of travel: a joint with less in every log hardly moved


def identifiability(fit: Fit, scores: Sequence[Score]) -> Html:
    """How much the data determine each kind of parameter."""
    return section(
        "What the data determine, and what they leave to the prior",
        f"Rank {fit.rank} of {fit.n_parameters} columns: the data fix {fit.rank} combinations of "
        f"the link inertials and the joints’ core friction terms; the other "
        f"{fit.n_parameters - fit.rank} rest on the prior. {still(fit, scores)}",
        plot(
            _informed(fit),
            "Informed",
            "share of the prior’s variance that the data removed; bar: mean, dots: joints or links",
            joint_colours(joints(fit)),
        ),
    )


def still(fit: Fit, scores: Sequence[Score]) -> str:
    """Which joints hardly moved in any log."""
    if not scores:
        return ""
    travel = np.max([_travel(s.log.joint("actual_q")) for s in scores], axis=0)
    idle = [name for name, angle in zip(joints(fit), travel, strict=True) if angle < STILL]
    if not idle:
        return "Every joint moved."
    return f"Hardly moved (less than 5°): {', '.join(idle)}; estimates are mostly the prior."


def _travel(q: Array) -> Array:
    """Range of each joint's angle, (N, J) -> (J,) [rad]."""
    top, bottom = np.where(np.isfinite(q), q, -np.inf), np.where(np.isfinite(q), q, np.inf)
    return np.asarray(top.max(axis=0) - bottom.min(axis=0))


def _groups(fit: Fit) -> dict[str, list[list[float]]]:
    """Informed share by kind of parameter: label -> owners -> shares, of estimated parameters."""
    arm = fit.dynamics.arm
    kinds = {"mass": BODY[:1], "centre of mass": BODY[1:4], "inertia": BODY[4:]}
    bodies = {
        k: [[f"{link}.{x}" for x in xs] for link in arm.link_names] for k, xs in kinds.items()
    }
    drives = {
        label: [[f"{joint}.{q}"] for joint in arm.joint_names] for q, label in QUANTITIES.items()
    }
    sought = {name for name, sd in zip(fit.parameters.names, fit.prior_sd, strict=True) if sd > 0.0}
    shares = {
        label: [[100.0 * fit.informed(name) for name in names if name in sought] for names in each]
        for label, each in (bodies | drives).items()
    }
    return {label: each for label, each in shares.items() if any(each)}


def _informed(fit: Fit) -> go.Figure:
    groups = _groups(fit)
    labels = list(groups)
    means = [float(np.mean([x for xs in found for x in xs])) for found in groups.values()]
    bar = go.Bar(
        x=means, y=labels, orientation="h", name="mean", showlegend=False,
        marker={"color": "rgba(138,143,152,0.35)"}, width=0.62, hovertemplate="mean %{x:.0f} %",
    )  # fmt: skip
    traces = [bar]
    for j, (owner, colour) in enumerate(joint_colours(joints(fit)).items()):
        told = [(float(np.mean(found[j])), label) for label, found in groups.items() if found[j]]
        x, y = zip(*told, strict=True)
        traces.append(dots(x, y, owner, colour, 7, hovertemplate=f"{owner}: %{{x:.0f}} %"))
    drawing = figure(traces, "informed [%]", "", 50 + 24 * len(labels))
    drawing.update_xaxes(range=[-1.5, 101.5])
    return drawing.update_yaxes(autorange="reversed", automargin=True)
