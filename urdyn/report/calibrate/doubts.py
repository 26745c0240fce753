"""What the poses cannot determine, where the fit was tested, and which poses would help."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from urdyn.identify.kinematics import Calibration
from urdyn.report.calibrate.space import COLOURS, models_key
from urdyn.report.calibrate.words import label
from urdyn.report.canvas import figure
from urdyn.report.digits import fixed, number, percent
from urdyn.report.markup import Html, paragraph, plot, section, table, tag, text
from urdyn.report.names import spoken

FRAMES = ("base", "tool")
SAME = 0.9  # correlation from which on two unknowns have the same effect


def doubts(c: Calibration, summary: Mapping[str, Any]) -> Html:
    """Trade-offs, regions held out, proposed poses."""
    errors = {name: told["rms_mm"] for name, told in summary["held_out"].items()}
    return section(
        "How sure, and where not",
        "The poses were parted into regions by their joint angles; each was predicted by fits "
        "that had not seen it. A fit that is much worse there than at home does not know the arm, "
        "it knows the poses.",
        plot(_regions(c), "Error in each region, held out", "", models_key(errors)),
        tag("h3", text("What the poses leave open")),
        _open(c),
        tag("h3", text("Poses that would tell most of what poses can tell [deg]")),
        _proposed(c),
    )


def _regions(c: Calibration) -> go.Figure:
    bars = [
        go.Bar(
            x=[str(k + 1) for k in range(len(trial.rms))],
            y=1e3 * trial.rms,
            marker={"color": COLOURS[trial.model.name]},
            hovertemplate="%{y:.3f} mm",
        )
        for trial in c.choice.trials
    ]
    drawing = figure(bars, "region", "RMS [mm]", 260, barmode="group", bargap=0.25)
    return drawing.update_xaxes(type="category")


def _open(c: Calibration) -> Html:
    if not c.weak:
        return paragraph("Nothing: every coordinate is far surer than before.")
    rows = [
        [
            text(label(w.name)),
            text(percent(w.left)),
            text("; ".join(f"{name} ({number(r)})" for name, r in w.partners) or "nothing alone"),
            text(_remedy(w.partners)),
        ]
        for w in c.weak
    ]
    return table(
        ["", "left of prior", "trades off with (correlation)", "what helps"], rows, "words"
    )


def _remedy(partners: tuple[tuple[str, float], ...]) -> str:
    """What would separate a coordinate from its partners."""
    same = {name.rpartition(".")[0] for name, r in partners if abs(r) > SAME}
    frames = sorted(same.intersection(FRAMES))
    if frames:
        return f"no pose does: know the {' and the '.join(frames)} by other means"
    return "poses as proposed below"


def _proposed(c: Calibration) -> Html:
    heads = ["", *(spoken(name) for name in c.arm.joint_names)]
    rows = [
        [text(k + 1), *(text(fixed(angle)) for angle in np.degrees(q))]
        for k, q in enumerate(c.proposed)
    ]
    return table(heads, rows)
