"""All that the tests of slow kinds keep from moment to moment."""

from __future__ import annotations

from dataclasses import dataclass, replace

from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.load.carrying import Carrying, Waiting
from urdyn.diagnose.residual.gathering import Gathering
from urdyn.diagnose.slow.ailing import Ailing
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.healthy import Healthy
from urdyn.diagnose.slow.learning import Learnt
from urdyn.diagnose.slow.onsets import Bank
from urdyn.diagnose.slow.recall import Recall


@dataclass(frozen=True, eq=False)
class LearntBy:
    """What had been learnt of a healthy arm's noise by a block's end."""

    end: float  # [s] of that block; before the first -inf
    learnt: Learnt


@dataclass(frozen=True, eq=False)
class SlowState:
    """The bank, and what waits to enter it."""

    bank: Bank
    gathering: Gathering
    waiting: tuple[Waiting, ...]
    heard: tuple[LearntBy, ...]  # after each of the last blocks, one at least
    carrying: Carrying
    recall: Recall
    before: tuple[Bank, Recall]  # as they were at the start of this program
    waited: int = 0  # blocks since the alarm; 0: none
    known: tuple[Fault, ...] = ()
    passed: tuple[Fault, ...] = ()  # found and retracted; the last of each suspect
    likely: int | None = None  # suspect that explains the arm best, where there is one
    found: tuple[Change, ...] = ()  # in this step

    @property
    def suspects(self) -> tuple[int, ...]:
        """Suspects that are found."""
        return tuple(fault.suspect for fault in self.known)

    @property
    def learnt(self) -> Learnt:
        """What was learnt of a healthy arm's noise."""
        return self.heard[-1].learnt

    def arm(self, healthy: Healthy) -> Ailing:
        """The arm with the faults known by now, as steady as it was learnt to be."""
        return Ailing(healthy, self.known, self.learnt.steadiness.share)

    def unheard(self, t: float) -> SlowState:
        """With what had been learnt by the blocks up to `t` [s], or by the oldest known."""
        heard = tuple(one for one in self.heard if one.end <= t) or self.heard[:1]
        return replace(self, heard=heard)
