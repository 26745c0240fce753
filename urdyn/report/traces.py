"""A long signal for drawing: fewer points with the same peaks, and its spectrum."""

from __future__ import annotations

import numpy as np

from urdyn.signal.stretches import median_step, stretches
from urdyn.types import Array, Index

SEGMENT = 8.0  # [s] of each periodogram: resolves an eighth of a hertz


def downsample(x: Array, points: int) -> Index:
    """Indices of at most `points` samples of x, (N,): each bin's first minimum and maximum.

    What is not finite leaves no trace, but the bin around it keeps its place.
    """
    if len(x) <= points:
        return np.arange(len(x))
    bins = points // 2
    edges = np.linspace(0, len(x), bins + 1).astype(int)
    width = int(np.diff(edges).max())
    # Bins that are one shorter repeat their last sample: it is its own minimum and maximum.
    index = np.minimum(edges[:-1, None] + np.arange(width), edges[1:, None] - 1)
    low = np.where(np.isfinite(x), x, np.inf)[index].argmin(axis=1)
    high = np.where(np.isfinite(x), x, -np.inf)[index].argmax(axis=1)
    row = np.arange(bins)
    return np.unique(np.concatenate([index[row, low], index[row, high]]))


def spectrum(t: Array, x: Array) -> tuple[Array, Array]:
    """Frequencies [Hz] and amplitude density [unit/sqrt(Hz)] by Welch's method. [Welch1967]_

    Stamps are irregular: x is resampled at the median step, for display only. Of the stretches
    between gaps, the longest stands for all.
    """
    from scipy.signal import welch  # heavy, and most pages draw no spectrum

    t, x = t[np.isfinite(x)], x[np.isfinite(x)]
    step = median_step(t)
    longest = max(stretches(t), key=lambda rows: rows.stop - rows.start)
    t, x = t[longest], x[longest]
    if len(t) < 32:
        return np.zeros(0), np.zeros(0)
    uniform = np.interp(np.arange(t[0], t[-1], step), t, x)
    segment = min(len(uniform), max(16, int(SEGMENT / step)))
    f, power = welch(uniform, 1.0 / step, nperseg=segment)
    return np.asarray(f[1:]), np.sqrt(power[1:])
