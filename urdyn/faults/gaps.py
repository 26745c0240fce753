"""Expected values where none were measured, so that those after a gap can be judged.

A Kalman filter over the last p values x of an autoregression, exact where nothing is missing:

    f = a'x + c,    v = 1 + a'P a,    e = (y - f) / sqrt(v)

Measured values have no variance P; a missing one is f, with variance v, until later ones correct
it: x += P a / v (y - f). Values before the first are all but unknown. [Jones1980]_

All of it is linear: what a change adds to the values is predicted by the same gains, and its
prediction error, over the same sqrt(v), is added to innovations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from urdyn.types import Array, Mask, freeze

UNKNOWN = 1e4  # [spread²] variance of an unknown value


@dataclass(frozen=True, eq=False)
class Past:
    """The last p steps of n streams."""

    value: Array  # (p, n) [unit] measured or expected, oldest first
    doubt: Array  # (n, p, p) [spread²] covariance, newest first
    seen: Array  # (n,) steps
    rest: Array  # (n,) steps still too near the last judged one to be judged

    def __post_init__(self) -> None:
        freeze(self, "value", "doubt", "seen", "rest")


class Crossing(NamedTuple):
    """How n streams crossed a step: the same gains apply to what is added to their values."""

    usable: Mask  # (n,) a value is measured, and not too near
    lost: Mask  # (n,) a value that is not usable is all but unknown
    gain: Array  # (n, p) P a / v, newest first; 0 where not usable
    v: Array  # (n,) [spread²] variance of the prediction


@dataclass(frozen=True, eq=False)
class Bridge:
    """Innovations of n streams across their gaps."""

    coefficients: Array  # (n, p) a, the newest lag first
    level: Array  # (n,) c [unit]
    typical: Array  # (n,) [unit] expected where nothing is known
    pace: Array  # (n,) steps between judged values: closer ones were never seen

    def init(self) -> Past:
        """Nothing seen yet."""
        n, p = self.coefficients.shape
        doubt = np.broadcast_to(UNKNOWN * np.eye(p), (n, p, p))
        return Past(np.tile(self.typical, (p, 1)), doubt, np.zeros(n), np.zeros(n))

    def step(self, past: Past, y: Array) -> tuple[Past, Array]:
        """One step, and the innovations of y, (n,) [unit]: NaN where there is none."""
        after, e, _ = self.crossed(past, y)
        return after, e

    def crossed(self, past: Past, y: Array) -> tuple[Past, Array, Crossing | None]:
        """The same, and how the step is crossed; None where nothing is missing."""
        usable = np.isfinite(y) & (past.rest <= 0.0)
        foreseen = np.einsum("np,pn->n", self.coefficients, past.value[::-1])
        missed = y - foreseen - self.level
        rest = np.maximum(np.where(usable, self.pace, past.rest) - 1.0, 0.0)
        seen, judged = past.seen + 1.0, usable & (past.seen >= self._order)
        if usable.all() and not past.doubt.any():  # the usual case: no gap
            value = np.vstack([past.value, y])[1:] if len(past.value) else past.value
            after = replace(past, value=value, seen=seen, rest=rest)
            return after, np.where(judged, missed, np.nan), None
        by, cross = self._crossing(past, usable)
        value = self._values(past, by, np.where(usable, y, foreseen + self.level), missed)
        after = Past(value, self._doubts(past, by, cross), seen, rest)
        return after, np.where(judged, missed / np.sqrt(by.v), np.nan), by

    def _crossing(self, past: Past, usable: Mask) -> tuple[Crossing, Array]:
        """How a step is crossed, and P a, (n, p)."""
        cross = np.einsum("npq,nq->np", past.doubt, self.coefficients)
        v = 1.0 + np.einsum("np,np->n", self.coefficients, cross)
        gain = np.where(usable[:, None], cross / v[:, None], 0.0)
        lost = v > UNKNOWN  # after a gap in which the autoregression forgets, or diverges
        return Crossing(usable, lost, gain, v), cross

    def _values(self, past: Past, by: Crossing, newest: Array, missed: Array) -> Array:
        """Values of the last p steps, corrected by the newest, (p, n)."""
        if not len(past.value):
            return past.value
        newest = np.where(by.lost & ~by.usable, self.typical, newest)
        learnt = (by.gain * np.where(by.usable, missed, 0.0)[:, None]).T[::-1]
        return np.vstack([past.value + learnt, newest])[1:]

    def _doubts(self, past: Past, by: Crossing, cross: Array) -> Array:
        """Their covariance, (n, p, p)."""
        doubt = np.empty_like(past.doubt)
        if not len(past.value):
            return doubt
        older = past.doubt - by.gain[:, :, None] * (by.gain * by.v[:, None])[:, None, :]
        cross = np.where((by.usable | by.lost)[:, None], 0.0, cross)
        doubt[:, 1:, 1:] = older[:, :-1, :-1]
        doubt[:, 0, 1:] = doubt[:, 1:, 0] = cross[:, :-1]
        doubt[:, 0, 0] = np.where(by.usable, 0.0, np.minimum(by.v, UNKNOWN))
        return doubt

    def carried(self, over: Array, h: Array, by: Crossing) -> tuple[Array, Array]:
        """Carry an addition to the values across a step: its error, and its part in innovations.

        Args:
            over: its expected minus its true values at the last p steps, newest first, (p, ..., n);
                0 where measured.
            h: what it adds to innovations where nothing is missing, (..., n).

        Returns:
            `over` a step later, and what it adds to the innovations from `crossed`.
        """
        missed = h - np.einsum("np,p...n->...n", self.coefficients, over)
        # A lost value is unknown, and the next corrects so little that it need not be exact.
        newest = np.where(by.usable | by.lost, 0.0, -missed)
        gain = np.expand_dims(by.gain.T, tuple(range(1, missed.ndim)))
        later = np.concatenate([newest[None], over + gain * missed])[: len(over)]
        return later, missed / np.sqrt(by.v)

    @cached_property
    def _order(self) -> Array:
        """Lags of each stream, (n,)."""
        lag = np.arange(1, self.coefficients.shape[1] + 1)
        return np.asarray(np.max(np.where(self.coefficients != 0.0, lag, 0), axis=1, initial=0))

    def of(self, streams: Mask) -> Bridge:
        """The same for some of the streams."""
        chosen = (x[streams] for x in (self.coefficients, self.level, self.typical, self.pace))
        return Bridge(*chosen)


def bridged(bridge: Bridge, series: Array) -> Array:
    """Innovations of a series (N, n) [unit] without a past; NaN where there is none."""
    past, e = bridge.init(), np.empty_like(series)
    for row, y in enumerate(series):
        past, e[row] = bridge.step(past, y)
    return e
