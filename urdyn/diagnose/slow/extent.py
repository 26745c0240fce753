"""How far the changes found have gone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.kinds.suspects import Suspects, left
from urdyn.diagnose.residual import friction
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.healthy import Healthy
from urdyn.diagnose.slow.recall import Level, Series
from urdyn.diagnose.slow.slow_state import SlowState
from urdyn.types import Array, Index


@dataclass(frozen=True, eq=False)
class Extent:
    """The size of a change by the state that measures it; of friction, by all its joint's terms."""

    healthy: Healthy
    of: Suspects

    def levels(self, state: SlowState) -> dict[int, Level]:
        """Suspects found, and how far their change has gone: time, size, sd."""
        return {fault.suspect: self.level(state, fault) for fault in state.known}

    def level(self, state: SlowState, fault: Fault) -> Level:
        """How far one change has gone: time, size, sd."""
        bank = state.bank
        return self._sizes(state, fault, [(bank.middle, bank.x, bank.P)])[0]

    def trace(self, state: SlowState, k: int) -> Series:
        """The course of a found change over the stored blocks: time, size, sd.

        Blocks that it divides are left out: they say nothing of it.
        """
        fault = next(fault for fault in state.known if fault.suspect == k)
        course = state.recall.course(state.arm(self.healthy))
        told = ((block.middle, x, P) for block, x, P in course if not fault.divides(block))
        return self._sizes(state, fault, told)

    def strays(self, state: SlowState) -> dict[int, float]:
        """Suspects found, and how far a healthy arm's sizes of them would stray [1/√s]."""
        blocks = state.recall.blocks
        walk = np.hypot(self.healthy.straying.walk, blocks[-1].walk if blocks else 0.0)
        told = {}
        for fault in state.known:
            of = self._share(state, fault)
            at = self.measured(fault.suspect) if of is None else self._terms(fault)
            told[fault.suspect] = float(np.linalg.norm(walk[at] if of is None else of * walk[at]))
        return told

    def terms(self, state: SlowState) -> dict[int, dict[str, dict[str, float]]]:
        """The growth of each term, for each friction fault found."""
        told = {}
        for fault in state.known:
            if fault.was:
                now = self._friction(state.bank.x, state.bank.P, fault)
                _, first = self._friction(*self.healthy.first, fault)
                told[fault.suspect] = friction.apart(now, fault.was, first)
        return told

    def with_before(self, state: SlowState, fault: Fault) -> Fault:
        """With the belief about its joint's friction before, if it is a friction fault.

        Args:
            state: that knows the other faults alone.
        """
        if not self.of.each[fault.suspect].kind.of_friction:
            return fault
        x, P = state.recall.before(fault, state.arm(self.healthy))
        return replace(fault, was=self._friction(x, P, fault))

    def measured(self, k: int) -> int:
        """Index of the state that measures a suspect's change."""
        return int(self.of.states[self.of.each[k].places[0]])

    def _sizes(
        self, state: SlowState, fault: Fault, beliefs: Iterable[tuple[float, Array, Array]]
    ) -> Series:
        """How far a change has gone by beliefs about the states, (N,) and (N, N), at their times.

        In the unit of the state that measures it; for friction, the growth of all of it, over the
        motion since.
        """
        of = self._share(state, fault)
        if fault.was is None or of is None:
            at = self.measured(fault.suspect)
            return [(t, float(x[at]), float(np.sqrt(P[at, at]))) for t, x, P in beliefs]
        _, first = self._friction(*self.healthy.first, fault)
        day = self.healthy.rules.friction["day"]
        return [
            (t, *friction.rise(of, self._friction(x, P, fault), fault.was, first, day))
            for t, x, P in beliefs
        ]

    def _share(self, state: SlowState, fault: Fault) -> Array | None:
        """The share of each term in its joint's friction, (3,) [-]; else None."""
        if fault.was is None:
            return None
        lost = (b.lost for b in state.recall.blocks if b.end > fault.onset_lo)
        return friction.share(lost, self._joint(fault))

    def _friction(self, x: Array, P: Array, fault: Fault) -> friction.Belief:
        """Belief about the friction of a fault's joint, from that in the states, (N,), (N, N).

        A bank is linear in current: a drive, or a sensor, by which the same torque takes 1 - z of
        its current takes as much of that of friction's rise; so f there is f (1 - z).
        """
        at, z = self._terms(fault), self.healthy.space.places["z"].start + self._joint(fault)
        per = left(float(x[z]))
        J = np.zeros((len(at), len(x)))
        J[range(len(at)), at], J[:, z] = per, per**2 * x[at]
        return per * x[at], J @ P @ J.T

    def _terms(self, fault: Fault) -> Index:
        """Places of the friction states of a fault's joint, (3,)."""
        places, joint = self.healthy.space.places, self._joint(fault)
        return np.array([places[name].start + joint for name in friction.TERMS])

    def _joint(self, fault: Fault) -> int:
        joint = self.of.each[fault.suspect].joint
        assert joint is not None, "a tool has no friction"
        return joint
