"""The arm's payload, and when the tracker found that it changed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from urdyn.io.spans import Clock
from urdyn.report.canvas import LEFT, OURS, line
from urdyn.report.digits import interval90
from urdyn.report.markup import Html, cell, grid, plot, section, table, text
from urdyn.report.track.history import PAYLOAD, History
from urdyn.report.track.trace import PALE, POINTS, extent, trend
from urdyn.types import Array

MOMENTS = {"mass": "mass", "mx": "first moment x", "my": "first moment y", "mz": "first moment z"}
OUTSIDE = "estimates that have not settled may lie outside; double-click to see all"


def carried(history: History, changed: Sequence[float], known: bool) -> str:
    """The payload now, and since when; `known`: the currents have told it."""
    if not known:
        return f"The currents say too little of the payload{_since(changed, history.clock)}."
    mass = history.series(PAYLOAD, "mass")
    now = f"{interval90(float(mass.mean[-1]), float(mass.sd[-1]))} kg"
    if abs(mass.mean[-1]) < 2.0 * mass.sd[-1]:
        what = f"The payload cannot be distinguished from none: {now}"
    else:
        what = f"The payload is now {now}"
    return f"{what}{_since(changed, history.clock)}."


def _since(changed: Sequence[float], clock: Clock) -> str:
    if not changed:
        return ""  # a finding reports one that was there from the beginning
    times = f", the last of {len(changed)} changes" if len(changed) > 1 else ""
    return f", since {clock(changed[-1])}{times}"


def payload(history: History, changed: Sequence[float]) -> Html:
    """Its mass over time, and its moments now."""
    colours = {"mean": OURS, "90 % interval": PALE}
    if changed:
        colours["change detected"] = LEFT
    return section(
        "Payload",
        "Where the currents show that the payload has changed, its estimate is reset and learnt "
        "anew. Moments are about the tool flange, in its frame.",
        grid(
            plot(_mass(history, changed), "Payload mass", OUTSIDE, colours),
            table(["", "now"], _moments(history)),
            kind="wide-first",
        ),
    )


def _mass(history: History, changed: Sequence[float]) -> go.Figure:
    series, clock = history.series(PAYLOAD, "mass"), history.clock
    drawing = trend(series, clock, 260)
    drawing.add_traces([_marks(changed, extent(series), clock)] if changed else [])
    return drawing


def _marks(moments: Sequence[float], height: tuple[float, float], clock: Clock) -> go.Scatter:
    """An upright line at each moment, all in one trace."""
    latest = np.asarray(moments[-POINTS // 3 :]) / clock.seconds
    x: Array = np.repeat(latest, 3)
    y = np.tile([*height, np.nan], len(latest))
    return line(x, y, "change detected", LEFT, 1.4, dash="dot")


def _moments(history: History) -> list[list[Html]]:
    known = [history.series(PAYLOAD, q) for q in MOMENTS if history.holds(PAYLOAD, q)]
    return [
        [
            text(f"{MOMENTS[s.quantity]} [{s.unit}]"),
            cell(interval90(float(s.mean[-1]), float(s.sd[-1]))),
        ]
        for s in known
    ]
