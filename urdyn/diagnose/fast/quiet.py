"""The quiet baseline that a push stands out from, and the loud bins so far.

A quiet bin gives the model's residual when nobody touches the arm. It is forgotten as fast as a
joint's friction may change: soon where it moves, slowly where it stands.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from urdyn.diagnose.fast.creep import Creep
from urdyn.diagnose.fast.pushed_link import BIN, LOUD, Bin, sizes
from urdyn.diagnose.load.carried import unlike
from urdyn.types import Array, Mask, changed

FORGET = 0.08  # [-] of a moving joint's baseline, per bin
RELAX = 0.015  # [-] of a standing one's: its friction changes slowly, but so may a hand's push
SPREAD = 0.02  # [-] of the estimate of its spread, per bin
WILD = 3.0  # [sd] most that one bin counts in the spread
NOTHING = 8.0  # [-] sum of squares below which bins determine the baseline's spread
KEPT = 16  # loud times, each of four bins at least: longer together than a reversal waits
LEARNS = 3.0  # [s] until the moments' loads include one that a bin showed first


@dataclass(frozen=True, eq=False)
class Quiet:
    """The baseline, and what stands out from it."""

    base: Array  # (J,) [N·m] net of the load; NaN: unknown
    bare: Array  # (J,) [N·m] the same without a load
    slack: Array  # (2, J) [N·m] range in which friction may have moved it since
    loose: Mask  # (J,) joints that begin to move, or to stand
    creep: Creep  # how joints stood
    since: Array  # (J,) [s] when they began to stand, or to move
    aimed: Array  # (J,) [N·m] predicted when the baseline was made
    asked: Array  # (J,) [N·m] predicted in the last bin
    spread: Array  # (J,) [(N·m)²] of quiet bins about it
    carried: Array  # (10,) assumed load
    changed: float  # [s] when a bin last showed another load
    unheard: Mask  # (J,) joints without a current in the last bin
    seen: int = 0  # quiet bins
    still: float = -np.inf  # [s] end of the last bin without a residual
    calm: int = 0  # quiet bins since the last loud one
    bins: tuple[Bin, ...] = ()  # of a possible push
    loads: Array = field(default_factory=partial(np.zeros, (0, 10)))  # known when it began
    past: Array = field(default_factory=partial(np.zeros, (0, 2)))  # [s] loud times before

    @property
    def going(self) -> bool:
        """Whether there may be a push."""
        return bool(self.bins)

    @property
    def loud(self) -> Array:
        """Start and end of recent loud times, pushes or not, (n, 2) [s]; inf: not over yet."""
        now = [(self.bins[0].t, np.inf)] if self.going else np.zeros((0, 2))
        return np.concatenate([self.past, now])

    def over(self, end: float) -> Quiet:
        """The loud time ends, at `end` [s]."""
        past = np.append(self.past, [[self.bins[0].t, end]], axis=0)[-KEPT:]
        return changed(self, calm=0, bins=(), past=past)

    def load_at(self, t: float, carried: Array) -> Array:
        """The likeliest possible load, (10,), or for a while the one that a bin showed."""
        if t - self.changed > LEARNS:
            return np.asarray(carried[0])
        return np.asarray(carried[np.argmin(unlike(carried, self.carried))])

    def beside(self, tool: Array, load: Array) -> Quiet:
        """A baseline with another load: a changed estimate of it is no push.

        A joint without a current may have missed it.

        Args:
            tool: (J, 10) [N·m] per unit of payload.
            load: inertials, (10,).
        """
        more = tool @ (load - self.carried)
        missed = self.unheard & (more != 0.0)
        return changed(self, base=np.where(missed, np.nan, self.base - more), carried=load)

    def learnt(self, seen: Bin, usual: Array, aimed: Array) -> Quiet:
        """The baseline after a quiet bin.

        Args:
            usual: variance of residuals then, (J,) [(N·m)²].
            aimed: predicted, (J,) [N·m].
        """
        fresh = np.isinf(seen.noise) | self.loose
        forget = np.where(self.creep.held, RELAX, FORGET)
        rate = np.maximum(forget, 1.0 / (self.seen + 1.0))
        square = seen.felt**2
        wide = fresh | (np.sum(np.where(fresh, 0.0, square / usual)) > NOTHING)
        clipped = np.minimum(square, WILD**2 * usual)
        spread = self.spread + np.where(wide, 0.0, SPREAD * (clipped - self.spread))
        base, bare = (
            of + np.where(fresh, 0.0, rate * felt)
            for of, felt in ((self.base, seen.felt), (self.bare, seen.bare))
        )
        at = self.aimed + np.where(fresh, 0.0, rate * (aimed - self.aimed))
        kept = np.where(fresh, 1.0, 1.0 - rate)
        slack, creep = kept * self.slack, self.creep.learnt(kept)
        known = changed(self, base=base, bare=bare, aimed=at, slack=slack, creep=creep)
        return changed(known, spread=spread, seen=self.seen + 1)

    def disproved(self) -> Quiet:
        """Drop first bins that are no longer loud: while they last no other push is detected."""
        if not self.going:
            return self
        size = sizes(self.bins)
        first = int(np.argmax(np.append(size, LOUD) >= LOUD))
        nothing = (
            b.t + BIN for b, of in zip(self.bins[:first], size, strict=False) if of < NOTHING
        )
        bins, still = self.bins[first:], max(self.still, *nothing, -np.inf)
        return changed(self, calm=self.calm if bins else 0, bins=bins, still=still)

    def doubted(self, since: float, late: Array | float = 0.0, slack: Array | float = 0.0) -> Quiet:
        """Residuals since then [s] may be explained by what is known only now: no push.

        Args:
            late: least error of predictions, (J,) [N·m].
            slack: least slack either way, (J,) [N·m].
        """

        def more(b: Bin) -> Bin:
            wide = np.array([np.minimum(b.slack[0], -slack), np.maximum(b.slack[1], slack)])
            return changed(b, doubt=np.maximum(b.doubt, late), slack=wide)

        return changed(self, bins=tuple(b if b.t < since else more(b) for b in self.bins))
