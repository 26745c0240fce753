"""The generalised likelihood ratio: the onset and size that explain the last steps best.

    z = max over ages a, shapes g of  sum_k g_k c_k / |g|,   g_k = k (ramp) or 1 (step), k = 1 .. a

Every term is standard normal while the stream is healthy, so that one false alarm in N steps takes
Q(z) = 1 / (N n K) for n streams and K terms: the union bound needs no simulation. [Willsky1976]_
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtri

from urdyn.faults.alternatives import CLIP
from urdyn.faults.detector import Verdict
from urdyn.faults.robust import swings
from urdyn.given import (
    given,
    given_promise,
    given_side,
    given_step,
    given_streams,
    given_tolerance,
)
from urdyn.types import Array, freeze, frozen

AGES = (1, 2, 3, 4, 6, 8, 11, 16, 22, 32, 45, 64, 90, 128, 180)
SHAPES = ("ramp", "step")


@dataclass(frozen=True, eq=False)
class Window:
    """The last innovations."""

    e: Array  # (W, n) [sd] oldest first; NaN before the first and where nothing was measured

    def __post_init__(self) -> None:
        freeze(self, "e")


@dataclass(frozen=True, eq=False)
class GLR:
    """At most one false alarm in `promise` steps over all streams, for standardised innovations."""

    promise: float = 10_000.0  # [steps] mean time to a false alarm, at least
    ages: tuple[int, ...] = AGES  # [steps] since the onset, increasing
    side: Array | float = 0.0  # (n,) or one for all: +1 only a rise matters, -1 a fall, 0 both
    tolerance: Array | float = 0.0  # (n,) or one [sd]: a change of the mean that is no fault

    def __post_init__(self) -> None:
        given_promise(self.promise)
        object.__setattr__(self, "side", frozen(given_side(self.side)))
        object.__setattr__(self, "tolerance", frozen(given_tolerance(self.tolerance)))
        ages = given(self.ages, "ages", "whole steps, 1 or more, increasing", _grow)
        object.__setattr__(self, "ages", tuple(map(int, ages)))

    @cached_property
    def _shapes(self) -> Array:
        """(K, W) terms of unit length over the window, all ramps first."""
        since = np.arange(self.ages[-1], 0, -1)[None, :]  # [steps] back from the next one
        age = np.array(self.ages)[:, None]
        ramps = np.maximum(age + 1.0 - since, 0.0)
        terms = np.vstack([ramps, np.minimum(ramps, 1.0)])
        return np.asarray(terms / np.linalg.norm(terms, axis=1, keepdims=True))

    def taught(self, healthy: Array) -> GLR:
        """The same, keeping its promise on innovations that swing as these do, (N, n) [sd]."""
        slack = given_tolerance(self.tolerance, healthy.shape[1])
        return replace(self, tolerance=slack + swings(healthy))

    def init(self, streams: int) -> Window:
        """Nothing seen yet."""
        streams = given_streams(streams)
        given_side(self.side, streams)
        given_tolerance(self.tolerance, streams)
        return Window(np.full((self.ages[-1], streams), np.nan))

    def step(self, state: Window, observed: Array) -> tuple[Window, Verdict]:
        """Fit every term to the window that ends with these innovations, (n,) [sd]."""
        observed = given_step(observed, state.e.shape[1])
        e = np.vstack([state.e[1:], np.where(np.isfinite(observed), observed, np.nan)])
        side = np.asarray(self.side)
        up, down = self._fitted(e), self._fitted(-e)
        terms = np.stack([np.where(side >= 0.0, up, 0.0), np.where(side <= 0.0, down, 0.0)])
        streams = np.maximum(terms.max(axis=(0, 1)), 0.0) / self._threshold(len(observed))
        kind, age = self._explained(terms[:, :, streams.argmax()])
        return Window(e), Verdict(float(streams.max() ** 2), streams**2, kind, age)

    def acknowledged(self, state: Window) -> Window:
        """Nothing seen yet."""
        return Window(np.full_like(state.e, np.nan))

    def _fitted(self, e: Array) -> Array:
        """Every term of a rise, (K, n), of unit variance over the steps that were measured."""
        beyond = np.clip(e - np.asarray(self.tolerance), -CLIP, CLIP)
        length = np.sqrt(self._shapes**2 @ np.isfinite(e))
        fitted = self._shapes @ np.nan_to_num(beyond)
        return np.asarray(fitted / np.where(length > 0.0, length, np.inf))

    def _threshold(self, streams: int) -> float:
        sides = np.broadcast_to(np.where(np.asarray(self.side) == 0.0, 2.0, 1.0), (streams,))
        looks = len(self._shapes) * float(sides.sum())
        return float(-ndtri(1.0 / (self.promise * looks)))

    def _explained(self, terms: Array) -> tuple[str, float]:
        """Kind and age of the best of terms (2, K) of one stream."""
        way, term = np.unravel_index(int(terms.argmax()), terms.shape)
        shape, age = divmod(int(term), len(self.ages))
        return f"{SHAPES[shape]} {('up', 'down')[int(way)]}", float(self.ages[age])


def _grow(ages: Array) -> bool:
    return len(ages) > 0 and bool((np.diff(ages, prepend=0.0) > 0.0).all() and not (ages % 1).any())
