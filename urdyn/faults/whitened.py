"""A detector of standardised innovations, put behind the baseline that computes them.

The spread that was learnt may be somewhat wrong: another day, another program. So it follows the
data, up to ALLOWED times the baseline's and no further, since more is a fault of its own. It is
estimated from differences of successive innovations, which a growing fault hardly changes. That is
for tests of a mean; a test of the spread itself is given what was followed, and allows less
(LOOSE).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic

import numpy as np

from urdyn.errors import InputError
from urdyn.faults.alternatives import CLIP
from urdyn.faults.detector import Alone, Detector, S, SpreadJudge, Taught, Verdict, given_detector
from urdyn.faults.gaps import Past
from urdyn.faults.robust import SQUARE
from urdyn.faults.whiten import Baseline, given_baseline
from urdyn.given import given_number, given_step
from urdyn.types import Array, freeze

ALLOWED = 1.4  # [-] healthy spread over the baseline's, at most
MEMORY = 400.0  # [steps] over which the spread is averaged
TRUST = 25.0  # [steps] that the baseline's spread counts for
CHANCE = 0.03  # [-] margin for the error of an estimated spread
MISTRUST = 1.6  # [-] factor of an excess over the baseline's: what has changed goes on changing


@dataclass(frozen=True, eq=False)
class WhitenedState(Generic[S]):
    """The last steps, how wide they spread, and what the detector remembers."""

    past: Past
    last: Array  # (n,) [spread] previous innovation
    square: Array  # (n,) [-] average square over the baseline's
    weight: Array  # (n,) [steps] that it is worth
    inner: S

    def __post_init__(self) -> None:
        freeze(self, "last", "square", "weight")


@dataclass(frozen=True, eq=False)
class Whitened(Generic[S]):
    """`detector` over raw streams (n,) [unit] whose healthy behaviour is `baseline`."""

    baseline: Baseline
    detector: Detector[S]
    allowed: float = ALLOWED  # [-] spread over the baseline's, at most, that is followed

    def __post_init__(self) -> None:
        given_baseline(self.baseline)
        given_detector(self.detector)
        if isinstance(self.detector, Alone):
            raise InputError(f"{self.detector.alone}: run(it, series)")
        given_number(self.allowed, "allowed", "a number, 1 or more", lambda x: x >= 1.0)

    def init(self, streams: int) -> WhitenedState[S]:
        """Nothing seen yet."""
        n = self.baseline.streams
        if streams != n:
            raise InputError(f"{streams} streams, and {n} of the baseline; give the same ones")
        inner, none = self._judge.init(n), self.baseline.bridge.init()
        return WhitenedState(none, np.full(n, np.nan), np.ones(n), np.full(n, TRUST), inner)

    def step(self, state: WhitenedState[S], observed: Array) -> tuple[WhitenedState[S], Verdict]:
        """Whiten what was observed, (n,) [unit], and judge it; NaN where nothing was."""
        observed = given_step(observed, self.baseline.streams)
        past, left = self.baseline.bridge.step(state.past, observed)
        e = left / (self.baseline.inflation * self.baseline.spread)
        inner, verdict = self._judged(state.inner, e, self._wider(state.square))
        plain = e * self.baseline.inflation
        square, weight = _spread(state, plain, self.baseline.stride)
        last = np.where(np.isfinite(plain), plain, state.last)
        return WhitenedState(past, last, square, weight, inner), verdict

    def acknowledged(self, state: WhitenedState[S]) -> WhitenedState[S]:
        """The same state without evidence."""
        return replace(state, inner=self._judge.acknowledged(state.inner))

    @property
    def alone(self) -> str:
        """It has a baseline of its own."""
        return "this detector whitens already"

    @cached_property
    def _judge(self) -> Detector[S]:
        """The detector, taught what the baseline was learnt from."""
        of, healthy = self.detector, self.baseline.healthy
        return of.taught(healthy) if isinstance(of, Taught) and len(healthy) else of

    @cached_property
    def _spread_judge(self) -> SpreadJudge[S] | None:
        """The same where it looks for a growing spread, too."""
        return self._judge if isinstance(self._judge, SpreadJudge) else None

    def _judged(self, inner: S, e: Array, wider: Array) -> tuple[S, Verdict]:
        if self._spread_judge is None:
            return self._judge.step(inner, e / wider)
        return self._spread_judge.step_beside(inner, e / wider, wider)

    def _wider(self, square: Array) -> Array:
        """Spread of innovations over the baseline's, (n,) 1 .. allowed."""
        spread = 1.0 + CHANCE + MISTRUST * (np.sqrt(square) - 1.0)
        return np.asarray(np.clip(spread, 1.0, self.allowed))


def _spread(state: WhitenedState[S], e: Array, stride: Array) -> tuple[Array, Array]:
    """Average square after one more difference of innovations [spread], and its weight.

    Clipped at the present spread, which makes it Huber's proposal 2 step by step.
    """
    with np.errstate(over="ignore"):
        half = ((e - state.last) / (np.sqrt(2.0) * stride)) ** 2
    half = np.minimum(half, CLIP**2 * state.square) / SQUARE
    measured = np.isfinite(half)
    weight = np.where(measured, np.minimum(state.weight + 1.0, MEMORY), state.weight)
    return np.where(measured, state.square + (half - state.square) / weight, state.square), weight
