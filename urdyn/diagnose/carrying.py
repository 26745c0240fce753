"""What is at the tool: whose load the moments were, and how long it has not been the usual one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.carried import Mode, Shown
from urdyn.diagnose.moment import Means, Pool
from urdyn.types import Array

MOMENT = 0.5  # [s]
FEW = 20  # moments after which a light piece is searched for again
WATCHED = 240  # moments that are searched at most


@dataclass(frozen=True, eq=False)
class Waiting:
    """A moment that waits until it is known whose load it was, and that nobody pushed."""

    means: Means
    pool: Pool  # of those
    told: tuple[Shown, ...]  # near the loads that were known
    begin: float  # [s]
    end: float  # [s]


@dataclass(frozen=True, eq=False)
class Carrying:
    """What is at the tool."""

    modes: tuple[Mode, ...]  # the first is what is carried as a rule
    now: int = 0
    was: int = 0  # before the first of the moments that wait
    path: tuple[int, ...] = ()  # mode of each of those
    had: float = 0.0  # [s] of motion with the first, in this run
    last: float = -np.inf  # [s] when that was carried last
    away: tuple[float, ...] = ()  # [s] of motion in each mode since the first was last carried
    since: float = np.nan  # [s] when that began
    sure: float = np.nan  # [s] begin of the moment after that: the arm may have come to rest in one
    # Of moments since then, and of those with the first since the program began, as they look to
    # who knows of the arm what was known before: an unseen piece bends what the program teaches.
    gone: tuple[Shown, ...] = ()
    unclaimed: tuple[Shown, ...] = ()
    # Moment by moment a load seems to be weighed anew; by the same arm it never is. What moments
    # with it tell of an arm that never strayed, (n, n), and how well they weigh it so, sd [kg].
    whole: Array | None = None
    weighed: float = np.nan
    handles: bool = False  # in this run something was put down again

    @property
    def due(self) -> bool:
        """Whether it is time to search these for a light piece."""
        return not self.was and bool(self.unclaimed) and len(self.unclaimed) % FEW == 0

    @property
    def absent(self) -> Array:
        """Time away in every mode, also in those that are new, (K,) [s]."""
        away = np.zeros(len(self.modes))
        away[: len(self.away)] = self.away
        return away

    def on(self, ripe: Waiting, anew: Shown) -> Carrying:
        """A moment on, in the mode that it `was` told.

        Args:
            anew: what it says to who knew the arm before the program.
        """
        if not self.was:
            unclaimed = self.unclaimed if len(self.unclaimed) < WATCHED else ()
            had, handles = self.had + MOMENT, self.handles or bool(self.away)
            here = replace(self.here, had=had, last=ripe.end, handles=handles)
            return replace(here, unclaimed=(*unclaimed, anew))
        away = self.absent
        away[self.was] += MOMENT
        since = ripe.begin if np.isnan(self.since) else self.since
        gone = (*self.gone[1 - WATCHED :], anew)
        sure = self.sure if self.since < self.sure else ripe.begin
        return replace(self, away=tuple(away.tolist()), since=since, sure=sure, gone=gone)

    @property
    def unladen(self) -> Carrying:
        """As if no other load had ever been carried."""
        first, had = self.modes[:1], self.had + sum(self.away)
        path = (0,) * len(self.path)
        return replace(self.here, modes=first, now=0, was=0, path=path, had=had, unclaimed=())

    @property
    def here(self) -> Carrying:
        """As if the first had just been carried."""
        return replace(self, away=(), since=np.nan, sure=np.nan, gone=(), whole=None)
