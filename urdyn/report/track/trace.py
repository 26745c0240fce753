"""Plot of a belief over time: a line in its 90 % band, beside where it began."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from urdyn.io.spans import Clock
from urdyn.report.canvas import OURS, band, figure, line, rule
from urdyn.report.names import shown
from urdyn.report.traces import downsample
from urdyn.report.track.history import Series
from urdyn.types import Index

POINTS = 1000  # per trace
PALE = "rgba(86,180,233,0.24)"  # a band that leaves its line visible on a dark page
UNSETTLED = 3.0  # times the usual half width: the belief is about to move
WORDS = {"coulomb": "Coulomb", "viscous": "damping"}


def trend(series: Series, clock: Clock, height: int = 190) -> go.Figure:
    """Mean and band over time, dashed where it began."""
    at = kept(series)
    factor, unit = reads_as(series.quantity, series.unit)
    t, mean, half = series.t[at] / clock.seconds, factor * series.mean[at], factor * series.half[at]
    low, high = band(t, mean - half, mean + half, "90 % interval")
    traces = [
        low,
        high.update(fillcolor=PALE),
        line(t, mean, "mean", OURS, 1.8, hovertemplate=f"%{{y:.4g}} {unit}"),
    ]
    title = f"{WORDS.get(series.quantity, series.quantity)} [{unit}]"
    began = rule(y=factor * float(series.mean[0]))
    drawing = figure(traces, clock.axis, title, height, shapes=[began])
    return drawing.update_yaxes(range=extent(series), nticks=5)


def kept(series: Series) -> Index:
    """Rows to draw, at most POINTS: the highest and lowest of mean and band, stretch by stretch."""
    drawn = (series.mean, series.mean - series.half, series.mean + series.half)
    rows = [downsample(x, POINTS // len(drawn)) for x in drawn]
    return np.union1d(np.union1d(*rows[:2]), rows[2])


def extent(series: Series) -> tuple[float, float]:
    """Initial range of the axis: the unsettled beginning does not flatten the rest."""
    factor, _ = reads_as(series.quantity, series.unit)
    usual = float(np.median(series.half))
    settled = series.mean[series.half <= UNSETTLED * usual]
    told = np.append(settled, series.mean[[0, -1]])
    low, high = float(told.min()), float(told.max())
    room = max(1.4 * usual, 0.06 * (high - low)) or 0.01 * abs(low) or 1.0
    return factor * (low - room), factor * (high + room)


def reads_as(quantity: str, unit: str) -> tuple[float, str]:
    """Factor and unit in which an axis reads well."""
    return (1e3, "mrad") if quantity == "zero" else (1.0, shown(quantity, unit)[1] or "-")
