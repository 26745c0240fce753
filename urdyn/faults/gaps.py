"""What is expected of values that were not measured, so that those after a gap can be judged.

A Kalman filter over the last p values x of an autoregression, exact where nothing is missing:

    f = a'x + c,    v = 1 + a'P a,    e = (y - f) / sqrt(v)

Measured values have no doubt P; a missing one is f, with the doubt v, until later ones tell more of
it: x += P a / v (y - f). Values of before the first are as good as unknown. [Jones1980]_
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.types import Array, Mask, frozen

UNKNOWN = 1e4  # [spread²] doubt of a value of which nothing is known


@dataclass(frozen=True, eq=False)
class Past:
    """The last p steps of n streams."""

    value: Array  # (p, n) [unit] measured or expected, oldest first
    doubt: Array  # (n, p, p) [spread²] covariance, newest first
    seen: Array  # (n,) steps
    rest: Array  # (n,) steps in which nothing is judged, since the last one that was is too near

    def __post_init__(self) -> None:
        for name in ("value", "doubt", "seen", "rest"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, eq=False)
class Bridge:
    """Innovations of n streams across their gaps."""

    coefficients: Array  # (n, p) a, the newest lag first
    level: Array  # (n,) c [unit]
    typical: Array  # (n,) [unit] of a value of which nothing is known
    pace: Array  # (n,) steps between two that can be judged: nearer ones were never seen

    def init(self) -> Past:
        """Nothing seen yet."""
        n, p = self.coefficients.shape
        doubt = np.broadcast_to(UNKNOWN * np.eye(p), (n, p, p))
        return Past(np.tile(self.typical, (p, 1)), doubt, np.zeros(n), np.zeros(n))

    def step(self, past: Past, y: Array) -> tuple[Past, Array]:
        """One step on, and the innovations of y, (n,) [unit]: NaN where none can be told."""
        told = np.isfinite(y) & (past.rest <= 0.0)
        foreseen = np.einsum("np,pn->n", self.coefficients, past.value[::-1])
        missed = y - foreseen - self.level
        rest = np.maximum(np.where(told, self.pace, past.rest) - 1.0, 0.0)
        if told.all() and not past.doubt.any():  # the rule, without a gap
            value = np.vstack([past.value, y])[1:] if len(past.value) else past.value
            after, v = replace(past, value=value, seen=past.seen + 1.0, rest=rest), np.ones(1)
        else:
            expected = np.where(told, y, foreseen + self.level)
            value, doubt, v = self._learnt(past, expected, np.where(told, missed, 0.0), told)
            after = Past(value, doubt, past.seen + 1.0, rest)
        judged = told & (past.seen >= self._order)
        return after, np.where(judged, missed / np.sqrt(v), np.nan)

    def _learnt(
        self, past: Past, expected: Array, missed: Array, told: Mask
    ) -> tuple[Array, Array, Array]:
        """Values and their doubt with the newest among them, and the doubt v that it had, (n,)."""
        cross = np.einsum("npq,nq->np", past.doubt, self.coefficients)
        v = 1.0 + np.einsum("np,np->n", self.coefficients, cross)
        gain = np.where(told[:, None], cross / v[:, None], 0.0)
        lost = v > UNKNOWN  # since a gap in which an autoregression forgets, or runs away
        newest = np.where(lost & ~told, self.typical, expected)
        cross = np.where((told | lost)[:, None], 0.0, cross)
        value = np.vstack([past.value + (gain * missed[:, None]).T[::-1], newest])[1:]
        doubt = np.empty_like(past.doubt)
        if len(past.value):
            older = past.doubt - gain[:, :, None] * (gain * v[:, None])[:, None, :]
            doubt[:, 1:, 1:] = older[:, :-1, :-1]
            doubt[:, 0, 1:] = doubt[:, 1:, 0] = cross[:, :-1]
            doubt[:, 0, 0] = np.where(told, 0.0, np.minimum(v, UNKNOWN))
        return value if len(past.value) else past.value, doubt, v

    @cached_property
    def _order(self) -> Array:
        """Lags of each stream, (n,)."""
        lag = np.arange(1, self.coefficients.shape[1] + 1)
        return np.asarray(np.max(np.where(self.coefficients != 0.0, lag, 0), axis=1, initial=0))

    def of(self, streams: Mask) -> Bridge:
        """Of some of the streams."""
        chosen = (x[streams] for x in (self.coefficients, self.level, self.typical, self.pace))
        return Bridge(*chosen)


def bridged(bridge: Bridge, series: Array) -> Array:
    """Innovations of a series (N, n) [unit] that begins anew; NaN where none can be told."""
    past, e = bridge.init(), np.empty_like(series)
    for row, y in enumerate(series):
        past, e[row] = bridge.step(past, y)
    return e
