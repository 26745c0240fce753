"""The future of the weighted courses: when a level is crossed, as a mixture over them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr, ndtr, ndtri_exp

from urdyn.types import Array

TINY, LARGE = 1e-100, 600.0  # [-] least growth; [nats] most growth
PARTS = (np.arange(11.0) + 0.5) / 11.0  # [-] quantiles that represent a pace, or an onset


@dataclass(frozen=True, eq=False)
class Paces:
    """Gaussians truncated at zero, (C,) each."""

    mean: Array  # before truncation
    sd: Array

    @cached_property
    def cut(self) -> Array:
        """ln P(above zero) of the Gaussians, (C,)."""
        return np.asarray(log_ndtr(self.mean / self.sd))

    def above(self, level: Array | float) -> Array:
        """P(above a level of 0 or more), (C,)."""
        # In logarithms: both may be tiny.
        beyond = log_ndtr((self.mean - level) / self.sd) - self.cut
        return np.asarray(np.exp(np.minimum(beyond, 0.0)))

    def quantiles(self, of: Array) -> Array:
        """Quantiles of each, (len(of), C)."""
        above = np.log1p(-of)[:, None] + self.cut
        return np.asarray(np.maximum(self.mean - self.sd * ndtri_exp(above), 0.0))


@dataclass(frozen=True, eq=False)
class Smooth:
    """C courses of fixed shape, of which only the size is uncertain."""

    weight: Array  # (C,) [-]
    age: Array  # (C,) [steps] since the onset t0
    lasts: Array  # (C,) [steps] from the onset until it stopped; inf: it goes on
    power: Array  # (C,) [-]
    haste: Array  # (C,) [1/step] rate from now on, relative to the change
    ahead: Array  # (C,) [-] power from now on
    mean: Array  # (C,) [spread] of the change now before truncation at zero, sign of the fault
    sd: Array  # (C,) [spread]

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps), weighted."""
        if x > 0.0:
            grown = self.ahead * np.log1p(self.haste * x / self.ahead)
            return self._above(rise, np.exp(np.minimum(grown, LARGE)))
        k = np.minimum(self.age + x, self.lasts) / np.minimum(self.age, self.lasts)
        return self._above(rise, np.where(k > 0.0, np.maximum(k, 0.0) ** self.power, 0.0))

    def steeper(self, rate: float) -> float:
        """P(the rate is above `rate` >= 0 [spread/step]), weighted."""
        return self._above(rate, self.haste)

    def _above(self, level: float, times: Array) -> float:
        """P(the change, scaled by `times` (C,), is above a level), weighted."""
        there = times > TINY
        above = self._change.above(level / np.where(there, times, 1.0))
        return float(self.weight @ np.where(there, above, 0.0))

    @cached_property
    def _change(self) -> Paces:
        return Paces(self.mean, self.sd)


@dataclass(frozen=True, eq=False)
class Wandering:
    """C ramps on a random walk: change = off + pace x shape now, growing by pace per step.

    Wear does not reverse: a level exceeded at x was crossed by then [Birnbaum1969]_, and one that
    was crossed is exceeded now. In the past both ends are known, the onset and now; a walk between
    two ends is a bridge.
    """

    weight: Array  # (C,) [-]
    age: Array  # (C,) [steps] since the onset
    mean: Array  # (C,) [spread/step] of the pace before truncation at zero, sign of the fault
    sd: Array  # (C,) [spread/step]
    shape: Array  # (C,) [steps]
    off: Array  # (C,) [spread] walk of the level so far, without a ramp
    var: Array  # (C,) [spread²] of the change now, given the pace
    walk: Array  # (C,) [spread²/step] variance of the walk

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps), weighted."""
        there, now = self._beyond(rise, x), self._beyond(rise, 0.0)
        # For each pace it falls, then rises ahead, and rises, then falls behind: so the largest
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
        """P(the rate is above `rate` >= 0 [spread/step]), weighted."""
        return float(self.weight @ self._truncated.above(rate))

    @cached_property
    def _truncated(self) -> Paces:
        return Paces(self.mean, self.sd)

    @cached_property
    def _pace(self) -> Array:
        """Equally likely paces, (P, C) [spread/step]."""
        return self._truncated.quantiles(PARTS)

    @cached_property
    def _now(self) -> Array:
        return self.off + self._pace * self.shape


@dataclass(frozen=True, eq=False)
class Posterior:
    """Courses of one stream with their weights and changes; [spread] is the baseline's.

    Weights are conditional on an onset; all of them sum to 1.
    """

    smooth: Smooth
    wandering: Wandering
    begun: float  # [-] probability that there is an onset

    @property
    def weight(self) -> Array:
        """Weights of all courses, (C,) [-]."""
        return np.concatenate([self.smooth.weight, self.wandering.weight])

    @property
    def age(self) -> Array:
        """Ages of all courses, (C,) [steps]."""
        return np.concatenate([self.smooth.age, self.wandering.age])

    @property
    def straight(self) -> float:
        """P(it is a straight ramp that goes on | begun) [-]."""
        one = self.smooth
        return float(one.weight @ ((one.power == 1.0) & np.isinf(one.lasts)))

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps | begun)."""
        return min(self.smooth.crossed(rise, x) + self.wandering.crossed(rise, x), 1.0)

    def steeper(self, rate: float) -> float:
        """P(the rate is above `rate` >= 0 [spread/step] | begun)."""
        return self.smooth.steeper(rate) + self.wandering.steeper(rate)
