"""Which kinds of a thing are taken for which others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from urdyn.report.canvas import SHADE, figure

FULL = "rgba(0,114,178,0.55)"  # on which digits can be read, light or dark


def confusion(counts: ArrayLike, truth: Sequence[str], told: Sequence[str]) -> go.Figure:
    """Heat map of counts (T, K): a row for each true kind, coloured by its share of the row."""
    number = np.asarray(counts, dtype=np.float64)
    assert number.shape == (len(truth), len(told)), "one row a true kind, one column a told one"
    share = number / np.maximum(number.sum(axis=1, keepdims=True), 1.0)
    words = [[f"{n:g}" if n else "" for n in row] for row in number]
    cells = go.Heatmap(
        z=share, x=list(told), y=list(truth), zmin=0.0, zmax=1.0,
        text=words, texttemplate="%{text}",
        colorscale=[[0.0, SHADE], [1.0, FULL]], showscale=False, xgap=2, ygap=2,
        hovertemplate="%{y} told as %{x}: %{text} (%{z:.0%})<extra></extra>",
    )  # fmt: skip
    drawing = figure([cells], "told", "truth", 90 + 34 * len(truth))
    drawing.update_yaxes(autorange="reversed", automargin=True, showgrid=False)
    return drawing.update_xaxes(tickangle=-30, automargin=True, showgrid=False)
