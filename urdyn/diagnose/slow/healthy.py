"""The healthy arm of a bank: the belief on its first day, and how far it strays.

Its states are those of the space, followed by the unknowns of warmth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.diagnose.kinds.rules import Rules
from urdyn.diagnose.kinds.suspects import Suspects
from urdyn.diagnose.load import carried
from urdyn.diagnose.residual import friction, warmth
from urdyn.diagnose.residual.space import Space
from urdyn.diagnose.slow.onsets import Bank, Straying
from urdyn.types import Array

PER_HOUR = 60.0  # [√s] in an hour: a walk grows with the root of time


@dataclass(frozen=True, eq=False)
class Healthy:
    """Belief about the healthy arm on its first day, and how far it strays from block to block."""

    space: Space
    rules: Rules
    of: Suspects

    @cached_property
    def size(self) -> int:
        """Number of states N."""
        return self.space.size + len(warmth.UNKNOWN) * self.space.joints

    @cached_property
    def first(self) -> tuple[Array, Array]:
        """Mean (N,) and covariance (N, N) on the first day."""
        n, P = self.space.size, np.zeros((self.size, self.size))
        P[:n, :n] = self.space.cov + np.diag(self.rules.stray(self.space, "day") ** 2)
        sd = [self.rules.warmth[name] for name in warmth.UNKNOWN]
        P[range(n, self.size), range(n, self.size)] = np.repeat(sd, self.space.joints) ** 2
        return self.emptied(np.zeros(self.size), P)

    def emptied(self, x: Array, P: Array) -> tuple[Array, Array]:
        """The belief with the usual load."""
        x, P, at = x.copy(), P.copy(), self.space.payload
        x[at] = 0.0
        P[at] = P[:, at] = 0.0
        P[at, at] = carried.NOTHING**2
        return x, P

    @cached_property
    def straying(self) -> Straying:
        """How far it strays."""
        walk, n = np.zeros(self.size), self.space.size
        walk[:n] = self.rules.stray(self.space, "hour") / PER_HOUR
        window = np.zeros(self.size)
        window[:n] = self.rules.stray(self.space, "window")
        return Straying(walk, window)

    def window(self, share: Array, level: Array) -> Array:
        """How far windows stray for an arm whose joints are steadier than the rules, (n,).

        Args:
            share: of the rules' windows of friction, (J,) [-].
            level: sd that low-frequency noise puts into offsets, (J,) [N·m].
        """
        window = self.straying.window[: self.space.size].copy()
        for state in friction.TERMS:
            window[self.space.places[state]] *= share
        o = self.space.places["o"]
        window[o] = np.hypot(window[o], level)
        return window

    def blind(self, warm: Array) -> Array:
        """How much more friction strays where joint temperatures are not measured, (N,) [1/√s].

        Args:
            warm: as `warmth.unknowns` takes it, (3, J).
        """
        walk = np.zeros(self.size)
        walk[self.space.places["alpha"]] = np.isnan(warm[0]) * self.rules.warmth["blind"] / PER_HOUR
        return walk

    def now(self, bank: Bank, warm: Array) -> tuple[Array, Array]:
        """The belief about the states of the space at joint temperatures `warm` (3, J)."""
        return warmth.narrowed(bank.x, bank.P, warmth.unknowns(self.space, warm))
