"""The two slices of the network that a run infers, drawn, and in words for those who cannot see."""

from __future__ import annotations

from urdyn.dbn.drawing import svg
from urdyn.report.markup import Html, section, tag, text
from urdyn.tracking.network import tracked_network

LEAD = (
    "What the filter takes to move what: the arm at one sample and at the next. Each parameter "
    "strays by itself from slice to slice, and moves the motor currents; the motion is given. "
    "Friction leads damping, and shares with health what wears both. Joint by joint, all at once."
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
