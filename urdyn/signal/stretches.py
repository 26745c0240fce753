"""Time axis of a log: its step, its gaps, and windows that never reach across one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from urdyn.types import Array, Index, Mask

GAP = 5.0  # [-] a step longer than this many median steps parts two stretches
# Of a period. Seconds since 1970 are known to .2 µs; within 2 µs an encoder sees no joint move.
EVEN = 1e-3


def median_step(t: Array) -> float:
    """Typical time from one row to the next [s]; NaN where there is only one row."""
    return float(np.median(np.diff(t))) if len(t) > 1 else float("nan")


def breaks(t: Array, step: float | None = None) -> tuple[int, ...]:
    """Rows that begin a new stretch: those that follow a gap; `step` [s] is the usual one."""
    usual = median_step(t) if step is None else step
    return tuple(int(row) + 1 for row in np.flatnonzero(np.diff(t) > GAP * usual))


def stretches(t: Array) -> Iterator[slice]:
    """Rows between gaps, one slice a stretch."""
    bounds = (0, *breaks(t), len(t))
    return (slice(start, stop) for start, stop in pairwise(bounds))


def is_even(t: Array, step: float) -> Mask:
    """Whether each row follows the one before at the usual step, (N - 1,)."""
    return np.asarray(np.abs(t[1:] - t[:-1] - step) <= EVEN * step)


def windows(rows: int, breaks: tuple[int, ...], half: int, ahead: int) -> tuple[Index, Index]:
    """First and last + 1 row of the window that belongs to each row, (N,) each.

    A window holds 2 half + 1 rows, `ahead` of them after its own. Near the end of a stretch it is
    shifted, not cut: a one-sided estimate from a full window is less noisy than one from half of
    it. A stretch that is shorter than a window is the window.
    """
    bounds = np.array([0, *breaks, rows])
    lengths = np.diff(bounds)
    start, stop = np.repeat(bounds[:-1], lengths), np.repeat(bounds[1:], lengths)
    begin = np.arange(rows) + ahead - 2 * half
    first = np.clip(begin, start, np.maximum(start, stop - 2 * half - 1))
    return first, np.minimum(first + 2 * half + 1, stop)
