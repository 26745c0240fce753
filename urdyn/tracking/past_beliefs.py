"""Earlier beliefs: to go back to once a change is detected, and to test drives for wear against."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from urdyn.tracking.colour import Colour
from urdyn.tracking.wear_test import ASKED, WearReference

S = TypeVar("S")

ROLLBACK = 2.0  # [s] for which a change may have been there before it is detected


@dataclass(frozen=True)
class RollbackPoint(Generic[S]):
    """What was learnt up to some moment."""

    belief: S
    colour: Colour  # of the noise


@dataclass(frozen=True, eq=False)
class PastBeliefs(Generic[S]):
    """What a tracker believed earlier in its run."""

    rollback: RollbackPoint[S]  # ROLLBACK or more before `marked`: no change had an effect yet
    next_rollback: RollbackPoint[S]  # at `marked`
    marked: float  # [s]
    reference: WearReference[S]  # what was believed when drives may since have worn
    recent: WearReference[S]  # and what was since; drives are tested against both by turns

    @classmethod
    def only(cls, point: RollbackPoint[S], t: float, passed: float, moved: float) -> PastBeliefs[S]:
        """Nothing is remembered but this belief, of t [s]."""
        reference = WearReference(point.belief, passed, moved)
        return cls(point, point, t, reference, reference)

    def due(self, t: float) -> bool:
        """Whether ROLLBACK has passed since the last was marked."""
        return t - self.marked >= ROLLBACK

    def marked_by(
        self,
        point: RollbackPoint[S],
        rollback: RollbackPoint[S],
        t: float,
        passed: float,
        moved: float,
    ) -> PastBeliefs[S]:
        """With one more, marked at t [s] of the clock; until the next, one goes back to `rollback`.

        That is the one before, and where a change has just begun there is none before.
        """
        reference, recent = self.reference, self.recent
        if moved - recent.moved > ASKED:  # no rollback goes behind this one
            reference, recent = recent, WearReference(rollback.belief, passed, moved)
        return PastBeliefs(rollback, point, t, reference, recent)

    def each(self, of: Callable[[S], S]) -> PastBeliefs[S]:
        """With another belief in the place of each."""
        return replace(
            self,
            rollback=replace(self.rollback, belief=of(self.rollback.belief)),
            next_rollback=replace(self.next_rollback, belief=of(self.next_rollback.belief)),
            reference=replace(self.reference, belief=of(self.reference.belief)),
            recent=replace(self.recent, belief=of(self.recent.belief)),
        )
