"""Filtering, the first stage of section IV.B: Savitzky-Golay, 21 samples, cubic."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from urdyn.given import given_count
from urdyn.signal.channels import SENSORS, by_column, columns, named, noted
from urdyn.signal.stretches import stretches
from urdyn.types import Array, Log


def smooth(
    log: Log, *, window: int = 21, degree: int = 3, channels: Iterable[str] = SENSORS
) -> Log:
    """Log with its sensors smoothed by [Savitzky1964]_, each at its own rate.

    Samples count as evenly spaced, as the paper has it, and rows without a measurement are passed
    over; the window never reaches across a gap. A stretch shorter than the window stays as it is
    and is counted.
    """
    window = given_count(window, "window")
    degree = given_count(degree, "degree", 0, window - 1)
    smoothed, short = {}, 0
    for name in named(log, channels):
        smoothed[name] = by_column(log.channels[name], lambda x: _column(log.t, x, window, degree))
        short += _short(log.t, log.channels[name], window)
    defects = noted(log, "sample in a stretch shorter than the filter", short, "kept unfiltered")
    return replace(log, channels={**log.channels, **smoothed}, defects=defects)


def _column(t: Array, x: Array, window: int, degree: int) -> Array:
    """One series, (N,)."""
    from scipy.signal import savgol_filter  # heavy, and seldom needed

    out = x.copy()
    rows = np.flatnonzero(np.isfinite(x))
    for stretch in stretches(t[rows]):
        part = rows[stretch]
        if len(part) >= window:
            out[part] = savgol_filter(x[part], window, degree)
    return out


def _short(t: Array, values: Array, window: int) -> int:
    """Measured values that no full window holds."""
    lengths = [
        stretch.stop - stretch.start
        for column in columns(values).T
        for stretch in stretches(t[np.isfinite(column)])
    ]
    return sum(length for length in lengths if length < window)
