"""Residual currents, and their size compared with the expected one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from scipy.special import gammaincinv

from urdyn.io.run_folder import MISSES
from urdyn.report.canvas import BAND, LEFT, OURS, band, dots, figure, line, rule
from urdyn.report.digits import number, percent
from urdyn.report.markup import Html, grid, plot, section
from urdyn.report.names import spoken
from urdyn.report.traces import downsample
from urdyn.report.track.history import GROSS, History
from urdyn.report.track.trace import POINTS
from urdyn.types import Array

ENDS = np.array([[0.05], [0.95]])  # of a 90 % band


@dataclass(frozen=True, eq=False)
class Surprise:
    """Normalised innovation squared per measured current, 1 expected, averaged over windows."""

    t: Array  # (W,) [s] where each window begins
    mean: Array  # (W,) [-]
    low: Array  # (W,) [-] 5 % quantile of white innovations
    high: Array  # (W,) [-] 95 % quantile
    inside: float  # [-] share of single samples between their quantiles
    overall: float  # [-] without gross errors and what a change explains


def surprise(history: History) -> Surprise:
    """Σν² / Σn in windows of the rows that were compared; Σν² is χ² with Σn degrees of freedom."""
    measured = history.column("measured")
    nis, told = history.column("nis"), measured > 0
    t, nis, measured = history.t[told], nis[told], measured[told]
    if not told.any():
        return Surprise(t, nis, nis, nis, np.nan, np.nan)
    begin = np.unique(np.linspace(0, len(nis), POINTS, endpoint=False).astype(int))
    total, dof = np.add.reduceat(nis, begin), np.add.reduceat(measured, begin)
    low, high = _quantiles(dof) / dof
    counts, which = np.unique(measured, return_inverse=True)  # few: a quantile is costly
    least, most = _quantiles(counts)[:, which]
    inside = float(((nis > least) & (nis < most)).mean())
    return Surprise(t[begin], total / dof, low, high, inside, history.surprise)


def _quantiles(dof: Array) -> Array:
    """Ends of a 90 % band of χ², (2, W), without scipy.stats, which is heavy."""
    return np.asarray(2.0 * gammaincinv(0.5 * dof, ENDS))


def trust_track(found: Surprise) -> str:
    """How well the belief predicted the measurements."""
    if not np.isfinite(found.overall):
        return "No current was compared."
    least = f"The average surprise, but for the {percent(GROSS)} that surprised most, is"
    words = f"{least} {number(found.overall)}; 1 or less is as expected"
    if found.overall > MISSES:
        return f"{words}. Something is missing from the model, and its intervals are too narrow."
    return f"{words}."


def surprises(history: History, found: Surprise) -> Html:
    """Residual current of every joint, and the surprise of all."""
    note = f"{percent(found.inside)} of single samples inside their own 90 % band"
    colours = {"average of a window": OURS, "90 % band where innovations are white": BAND}
    return section(
        "Surprise",
        "Measured less predicted current, predicted one sample ahead; the drawing keeps every peak "
        "of the history. Gaps: the joint stands or has just started, and is not compared. Below, "
        "the innovations squared over their expected variance: above the band the filter is too "
        "sure of itself, below it too careful.",
        grid(*(_residual(history, joint) for joint in history.joints)),
        plot(_nis(history, found), "Normalised innovation squared", note, colours),
    )


def _residual(history: History, joint: str) -> Html:
    current, predicted = history.currents(joint)
    left = current - predicted
    at, clock = downsample(left, POINTS), history.clock
    trace = line(history.t[at] / clock.seconds, left[at], "residual", LEFT, 0.8)
    drawing = figure([trace], clock.axis, "residual [A]", 190).update_yaxes(nticks=6)
    return plot(drawing, spoken(joint), _error(current, left))


def _error(current: Array, left: Array) -> str:
    told = np.isfinite(left) & np.isfinite(current)
    if not told.any():
        return "never compared"
    rms, whole = (float(np.sqrt(np.mean(x[told] ** 2))) for x in (left, current))
    share = f"{percent(rms / whole)} of the current" if whole else "where the current reads 0"
    return f"rms {number(rms)} A, {share}"


def _nis(history: History, found: Surprise) -> go.Figure:
    t, clock = found.t / history.clock.seconds, history.clock
    traces = [
        *band(t, found.low, found.high, "90 % band"),
        dots(t, found.mean, "average of a window", OURS, 3.5),
    ]
    drawing = figure(traces, clock.axis, "surprise a current [-]", 240, shapes=[rule(y=1.0)])
    return drawing.update_yaxes(type="log", dtick=1, tickformat="~g")
