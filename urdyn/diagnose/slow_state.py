"""All that the tests of slow kinds remember from moment to moment."""

from __future__ import annotations

from dataclasses import dataclass

from urdyn.diagnose.carrying import Carrying, Waiting
from urdyn.diagnose.change import Change
from urdyn.diagnose.fault import Fault
from urdyn.diagnose.learning import Learnt
from urdyn.diagnose.onsets import Bank
from urdyn.diagnose.recall import Recall
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class SlowState:
    """The bank, and what is on its way into it."""

    bank: Bank
    A: Array  # (n, n) of the block that is being gathered
    b: Array  # (n,)
    warm: Array  # (3, J) sum over its moments
    moments: int  # in it
    begin: float  # [s] of that block; NaN: none
    end: float  # [s] of its last moment
    waiting: tuple[Waiting, ...]
    learnt: Learnt
    carrying: Carrying
    recall: Recall
    before: tuple[Bank, Recall]  # as they were when this program began
    waited: int = 0  # blocks since the alarm; 0: none
    known: tuple[Fault, ...] = ()
    passed: tuple[Fault, ...] = ()  # that were found, and were none; the last of each suspect
    likely: int | None = None  # suspect that explains the arm best, where there is one
    found: tuple[Change, ...] = ()  # in this step

    @property
    def suspects(self) -> tuple[int, ...]:
        """Those that are found."""
        return tuple(fault.suspect for fault in self.known)
