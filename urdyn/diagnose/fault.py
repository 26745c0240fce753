"""A slow fault that is known by now."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.change import Change
from urdyn.diagnose.onsets import Block
from urdyn.diagnose.suspects import Suspect
from urdyn.types import Array

FREE = 3.0  # [-] times the expected change, that a fault may have done at its onset


@dataclass(frozen=True, eq=False)
class Fault:
    """Which, since when, and how large it looked."""

    suspect: int  # among all that is looked for
    onset_lo: float  # [s] onsets of the bank that may be the first to show it, 5 and 95 %
    onset_hi: float  # [s]
    alarm: float  # [s] end of the block that told it
    size: float  # in the unit of the state that measures it
    grows: bool = False  # over many blocks; else it was there at once
    # What was believed of the joint's friction before, as `friction.TERMS` has it; None: nothing.
    was: tuple[Array, Array] | None = None

    def spread(self, suspect: Suspect) -> Array:
        """sd of what it may have done to the states of its suspect at its onset, (r,)."""
        return np.asarray(max(FREE, abs(self.size) / float(suspect.sd[0])) * suspect.sd)

    def by(self, t: float) -> Fault:
        """The same where blocks up to `t` [s] that might have shown its onset are forgotten."""
        return replace(self, onset_hi=max(self.onset_hi, t))

    def began_in(self, block: Block) -> bool:
        """Whether it may have; what began within a block shows whole in the next one."""
        lasting = block.end - block.begin
        return block.end > self.onset_lo and block.begin <= self.onset_hi + 1.5 * lasting

    def divides(self, block: Block) -> bool:
        """Whether it may have come at once within a block, of which a part is then without it."""
        return not self.grows and block.begin <= self.onset_hi and self.onset_lo < block.end

    def unseen_in(self, block: Block) -> bool:
        """Whether it was not there yet: it may have begun at the end of the last block before."""
        return block.end + 0.5 * (block.end - block.begin) < self.onset_lo


def known_by(change: Change) -> Fault:
    """What is known of a change that was found."""
    grows = change.rate != 0.0
    return Fault(change.suspect, *change.shown, change.alarm, change.size, grows)
