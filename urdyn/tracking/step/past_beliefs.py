"""Earlier beliefs: to roll back to once a change is detected, and to test drives for wear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic

from urdyn.estimate.protocol import S
from urdyn.tracking.noise.colour import Colour
from urdyn.tracking.step.wear_test import ASKED, WearReference

ROLLBACK = 2.0  # [s] that a change may take to be detected


@dataclass(frozen=True)
class RollbackPoint(Generic[S]):
    """What was learnt up to some moment."""

    belief: S
    colour: Colour  # of the noise


@dataclass(frozen=True, eq=False)
class PastBeliefs(Generic[S]):
    """What a tracker believed earlier in its run."""

    rollback: RollbackPoint[S]  # ROLLBACK or more before `marked`, before any change had an effect
    next_rollback: RollbackPoint[S]  # at `marked`
    marked: float  # [s]
    reference: WearReference[S]  # the belief against which drives are tested for wear
    recent: WearReference[S]  # and a later one; the tests alternate between both

    @classmethod
    def only(cls, point: RollbackPoint[S], t: float, passed: float, moved: float) -> PastBeliefs[S]:
        """Past beliefs that consist of this one, of t [s], alone."""
        reference = WearReference(point.belief, passed, moved)
        return cls(point, point, t, reference, reference)

    def due(self, t: float) -> bool:
        """Whether ROLLBACK has passed since the last point was marked."""
        return t - self.marked >= ROLLBACK

    def marked_by(
        self,
        point: RollbackPoint[S],
        rollback: RollbackPoint[S],
        t: float,
        passed: float,
        moved: float,
    ) -> PastBeliefs[S]:
        """With `point` marked at t [s] of the clock; until the next, roll back to `rollback`.

        That is the previous point, or `point` itself where a change has just begun.
        """
        reference, recent = self.reference, self.recent
        if moved - recent.moved > ASKED:  # no rollback goes further back than this
            reference, recent = recent, WearReference(rollback.belief, passed, moved)
        return PastBeliefs(rollback, point, t, reference, recent)

    def each(self, of: Callable[[S], S]) -> PastBeliefs[S]:
        """With `of` applied to each belief."""
        return replace(
            self,
            rollback=replace(self.rollback, belief=of(self.rollback.belief)),
            next_rollback=replace(self.next_rollback, belief=of(self.next_rollback.belief)),
            reference=replace(self.reference, belief=of(self.reference.belief)),
            recent=replace(self.recent, belief=of(self.recent.belief)),
        )
