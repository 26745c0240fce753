"""A slow fault already found."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.kinds.suspects import Suspect
from urdyn.diagnose.slow.onsets import Block
from urdyn.types import Array

FREE = 3.0  # [-] sd of a fault's effect at onset, over the expected change


@dataclass(frozen=True, eq=False)
class Fault:
    """Its suspect, onset and apparent size."""

    suspect: int  # index among all suspects
    onset_lo: float  # [s] 5 and 95 % of the bank's onset that first shows it
    onset_hi: float  # [s]
    alarm: float  # [s] end of the block that showed it
    size: float  # in the unit of the state that measures it
    grows: bool = False  # over many blocks; else it came at once
    # Former belief about the joint's friction, ordered as `friction.TERMS`; None: another fault.
    was: tuple[Array, Array] | None = None

    def spread(self, suspect: Suspect) -> Array:
        """sd of its effect on its suspect's states at onset, (r,)."""
        return np.asarray(max(FREE, abs(self.size) / float(suspect.sd[0])) * suspect.sd)

    def by(self, t: float) -> Fault:
        """The same after blocks up to `t` [s] that might have shown its onset were dropped."""
        return replace(self, onset_hi=max(self.onset_hi, t))

    def began_in(self, block: Block) -> bool:
        """Whether it may have begun in a block; it then shows fully in the next one."""
        lasting = block.end - block.begin
        return block.end > self.onset_lo and block.begin <= self.onset_hi + 1.5 * lasting

    def divides(self, block: Block) -> bool:
        """Whether it may have come at once within a block, part of which is then without it."""
        return not self.grows and block.begin <= self.onset_hi and self.onset_lo < block.end

    def unseen_in(self, block: Block) -> bool:
        """Whether it did not exist yet: it may have begun at the end of the previous block."""
        return block.end + 0.5 * (block.end - block.begin) < self.onset_lo


def known_by(change: Change) -> Fault:
    """The fault known from a change that was found."""
    grows = change.rate != 0.0
    return Fault(change.suspect, *change.shown, change.alarm, change.size, grows)
