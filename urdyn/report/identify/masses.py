"""Masses of the links and the payload, and what the data contribute to them."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from urdyn.identify import Fit
from urdyn.model.body import BODY, centre_of_mass
from urdyn.report.canvas import OURS, PRIOR, TRUTH, dots, figure
from urdyn.report.digits import interval90, number, percent
from urdyn.report.identify.comparison import Truth
from urdyn.report.markup import Html, cell, grid, paragraph, plot, section, table, text
from urdyn.report.names import spoken
from urdyn.types import NORMAL90, Array

WHY = (
    "No link’s mass can be known by itself on a fixed base. Joint torques show only sums in which "
    "mass can be traded between neighbouring links, and nothing at all of the first link’s mass, "
    "which no joint lifts. The prior holds those directions; the sums that torque needs are known."
)


def masses(fit: Fit, truth: Truth | None) -> Html:
    """Masses before and after, with the payload where there is one."""
    colours = {"prior": PRIOR, "estimate": OURS} | ({"truth": TRUTH} if truth else {})
    return section(
        "Masses",
        WHY,
        grid(
            plot(_masses(fit, truth), "Mass of each link", "dot and 90 % interval", colours),
            _table(fit),
            kind="two",
        ),
        *([_tool(fit)] if fit.tool_known else []),
        *(_payload(fit, k) for k in range(len(fit.payloads))),
    )


def _masses(fit: Fit, truth: Truth | None) -> go.Figure:
    links = fit.dynamics.arm.link_names
    at = [fit.parameters.names.index(f"{link}.mass") for link in links]
    y = np.arange(float(len(links)))
    traces = [
        _whiskers(fit.prior[at], fit.prior_sd[at], y - 0.16, "prior", PRIOR),
        _whiskers(fit.parameters.values[at], fit.sd[at], y + 0.16, "estimate", OURS),
    ]
    if truth:
        true = [link["mass"] for link in truth["links"]]
        traces.append(
            dots(
                true,
                y,
                "truth",
                TRUTH,
                9,
                marker={"symbol": "x-thin", "line": {"width": 2, "color": TRUTH}},
            )
        )
    drawing = figure(traces, "mass [kg]", "", 40 + 42 * len(links))
    drawing.update_xaxes(rangemode="tozero")
    return drawing.update_yaxes(
        tickvals=y,
        ticktext=[spoken(link) for link in links],
        range=[len(links) - 0.5, -0.5],
        automargin=True,
    )


def _whiskers(x: Array, sd: Array, y: Array, name: str, colour: str) -> go.Scatter:
    error = {"type": "data", "array": NORMAL90 * sd, "thickness": 2, "width": 0}
    return dots(x, y, name, colour, 8, error_x=error, hovertemplate="%{x:.3g} kg")


def _table(fit: Fit) -> Html:
    rows = []
    for link in fit.dynamics.arm.link_names:
        name = f"{link}.mass"
        at = fit.parameters.names.index(name)
        prior = interval90(float(fit.prior[at]), float(fit.prior_sd[at]))
        estimate = interval90(fit.value(name), fit.spread(name))
        rows.append(
            [text(spoken(link)), cell(prior), cell(estimate), cell(percent(fit.informed(name)))]
        )
    return table(["link", "prior [kg]", "estimate [kg]", "informed"], rows)


def _tool(fit: Fit) -> Html:
    """The tool as the user specified it."""
    tool = fit.dynamics.payload
    if not tool[0]:
        return paragraph("Tool: none in these logs, as it was named.")
    centre = ", ".join(number(1e3 * x, 3) for x in centre_of_mass(tool))
    return paragraph(
        f"Tool: {number(float(tool[0]), 3)} kg, centre of mass at {centre} mm in the flange frame, "
        "as it was named; links do not include it."
    )


def _payload(fit: Fit, k: int) -> Html:
    name = f"payload_{k}"
    mass = interval90(fit.value(f"{name}.mass"), fit.spread(f"{name}.mass"))
    centre = (
        interval90(1e3 * fit.value(f"{name}.{x}"), 1e3 * fit.spread(f"{name}.{x}"))
        for x in BODY[1:4]
    )
    which = f"Payload {k + 1}" if len(fit.payloads) > 1 else "Payload"
    return paragraph(
        f"{which}: {mass} kg, centre of mass at {', '.join(centre)} mm in the tool frame."
    )
