"""Outlier removal, the third stage of section IV.B: 3 sigma, and what holds where that fails."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from urdyn.given import given_count, given_number, positive
from urdyn.signal.channels import SENSORS, by_column, named, noted
from urdyn.signal.stretches import stretches
from urdyn.types import MAD_TO_SD, Array, Index, Log

FEWEST = 3  # samples of a window: of two neither lies further out than the other
_BATCH = 8192  # windows that are sorted at a time


def reject_outliers(
    log: Log,
    *,
    sigma: float = 3.0,
    robust: bool = False,
    window: int | None = None,
    channels: Iterable[str] = SENSORS,
) -> Log:
    """Log in which |x - centre| > sigma · spread is marked as not measured (NaN), and counted.

    Centre and spread are mean and standard deviation (the paper's) or, `robust`, median and MAD;
    of a whole column or of a moving `window` [samples] that does not reach across gaps. Robust and
    windowed it is the identifier of [Hampel1974]_. 3 sigma can find nothing among ten samples, for
    none of n lies further out than (n - 1)/√n; outliers mask one another; and over a whole column
    it takes rare motion for error: in a recording in which one joint of a UR10e moves it marks 860
    angles, all of them sound.
    """
    sigma = given_number(sigma, "sigma", "a number above 0", positive)
    window = None if window is None else given_count(window, "window", FEWEST)
    kept, found = {}, 0
    for name in named(log, channels):
        kept[name] = by_column(
            log.channels[name], lambda x: _column(log.t, x, sigma, robust, window)
        )
        found += int(np.isfinite(log.channels[name]).sum() - np.isfinite(kept[name]).sum())
    defects = noted(log, f"outlier beyond {sigma:g} sigma", found, "marked as NaN")
    return replace(log, channels={**log.channels, **kept}, defects=defects)


def hampel(log: Log, *, sigma: float = 3.0, window: int = 21) -> Log:
    """Log without the samples that a moving median and MAD reject [Hampel1974]_."""
    return reject_outliers(log, sigma=sigma, robust=True, window=window)


def _column(t: Array, x: Array, sigma: float, robust: bool, window: int | None) -> Array:
    """One series, (N,), with NaN for outliers."""
    out = x.copy()
    rows = np.flatnonzero(np.isfinite(x))
    parts = [rows] if window is None else [rows[stretch] for stretch in stretches(t[rows])]
    for part in (part for part in parts if len(part)):
        centre, spread = _moments(x[part], len(part) if window is None else window, robust)
        out[part[np.abs(x[part] - centre) > sigma * spread]] = np.nan
    return out


def _moments(x: Array, window: int, robust: bool) -> tuple[Array, Array]:
    """Centre and spread of the window around each sample of a stretch, (n,) each."""
    size = min(window, len(x))
    views = sliding_window_view(x, size)
    of = _robust if robust else _plain
    parts = [of(views[start : start + _BATCH]) for start in range(0, len(views), _BATCH)]
    centre, spread = (np.concatenate(part) for part in zip(*parts, strict=True))
    mine = _window_of(len(x), size)
    return centre[mine], spread[mine]


def _window_of(rows: int, size: int) -> Index:
    """Which of the rows - size + 1 windows belongs to each row."""
    return np.asarray(np.clip(np.arange(rows) - size // 2, 0, rows - size))


def _plain(views: Array) -> tuple[Array, Array]:
    """Mean and standard deviation of each window, (n,) each."""
    return views.mean(1), views.std(1)


def _robust(views: Array) -> tuple[Array, Array]:
    """Median and scaled median absolute deviation of each window, (n,) each.

    At standstill more than half of the samples are the same count of the encoder and the MAD is 0;
    the mean absolute deviation stands in, or every other count would be an outlier.
    """
    centre = np.median(views, axis=1)
    away = np.abs(views - centre[:, None])
    spread = MAD_TO_SD * np.median(away, axis=1)
    return centre, np.where(spread > 0, spread, np.sqrt(np.pi / 2) * away.mean(1))
