"""The healthy arm of a bank: the belief on its first day, and how far it strays.

Its states are those of the space, followed by the unknowns of warmth.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose import carried, friction, warmth
from urdyn.diagnose.fault import Fault
from urdyn.diagnose.onsets import Bank, Block, Straying
from urdyn.diagnose.rules import Rules
from urdyn.diagnose.space import Space
from urdyn.diagnose.suspects import Suspects
from urdyn.types import Array

PER_HOUR = 60.0  # [√s] in an hour: a walk grows with the root of time
GROWTH = 150.0  # [s] in which a known fault may change by its expected size


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

    def loosened(self, known: Sequence[Fault], share: Array) -> Straying:
        """How far it strays when some faults are known, which go on freely.

        Args:
            share: of the rules' windows of friction, (J,) [-].
        """
        walk = self.straying.walk.copy()
        for fault in known:
            suspect = self.of.freed_by(fault.suspect)
            walk[self.of.states[suspect.places]] += suspect.sd / np.sqrt(GROWTH)
        window = self.straying.window.copy()
        window[: self.space.size] = self.window(share, np.zeros(self.space.joints))
        return Straying(walk, window)

    def opened(self, P: Array, known: Sequence[Fault], t: float) -> Array:
        """A covariance at `t` [s] with unknown sizes of the faults that began before."""
        return np.asarray(P + np.diag(self._free(f for f in known if f.onset_lo < t)))

    def leaping(self, block: Block, known: Sequence[Fault]) -> Block:
        """A block, at whose start known faults may have begun, if it has information on them.

        One that a fault divides is left out: no state explains both its parts, and the nearest (a
        rotor, an offset) would stay wrong.
        """
        seen = block.A.diagonal() > 0.0
        var = self._free(fault for fault in known if fault.began_in(block))
        whole = float(not any(fault.divides(block) for fault in known))
        return replace(block, A=whole * block.A, b=whole * block.b, leap=np.sqrt(seen * var))

    def _free(self, faults: Iterable[Fault]) -> Array:
        """Variance of these faults' effects, (N,)."""
        var = np.zeros(self.size)
        for fault in faults:
            suspect = self.of.freed_by(fault.suspect)
            var[self.of.states[suspect.places]] += fault.spread(suspect) ** 2
        return var

    def informed(self, bank: Bank, later: Bank, known: Sequence[Fault]) -> Bank:
        """A bank with the later belief about the states that faults have changed since."""
        if not known:
            return bank
        each = [self.of.states[self.of.freed_by(fault.suspect).places] for fault in known]
        at = np.unique(np.concatenate(each))
        x, P = bank.x.copy(), bank.P.copy()
        x[at] = later.x[at]
        P[at] = P[:, at] = 0.0
        P[np.ix_(at, at)] = later.P[np.ix_(at, at)]
        return replace(bank, x=x, P=P)

    def now(self, bank: Bank, warm: Array) -> tuple[Array, Array]:
        """The belief about the states of the space at joint temperatures `warm` (3, J)."""
        return warmth.narrowed(bank.x, bank.P, warmth.unknowns(self.space, warm))
