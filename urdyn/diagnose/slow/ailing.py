"""The healthy arm once faults of it are known: these go on freely, and all else as before."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.healthy import Healthy
from urdyn.diagnose.slow.onsets import Bank, Block, Straying
from urdyn.types import Array

GROWTH = 150.0  # [s] in which a known fault may change by its expected size


@dataclass(frozen=True, eq=False)
class Ailing:
    """The arm with some faults."""

    healthy: Healthy
    known: tuple[Fault, ...]
    share: Array  # (J,) [-] of the rules' windows of friction

    @cached_property
    def straying(self) -> Straying:
        """How far it strays."""
        healthy = self.healthy
        walk = healthy.straying.walk.copy()
        for fault in self.known:
            suspect = healthy.of.freed_by(fault.suspect)
            walk[healthy.of.states[suspect.places]] += suspect.sd / np.sqrt(GROWTH)
        window = healthy.straying.window.copy()
        level = np.zeros(healthy.space.joints)
        window[: healthy.space.size] = healthy.window(self.share, level)
        return Straying(walk, window)

    def opened(self, P: Array, t: float) -> Array:
        """A covariance at `t` [s] with unknown sizes of the faults that began before."""
        return np.asarray(P + np.diag(self._free(f for f in self.known if f.onset_lo < t)))

    def leaping(self, block: Block) -> Block:
        """A block, at whose start faults may have begun, if it has information on them.

        One that a fault divides is left out: no state explains both its parts, and the nearest (a
        rotor, an offset) would stay wrong.
        """
        seen = block.A.diagonal() > 0.0
        var = self._free(fault for fault in self.known if fault.began_in(block))
        whole = float(not any(fault.divides(block) for fault in self.known))
        return replace(block, A=whole * block.A, b=whole * block.b, leap=np.sqrt(seen * var))

    def _free(self, faults: Iterable[Fault]) -> Array:
        """Variance of these faults' effects, (N,)."""
        var = np.zeros(self.healthy.size)
        for fault in faults:
            suspect = self.healthy.of.freed_by(fault.suspect)
            var[self.healthy.of.states[suspect.places]] += fault.spread(suspect) ** 2
        return var

    def informed(self, bank: Bank, later: Bank) -> Bank:
        """A bank with the later belief about the states that faults have changed since."""
        if not self.known:
            return bank
        of = self.healthy.of
        each = [of.states[of.freed_by(fault.suspect).places] for fault in self.known]
        at = np.unique(np.concatenate(each))
        x, P = bank.x.copy(), bank.P.copy()
        x[at] = later.x[at]
        P[at] = P[:, at] = 0.0
        P[np.ix_(at, at)] = later.P[np.ix_(at, at)]
        return replace(bank, x=x, P=P)
