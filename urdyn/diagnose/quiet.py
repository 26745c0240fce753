"""The quiet baseline beside which a push is felt, and what has been loud beside it.

A quiet bin says what the model leaves when nobody touches the arm. It is forgotten as fast as what
holds a joint may change: soon where it moves, slowly where it stands.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from urdyn.diagnose.carried import unlike
from urdyn.diagnose.creep import Creep
from urdyn.diagnose.pushed import BIN, LOUD, Bin, sizes
from urdyn.types import Array, Mask

FORGET = 0.08  # [-] of the baseline of a joint that moves, a bin
RELAX = 0.015  # [-] of one that stands: what holds it changes slowly, a hand may press as slowly
SPREAD = 0.02  # [-] of what is known of its spread
WILD = 3.0  # [sd] that one bin counts at most in the spread
NOTHING = 8.0  # [-] sum of squares below which bins tell how far the baseline is to be believed
LEARNS = 3.0  # [s] in which who tells loads by moments has learnt of one that was felt to come


@dataclass(frozen=True, eq=False)
class Quiet:
    """The baseline, and what happens beside it."""

    base: Array  # (J,) [N·m] beside what is carried; NaN: unknown
    bare: Array  # (J,) [N·m] the same if nothing is
    slack: Array  # (2, J) [N·m] from where to where friction may have taken it since
    loose: Mask  # (J,) joints that begin to move, or to stand
    creep: Creep  # how joints stood
    since: Array  # (J,) [s] when they began to, or to move
    aimed: Array  # (J,) [N·m] predicted when the baseline was made
    asked: Array  # (J,) [N·m] predicted in the last bin
    spread: Array  # (J,) [(N·m)²] of quiet bins about it
    carried: Array  # (10,) what was taken to be at the tool
    changed: float  # [s] when another load was felt to come
    unheard: Mask  # (J,) joints whose current nobody knew in the last bin
    seen: int = 0  # quiet bins
    still: float = -np.inf  # [s] end of the last bin in which nothing was felt
    calm: int = 0  # quiet bins since the last loud one
    bins: tuple[Bin, ...] = ()  # of what happens
    loads: Array = field(default_factory=partial(np.zeros, (0, 10)))  # known when that began

    @property
    def going(self) -> bool:
        """Whether something happens."""
        return bool(self.bins)

    def load_at(self, t: float, carried: Array) -> Array:
        """The likeliest of what may be carried, (10,), or for a while what was felt to come."""
        if t - self.changed > LEARNS:
            return np.asarray(carried[0])
        return np.asarray(carried[np.argmin(unlike(carried, self.carried))])

    def beside(self, tool: Array, load: Array) -> Quiet:
        """A baseline beside another load: who changes their mind about it has not felt anything.

        A joint that was not heard may not have learnt of it.

        Args:
            tool: (J, 10) [N·m] per unit of payload.
            load: inertials, (10,).
        """
        more = tool @ (load - self.carried)
        missed = self.unheard & (more != 0.0)
        return replace(self, base=np.where(missed, np.nan, self.base - more), carried=load)

    def learnt(self, seen: Bin, usual: Array, aimed: Array) -> Quiet:
        """The baseline after a bin in which nothing happened.

        Args:
            usual: variance of what is felt then, (J,) [(N·m)²].
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
        known = replace(self, base=base, bare=bare, aimed=at, slack=slack, creep=creep)
        return replace(known, spread=spread, seen=self.seen + 1)

    def disproved(self) -> Quiet:
        """Without what was loud until more was known: who waits for its end is deaf meanwhile."""
        if not self.going:
            return self
        size = sizes(self.bins)
        first = int(np.argmax(np.append(size, LOUD) >= LOUD))
        nothing = (
            b.t + BIN for b, of in zip(self.bins[:first], size, strict=False) if of < NOTHING
        )
        bins, still = self.bins[first:], max(self.still, *nothing, -np.inf)
        return replace(self, calm=self.calm if bins else 0, bins=bins, still=still)

    def doubted(self, since: float, late: Array | float = 0.0, slack: Array | float = 0.0) -> Quiet:
        """What was felt since then [s] may be what is known only now: no push.

        Args:
            late: that is the least that predictions are off by, (J,) [N·m].
            slack: that there is either way, (J,) [N·m].
        """

        def more(b: Bin) -> Bin:
            wide = np.array([np.minimum(b.slack[0], -slack), np.maximum(b.slack[1], slack)])
            return replace(b, doubt=np.maximum(b.doubt, late), slack=wide)

        return replace(self, bins=tuple(b if b.t < since else more(b) for b in self.bins))
