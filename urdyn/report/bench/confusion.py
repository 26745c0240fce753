"""Which kinds are mistaken for which others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike, NDArray

from urdyn.report.canvas import SHADE, figure
from urdyn.report.markup import Html, plot, section

FULL = "rgba(0,114,178,0.55)"  # on which digits can be read, light or dark


@dataclass(frozen=True, eq=False)
class Kinds:
    """How often each true kind was reported as which, on the right joint or on another."""

    counts: NDArray[np.int64]  # (T, K) the kinds first, in the same order; then neither
    truth: tuple[str, ...]  # (T,)
    told: tuple[str, ...]  # (K,)

    @property
    def right(self) -> int:
        """Findings that had the right kind and joint."""
        kinds = len(self.counts) - 1
        return int(np.trace(self.counts[:kinds, :kinds]))

    @property
    def findings(self) -> int:
        """Number of all findings."""
        return int(self.counts[:, :-1].sum())


def told_apart(kinds: Kinds) -> Html:
    """The counts drawn, under their title."""
    names = ([name.replace("_", " ") for name in row] for row in (kinds.truth, kinds.told))
    lead = "Rows are what was wrong with a virtual arm, columns what was told of it."
    return section("Kinds told apart", lead, plot(confusion(kinds.counts, *names), "counts", ""))


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
