"""For a simulated arm: does the truth lie within the estimates' intervals?"""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go

from urdyn.identify import Fit
from urdyn.report.canvas import dots, figure, joint_colours, rule, shade
from urdyn.report.digits import interval90, number, percent
from urdyn.report.identify.comparison import Comparison, Truth, compare, left_out, share_inside
from urdyn.report.markup import Html, cell, paragraph, plot, section, table, text
from urdyn.report.names import QUANTITIES, joints, shown, spoken
from urdyn.types import NORMAL90

LABELS = QUANTITIES | {"mass": "mass of the link"}


def truth_section(fit: Fit, truth: Truth) -> Html:
    """Truth beside estimate, with the z-score that shows whether an interval is too narrow."""
    found = compare(fit, truth)
    inside = sum(c.inside for c in found)
    missing = left_out(fit, truth)
    lead = (
        f"The arm is simulated, so the truth is known: {inside} of {len(found)} quantities "
        f"({percent(share_inside(found))}) lie inside their 90 % interval. z is the error in "
        "standard deviations."
    )
    return section(
        "Estimates beside the truth",
        lead,
        plot(
            _scores(fit, found),
            "Error in standard deviations",
            "clear strip: 90 % interval",
            joint_colours(joints(fit)),
        ),
        _table(fit, found),
        *([paragraph(_missing(missing), "note")] if missing else []),
    )


def _missing(terms: Sequence[Comparison]) -> str:
    names = ", ".join(f"{spoken(c.owner)} {LABELS[c.quantity]}" for c in terms)
    return f"The arm has these terms, but its data did not call for them: {names}."


def _scores(fit: Fit, found: Sequence[Comparison]) -> go.Figure:
    arm = fit.dynamics.arm
    traces = []
    colours = joint_colours(joints(fit))
    for name, *owners in zip(colours, arm.joint_names, arm.link_names, strict=True):
        mine = [c for c in found if c.owner in owners]
        traces.append(
            dots([c.z for c in mine], [LABELS[c.quantity] for c in mine], name, colours[name], 8)
        )
    quantities = {c.quantity for c in found}
    reach = max(3.3, *(abs(c.z) + 0.3 for c in found))
    shapes = [shade(-reach, -NORMAL90), shade(NORMAL90, reach), rule(x=0.0)]
    drawing = figure(
        traces,
        "z = (estimate − truth) / sd [-]",
        "",
        50 + 26 * len(quantities),
        shapes=shapes,
    )
    drawing.update_xaxes(range=[-reach, reach])
    return drawing.update_yaxes(autorange="reversed", automargin=True)


def _table(fit: Fit, found: Sequence[Comparison]) -> Html:
    arm = fit.dynamics.arm
    by_place = {(c.owner, c.quantity): c for c in found}
    owners = [*zip(arm.joint_names, arm.link_names, strict=True)]
    units = {c.quantity: shown(c.quantity, c.unit)[1] for c in found}
    rows = [
        [cell(label, units[quantity])]
        + [
            _cell(by_place.get((joint, quantity)) or by_place.get((link, quantity)))
            for joint, link in owners
        ]
        for quantity, label in LABELS.items()
        if quantity in units
    ]
    loads = [[text("payload [kg]"), _cell(c)] for c in found if c.owner.startswith("payload")]
    return table(["estimate ± 90 %; truth, z", *joints(fit)], [*rows, *loads])


def _cell(c: Comparison | None) -> Html:
    if c is None:
        return text("–")
    verdict = "" if c.inside else ", outside"
    factor, _ = shown(c.quantity, c.unit)
    remark = f"{number(factor * c.true, 3)}, z {number(c.z)}{verdict}"
    return cell(
        interval90(factor * c.estimate, factor * c.sd),
        remark,
        "value" if c.inside else "value outside",
    )
