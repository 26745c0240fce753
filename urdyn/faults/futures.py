"""Where the courses that count go from now on: when a level is passed, as a mixture over them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, ndtr, ndtri_exp

from urdyn.types import Array

TINY, LARGE = 1e-100, 600.0  # times as large as now; nats
PARTS = (np.arange(11.0) + 0.5) / 11.0  # [-] quantiles that stand for a pace, or an onset


class Paces(NamedTuple):
    """Gaussians that are cut off at zero, (C,) each."""

    mean: Array  # before the cut
    sd: Array

    @property
    def cut(self) -> Array:
        """ln P(above zero), of the Gaussians."""
        return np.asarray(log_ndtr(self.mean / self.sd))

    def quantiles(self, of: Array) -> Array:
        """Of each, (len(of), C)."""
        above = np.log1p(-of)[:, None] + self.cut
        return np.asarray(np.maximum(self.mean - self.sd * ndtri_exp(above), 0.0))


@dataclass(frozen=True, eq=False)
class Smooth:
    """C courses that go as their shape says, known but for their size."""

    weight: Array  # (C,) [-]
    age: Array  # (C,) [steps] since the onset t0
    lasts: Array  # (C,) [steps] from the onset on until it stopped; inf: it goes on
    power: Array  # (C,) [-]
    haste: Array  # (C,) [1/step] rate from now on, over the change
    ahead: Array  # (C,) [-] power from now on
    mean: Array  # (C,) [spread] of the change now before it is cut off at zero, sign of the fault
    sd: Array  # (C,) [spread]

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps), weighed."""
        if x > 0.0:
            grown = self.ahead * np.log1p(self.haste * x / self.ahead)
            return self._above(rise, np.exp(np.minimum(grown, LARGE)))
        k = np.minimum(self.age + x, self.lasts) / np.minimum(self.age, self.lasts)
        return self._above(rise, np.where(k > 0.0, np.maximum(k, 0.0) ** self.power, 0.0))

    def steeper(self, rate: float) -> float:
        """P(the rate is above `rate` >= 0 [spread/step]), weighed."""
        return self._above(rate, self.haste)

    def _above(self, level: float, times: Array) -> float:
        """P(the change, so many times as large, (C,), is above a level), weighed."""
        there = times > TINY
        least = level / np.where(there, times, 1.0)
        # In logarithms: both may be tiny.
        beyond = log_ndtr((self.mean - least) / self.sd) - self._cut
        return float(self.weight @ np.where(there, np.exp(np.minimum(beyond, 0.0)), 0.0))

    @cached_property
    def _cut(self) -> Array:
        return Paces(self.mean, self.sd).cut


@dataclass(frozen=True, eq=False)
class Wandering:
    """C ramps whose level walks besides: change = off + pace x shape now, and pace a step later.

    Wear does not come back: what is there at x has been crossed by then [Birnbaum1969]_, and what
    was crossed is there now. Of the past the ends are known, the onset and now; a walk between two
    ends is a bridge.
    """

    weight: Array  # (C,) [-]
    age: Array  # (C,) [steps] since the onset
    mean: Array  # (C,) [spread/step] of the pace before it is cut off at zero, sign of the fault
    sd: Array  # (C,) [spread/step]
    shape: Array  # (C,) [steps]
    off: Array  # (C,) [spread] what the level has walked, without a ramp
    var: Array  # (C,) [spread²] of the change now, the pace given
    walk: Array  # (C,) [spread²/step] by which it walks

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps), weighed."""
        there, now = self._beyond(rise, x), self._beyond(rise, 0.0)
        # Of each pace it falls and then rises ahead, rises and then falls behind: so the largest
        # until x, and the least from x to now, is at an end.
        by = np.maximum(there, now) if x > 0.0 else np.minimum(there, now)
        return float((ndtr(by) @ self.weight).mean())

    def _beyond(self, rise: float, x: float) -> Array:
        """How far the level at x is beyond `rise` [its sd], (P, C)."""
        if x > 0.0:
            mean, var = self._now + self._pace * x, self.var + self.walk * x
        else:
            left = np.maximum(1.0 + x / self.age, 0.0)
            mean, var = self._now * left, self.var * left**2 - self.walk * x * left
        return np.asarray((mean - rise) / np.sqrt(np.maximum(var, TINY)))

    def steeper(self, rate: float) -> float:
        """P(the rate is above `rate` >= 0 [spread/step]), weighed."""
        paces = Paces(self.mean, self.sd)
        beyond = log_ndtr((self.mean - rate) / self.sd) - paces.cut
        return float(self.weight @ np.exp(np.minimum(beyond, 0.0)))

    @cached_property
    def _pace(self) -> Array:
        """(P, C) [spread/step], equally likely."""
        return Paces(self.mean, self.sd).quantiles(PARTS)

    @cached_property
    def _now(self) -> Array:
        return self.off + self._pace * self.shape


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of one stream: courses with their weights and changes; [spread] is the baseline's.

    Weights are of the courses, given that there is one; all of them sum to 1.
    """

    smooth: Smooth
    wandering: Wandering
    begun: float  # [-] probability that there is an onset

    @property
    def weight(self) -> Array:
        """(C,) [-] of all courses."""
        return np.concatenate([self.smooth.weight, self.wandering.weight])

    @property
    def age(self) -> Array:
        """(C,) [steps] of all courses."""
        return np.concatenate([self.smooth.age, self.wandering.age])

    @property
    def straight(self) -> float:
        """P(it is an even ramp that goes on | begun) [-]."""
        one = self.smooth
        return float(one.weight @ ((one.power == 1.0) & np.isinf(one.lasts)))

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps | begun)."""
        return min(self.smooth.crossed(rise, x) + self.wandering.crossed(rise, x), 1.0)

    def steeper(self, rate: float) -> float:
        """P(the rate is above `rate` >= 0 [spread/step] | begun)."""
        return self.smooth.steeper(rate) + self.wandering.steeper(rate)
