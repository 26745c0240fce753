"""Who tells what is carried while a filter learns it anew: the filter, and who remembers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from urdyn.estimate import Filter
from urdyn.tracking import beliefs
from urdyn.tracking.held import LOAD, Held, nothing_held
from urdyn.types import Array, Gaussian, Index

S = TypeVar("S")


@dataclass(frozen=True, eq=False)
class Holding(Generic[S]):
    """A filter's belief beside what was known before."""

    filter: Filter[S]
    first: int  # of the load among the states

    def begun(self, held: Held, belief: S, carried: Array, change: float, told: bool) -> Held:
        """What is known as it begins to be learnt anew, around `carried` (10,).

        Nothing by a cloud of particles: where it is of one opinion, it has no errors to weigh.

        Args:
            change: probability that it is another.
            told: and that this was told.
        """
        if not isinstance(belief, beliefs.QUICK):
            return nothing_held()
        known = held.believed(self._own(belief))
        return Held(known.mean, known.cov, carried[:LOAD], change, told)

    def exchanged(self, held: Held, belief: S) -> bool:
        """Whether it surely is another by now."""
        return held.exchanged(self._own(belief))

    def believed(self, held: Held, belief: S) -> Gaussian:
        """All states, (n,)."""
        whole = self.filter.belief(belief)
        if not held.doubted:
            return whole
        at = slice(self.first, self.first + LOAD)
        load = held.believed(Gaussian(whole.mean[at], whole.cov[at, at]))
        return with_load(whole, load, self.first)

    @cached_property
    def _at(self) -> Index:
        return self.first + np.arange(LOAD)

    def _own(self, belief: S) -> Gaussian:
        """What the filter believes of the load, (4,)."""
        return beliefs.marginal(self.filter, belief, self._at)


def with_load(belief: Gaussian, load: Gaussian, first: int) -> Gaussian:
    """The belief (n,), with this load from its `first` state on; what hangs on it still does."""
    at = slice(first, first + len(load.mean))
    mean, T = np.array(belief.mean), np.eye(len(belief.mean))
    mean[at] = load.mean
    own, other = np.linalg.cholesky(belief.cov[at, at]), np.linalg.cholesky(load.cov)
    T[at, at] = np.linalg.solve(own.T, other.T).T
    return Gaussian(mean, T @ belief.cov @ T.T)
