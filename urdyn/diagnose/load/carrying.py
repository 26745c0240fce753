"""The load at the tool: each moment's load, and for how long it has not been the usual one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.load.carried import Mode, Shown
from urdyn.diagnose.residual.moment import Means, Pool
from urdyn.types import Array

MOMENT = 0.5  # [s]
FEW = 20  # moments after which a light piece is searched for again
WATCHED = 240  # moments searched at most


@dataclass(frozen=True, eq=False)
class Waiting:
    """A moment that waits until its load is known, and that nobody pushed."""

    means: Means
    pool: Pool  # of these
    told: tuple[Shown, ...]  # near the known loads
    begin: float  # [s]
    end: float  # [s]
    long: float  # [s] of motion: a gap may have ended it early


@dataclass(frozen=True, eq=False)
class Absence:
    """A moment without the usual load."""

    begin: float  # [s]
    long: float  # [s] of motion
    mode: int  # carried instead
    # given what was known of the arm before: an undetected piece biases what is learnt in the
    # program
    told: Shown


@dataclass(frozen=True, eq=False)
class Carrying:
    """The load at the tool."""

    modes: tuple[Mode, ...]  # the first is usually carried
    now: int = 0
    was: int = 0  # before the first waiting moment
    path: tuple[int, ...] = ()  # mode of each waiting moment
    had: float = 0.0  # [s] of motion with the first, in this run
    last: float = -np.inf  # [s] when the first was last carried
    away: tuple[float, ...] = ()  # [s] of motion in each mode since the first was last carried
    since: float = np.nan  # [s] when that began
    sure: float = np.nan  # [s] start of the next moment: the arm may have come to rest in the first
    gone: tuple[Absence, ...] = ()  # since then
    unclaimed: tuple[Shown, ...] = ()  # the same for moments with the first in this program
    # Moments seem to weigh a load independently, but share the arm's error. Their information on an
    # arm that never strayed, (n, n), and the sd of the load's mass from it [kg].
    whole: Array | None = None
    weighed: float = np.nan
    handles: bool = False  # in this run a piece was put down again

    @property
    def due(self) -> bool:
        """Whether to search the unclaimed moments for a light piece."""
        return not self.was and bool(self.unclaimed) and len(self.unclaimed) % FEW == 0

    @property
    def loads(self) -> Array:
        """Inertials that may be carried in addition, those of now first, (K, 10)."""
        others = (mode for k, mode in enumerate(self.modes) if k != self.now)
        return np.array([mode.mean for mode in (self.modes[self.now], *others)])

    @property
    def absent(self) -> Array:
        """Time away in each mode, new ones included, (K,) [s]."""
        away = np.zeros(len(self.modes))
        away[: len(self.away)] = self.away
        return away

    def on(self, ripe: Waiting, anew: Shown) -> Carrying:
        """One moment on, in the mode `was`.

        Args:
            anew: its information given the arm as known before the program.
        """
        if not self.was:
            unclaimed = self.unclaimed if len(self.unclaimed) < WATCHED else ()
            had, handles = self.had + ripe.long, self.handles or bool(self.away)
            here = replace(self.here, had=had, last=ripe.end, handles=handles)
            return replace(here, unclaimed=(*unclaimed, anew))
        away = self.absent
        away[self.was] += ripe.long
        since = ripe.begin if np.isnan(self.since) else self.since
        gone = (*self.gone[1 - WATCHED :], Absence(ripe.begin, ripe.long, self.was, anew))
        sure = self.sure if self.since < self.sure else ripe.begin
        return replace(self, away=tuple(away.tolist()), since=since, sure=sure, gone=gone)

    def settled_on(self, stays: int, t: float) -> Carrying:
        """With this mode as the usual load, at t [s]; what came after it is away."""
        order = [stays, 0, *(j for j in range(1, len(self.modes)) if j != stays)]
        gone = tuple(replace(one, mode=order.index(one.mode)) for one in self.gone)
        with_it = [k for k, one in enumerate(gone) if not one.mode]
        ended = with_it[-1] + 1 if with_it else len(gone)
        after, away = gone[ended:], np.zeros(len(order))
        for one in after:
            away[one.mode] += one.long
        share = len(after) / max(len(gone), 1)
        settled = Carrying(
            modes=tuple(self.modes[j] for j in order),
            now=order.index(self.now),
            was=order.index(self.was),
            path=tuple(order.index(j) for j in self.path),
            had=float(self.absent[stays]),
            last=t,
            handles=bool(np.any(np.diff(with_it) > 1)),
        )
        if not after:
            return settled
        return replace(
            settled,
            last=gone[ended - 1].begin + MOMENT,
            away=tuple(away.tolist()),
            since=after[0].begin,
            sure=after[:2][-1].begin,
            gone=after,
            whole=None if self.whole is None else share * self.whole,
            weighed=self.weighed,
        )

    def without(self, forgotten: int) -> Carrying:
        """Without moments of a mode that has been replaced."""
        gone = tuple(one for one in self.gone if one.mode != forgotten)
        away = tuple(0.0 if k == forgotten else s for k, s in enumerate(self.away))
        return replace(self, gone=gone, away=away)

    @property
    def unladen(self) -> Carrying:
        """As if no other load had ever been carried."""
        first, had = self.modes[:1], self.had + sum(self.away)
        path = (0,) * len(self.path)
        return replace(self.here, modes=first, now=0, was=0, path=path, had=had, unclaimed=())

    @property
    def here(self) -> Carrying:
        """As if the usual load had just been carried."""
        return replace(self, away=(), since=np.nan, sure=np.nan, gone=(), whole=None)
