"""The two slices of a run's network, drawn, and described for those who cannot see."""

from __future__ import annotations

from urdyn.dbn.drawing import svg
from urdyn.report.markup import Html, section, tag, text
from urdyn.tracking.belief.network import tracked_network

LEAD = (
    "The dynamic Bayesian network that the filter assumes: the arm at one sample and at the next. "
    "Each parameter drifts from slice to slice and acts on the currents; the motion is given. "
    "Friction acts on damping, and has a cause of wear in common with health. Every joint has such "
    "a network, and all are inferred together."
)


def network() -> Html:
    """The network of a tracked run."""
    graph = tracked_network()
    words = tag("pre", text(graph))
    return section(
        "Network",
        LEAD,
        tag("div", Html(svg(graph)), kind="scroll drawing"),
        tag("details", tag("summary", text("The same in words")), words),
    )
