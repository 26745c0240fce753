"""The payload, by a filter that learns it anew and by what was known before."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from urdyn.estimate import Filter
from urdyn.estimate.protocol import S, is_gaussian
from urdyn.tracking.belief import beliefs
from urdyn.tracking.step.health_prior import HealthPrior
from urdyn.tracking.step.payload_hypotheses import LOAD, PayloadHypotheses, no_hypotheses
from urdyn.tracking.step.state import TrackerState
from urdyn.types import Array, Gaussian, Index


@dataclass(frozen=True, eq=False)
class PayloadBelief(Generic[S]):
    """Combines a filter's belief with what was known before of the load and of drives."""

    filter: Filter[S]
    first: int  # index of the load among the states
    health_prior: HealthPrior  # of drives

    def begun(
        self, state: TrackerState[S], carried: Array, change: float, told: bool
    ) -> PayloadHypotheses:
        """What is known of the load as learning anew begins, around `carried` (10,).

        Nothing for a filter that keeps no Gaussian: particles copied from one have no errors to
        weigh.

        Args:
            change: probability that it is another.
            told: whether that was reported.
        """
        if not is_gaussian(self.filter):
            return no_hypotheses()
        return state.load.anew(self._own(state), carried[:LOAD], change, told)

    def exchanged(self, held: PayloadHypotheses, state: TrackerState[S]) -> bool:
        """Whether it surely is another by now."""
        return held.exchanged(self._own(state))

    def believed(self, state: TrackerState[S]) -> Gaussian:
        """All states, (n,)."""
        whole = self.filter.belief(state.belief)
        if not is_gaussian(self.filter):
            return whole
        return with_load(whole, state.load.believed(self._own(state)), self.first)

    @cached_property
    def _at(self) -> Index:
        """Indices of the load and of health."""
        return np.asarray(np.r_[self.first : self.first + LOAD, self.health_prior.at])

    def _own(self, state: TrackerState[S]) -> Gaussian:
        """The belief in the load, (4,), from all that was learnt since it began anew."""
        known = beliefs.marginal(self.filter, state.belief, self._at)
        return self.health_prior.load(known, state.passed, state.changed_drives)


def with_load(belief: Gaussian, load: Gaussian, first: int) -> Gaussian:
    """The belief (n,), with this load from state `first` on, correlated with others as before."""
    at = slice(first, first + len(load.mean))
    mean, cov = np.array(belief.mean), np.array(belief.cov)
    own, other = np.linalg.cholesky(belief.cov[at, at]), np.linalg.cholesky(load.cov)
    across = np.linalg.solve(own.T, other.T).T @ belief.cov[at]
    mean[at], cov[at], cov[:, at] = load.mean, across, across.T
    cov[at, at] = load.cov
    return Gaussian(mean, cov)
