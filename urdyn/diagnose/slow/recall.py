"""Stored blocks, to process again once a fault is known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from urdyn.diagnose.slow import onsets
from urdyn.diagnose.slow.ailing import Ailing
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.onsets import Bank, Block
from urdyn.io.clock import PAUSE
from urdyn.types import Array

KEPT = 48  # blocks

Level = tuple[float, float, float]  # of a change: time [s], size, sd
Series = Sequence[Level]


@dataclass(frozen=True, eq=False)
class Recall:
    """The healthy arm before the first of them, and the blocks."""

    t: float  # [s]; NaN: no block was ever dropped
    x: Array  # (N,)
    P: Array  # (N, N)
    blocks: tuple[Block, ...] = ()

    def after(self, block: Block, arm: Ailing) -> Recall:
        """Add one block; drop the oldest where there are too many."""
        first, *others = (*self.blocks, block)
        if len(others) < KEPT:
            return replace(self, blocks=(first, *others))
        first = arm.leaping(first)
        return Recall(*onsets.followed(self.t, self.x, self.P, first, arm.straying), tuple(others))

    def until(self, t: float) -> Recall:
        """Drop the blocks that end after `t` [s]."""
        kept = tuple(block for block in self.blocks if block.end <= t)
        return self if len(kept) == len(self.blocks) else replace(self, blocks=kept)

    def unladen(self, t: float, until: float = np.inf) -> Recall:
        """As if no other load had come since `t` [s], in blocks that begin before `until` [s]."""
        blocks = (b.unladen if b.unladen and t <= b.begin < until else b for b in self.blocks)
        return replace(self, blocks=tuple(blocks))

    def bearing(self, more: Array, since: float, until: float) -> Recall:
        """With another usual load, whose states differ by `more`, (N,).

        Blocks that begin from `since` until `until` [s] bore it.
        """
        blocks = (b.bearing(more, since <= b.begin < until) for b in self.blocks)
        return replace(self, blocks=tuple(blocks))

    def pause(self, since: float, until: float) -> tuple[float, float] | None:
        """The longest pause that overlaps this interval, and in which a robot may have been off.

        All in [s], a pause from the end of work to its begin.
        """
        rests = [(a.end, b.begin) for a, b in pairwise(self.blocks)]
        off = [p for p in rests if p[1] - p[0] >= PAUSE and p[0] < until and since < p[1]]
        return max(off, key=lambda pause: pause[1] - pause[0], default=None)

    def again(self, arm: Ailing, E: Array) -> Bank:
        """The bank of these blocks, in which the known faults may have changed the states."""
        bank = onsets.first(self.x, arm.opened(self.P, self.t), E.shape[1], self.t)
        for block in self.blocks:
            bank = onsets.step(bank, arm.leaping(block), arm.straying, E)
        return bank

    def course(self, arm: Ailing) -> Iterator[tuple[Block, Array, Array]]:
        """Each block, and the belief about the states after it, (N,) and (N, N)."""
        t, x, P = self.t, self.x, arm.opened(self.P, self.t)
        for block in self.blocks:
            t, x, P = onsets.followed(t, x, P, arm.leaping(block), arm.straying)
            yield block, x, P

    def before(self, fault: Fault, arm: Ailing) -> tuple[Array, Array]:
        """The belief about the states, (N,) and (N, N), before a fault could be seen.

        If the fault began before the first block, the belief there may have followed it for long:
        then only the first day's is known.

        Args:
            arm: with the other faults.
        """
        if fault.onset_lo < self.t:
            return arm.healthy.first
        last = self.x, arm.opened(self.P, self.t)
        for block, x, P in self.course(arm):
            if not fault.unseen_in(block):
                break
            last = x, P
        return last
