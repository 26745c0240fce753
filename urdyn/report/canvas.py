"""Style of every plot: colours that the colour-blind can tell apart, quiet axes, no background.

Ink and grid take their colours from page.css, so that one drawing serves light, dark and paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

# Okabe and Ito's palette; grey stands for its black, which a dark page would swallow.
OURS, CONTROLLER, MEASURED = "#0072B2", "#E69F00", "#8A8F98"
LEFT, TRUTH, PRIOR = "#D55E00", "#D55E00", "#8A8F98"
JOINTS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
BAND = "rgba(86,180,233,0.35)"
SHADE = "rgba(138,143,152,0.16)"

AXIS = {"zeroline": False, "title": {"standoff": 6}, "ticks": ""}


def figure(traces: Sequence[Any], x: str, y: str, height: int = 240, **layout: Any) -> go.Figure:
    """Traces on axes whose titles are `x` and `y`, each with its unit."""
    drawing = go.Figure(
        data=list(traces),
        layout={
            "template": "none",
            "height": height,
            "margin": {"l": 56, "r": 10, "t": 14, "b": 40},
            "paper_bgcolor": "rgba(0,0,0,0)",
            "plot_bgcolor": "rgba(0,0,0,0)",
            "font": {"family": "system-ui, Segoe UI, Roboto, Arial, sans-serif", "size": 11},
            "hovermode": "closest",
            "showlegend": False,  # `markup.key` names the colours, in words that wrap
            "xaxis": AXIS | {"title": {"text": x, "standoff": 6}},
            "yaxis": AXIS | {"title": {"text": y, "standoff": 6}},
        },
    )
    return drawing.update_layout(**layout)


def joint_colours(names: Sequence[str]) -> dict[str, str]:
    """A colour per joint; they repeat after six."""
    return {name: JOINTS[j % len(JOINTS)] for j, name in enumerate(names)}


def brief(x: Any) -> Any:
    """Numbers in half the bytes, which is more than a screen resolves; words as they are."""
    return x.astype(np.float32) if isinstance(x, np.ndarray) else x


def line(x: Any, y: Any, name: str, colour: str, width: float = 1.3, **more: Any) -> go.Scatter:
    """A line."""
    style = {"color": colour, "width": width, "dash": more.pop("dash", "solid")}
    return go.Scatter(x=brief(x), y=brief(y), name=name, mode="lines", line=style, **more)


def dots(x: Any, y: Any, name: str, colour: str, size: float, **more: Any) -> go.Scatter:
    """Dots."""
    style = {"color": colour, "size": size} | more.pop("marker", {})
    return go.Scatter(x=brief(x), y=brief(y), name=name, mode="markers", marker=style, **more)


def band(x: Any, low: Any, high: Any, name: str, **more: Any) -> list[go.Scatter]:
    """The area between two lines."""
    edge = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"} | more
    return [
        go.Scatter(x=brief(x), y=brief(low), showlegend=False, **edge),
        go.Scatter(x=brief(x), y=brief(high), name=name, fill="tonexty", fillcolor=BAND, **edge),
    ]


def shade(x0: float, x1: float, label: str = "") -> dict[str, Any]:
    """A vertical strip behind the traces."""
    words = {"text": label, "textposition": "bottom left", "font": {"size": 10}} if label else {}
    return {
        "type": "rect", "layer": "below", "xref": "x", "yref": "y domain", "x0": x0, "x1": x1,
        "y0": 0, "y1": 1, "line": {"width": 0}, "fillcolor": SHADE, "label": words,
    }  # fmt: skip


def rule(x: float | None = None, y: float | None = None, label: str = "") -> dict[str, Any]:
    """A dashed line across the plot, at `x` or at `y`, with its name at its beginning."""
    along = (
        {"xref": "x", "yref": "y domain", "x0": x, "x1": x, "y0": 0, "y1": 1}
        if x is not None
        else {"xref": "x domain", "yref": "y", "x0": 0, "x1": 1, "y0": y, "y1": y}
    )
    words = {
        "text": label, "textposition": "start", "textangle": 0, "xanchor": "left",
        "yanchor": "bottom", "font": {"size": 10},
    }  # fmt: skip
    style = {"color": MEASURED, "width": 1.2, "dash": "dash"}
    return {"type": "line", "line": style, "label": words if label else {}} | along
