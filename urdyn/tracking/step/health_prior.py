"""The payload as reported, where most drives' health is likely unchanged since commissioning.

A filter that is to track drives has a wide prior on each one's health z from the first day on,
N(0, v²). It can hardly tell health from a load that has turned over little. For the reported load
more is known: most drives give what they gave, N(0, w²), and the few that changed give less. As

    N(z; 0, w²) / N(z; 0, v²) = v / w exp(-d² z² / 2),    d² = 1 / w² - 1 / v²,

assuming this of some drives amounts to giving the filter a reading of 0 for each of them, with
variance 1 / d². Where the filter's belief in z is N(m, P), and D = diag(d) with 0 for drives that
may have changed, the log likelihood of the measurements rises by

    sum log v / w - log |I + D P D| / 2 - m' D (I + D P D)^-1 D m / 2,

the ratio of the marginal likelihoods [Dickey1971]_, and for each excepted drive by log 2 P(z < 0),
by the belief that results: it can only give less, which half of the filter's prior contradicts.
Bayes' rule weighs the hypotheses that all drives are unchanged, all but one, or none. So a drive
that surely changed excepts itself, and the filter, which learns nothing of this, tracks it as
before. Unmodelled effects look like drives that give ever more, the more surely the longer a motion
is repeated; the reported load does not follow them there. Both variances grow as health may stray,
and d falls to 0: health on the first day says little an hour later.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import erfc, inf, log, sqrt

import numpy as np

from urdyn.dbn.wear import Wear
from urdyn.types import Array, Gaussian, Mask

ALIKE_SD = 0.003  # [-] w on the first day
ALIKE = 0.98  # [-] share of unchanged drives


@dataclass(frozen=True, eq=False)
class HealthPrior:
    """Prior on the health of drives that did not change abruptly, by the model of their wear."""

    wear: Wear
    at: slice  # of health, one per joint

    def load(self, belief: Gaussian, passed: float, changed_drives: Mask) -> Gaussian:
        """The load, (k,), from a belief in load and health, in that order, (k + J,).

        Args:
            passed: since the first day [s].
            changed_drives: drives that changed abruptly, (J,).
        """
        k = len(belief.mean) - len(changed_drives)
        d, likelier = self._known(passed)
        alike = self._alike & ~changed_drives
        D = d * alike
        P, m = belief.cov[k:, k:], belief.mean[k:]
        L = np.linalg.cholesky(np.eye(len(m)) + D[:, :, None] * P * D[:, None, :])
        white = np.linalg.solve(L, D[:, :, None] * np.column_stack([belief.cov[k:], m]))
        lever, missed = white[..., :-1], white[..., -1]
        lost = np.log(np.diagonal(L, axis1=1, axis2=2)).sum(axis=1)
        back = lever.swapaxes(1, 2)
        mean = belief.mean - (back @ missed[..., None])[..., 0]
        cov = belief.cov - back @ lever
        excepted = ~(self._alike | changed_drives)
        sd = np.sqrt(np.diagonal(cov, axis1=1, axis2=2)[:, k:])
        less = np.zeros_like(sd)
        less[excepted] = [_less(z) for z in (mean[:, k:] / sd)[excepted].tolist()]
        odds = alike @ likelier - lost - 0.5 * (missed**2).sum(axis=1)
        odds += less.sum(axis=1)
        share = self._prior * np.exp(odds - odds.max())
        share /= share.sum()
        told = share @ mean[:, :k]
        apart = mean[:, :k] - told
        spread = cov[:, :k, :k] + apart[:, :, None] * apart[:, None, :]
        return Gaussian(told, np.tensordot(share, spread, 1))

    def _known(self, passed: float) -> tuple[Array, Array]:
        """d and log v / w, (J,) each; 0 where the filter's prior is as narrow."""
        first, strayed = self._variance[0], passed ** np.arange(1, 4) @ self._variance[1:]
        v, w = first + strayed, np.minimum(ALIKE_SD**2, first) + strayed
        return np.asarray(np.sqrt(1.0 / w - 1.0 / v)), np.asarray(0.5 * np.log(v / w))

    @cached_property
    def _alike(self) -> Mask:
        """Unchanged drives by hypothesis: all, all but one, or none, (J + 2, J)."""
        every = np.ones(self.at.stop - self.at.start, dtype=bool)
        return np.vstack([every, ~np.diag(every), ~every])

    @cached_property
    def _prior(self) -> Array:
        """Probabilities of these, (J + 2,); the last covers all cases of more than one change."""
        J = self.at.stop - self.at.start
        known = np.r_[ALIKE**J, np.full(J, (1.0 - ALIKE) * ALIKE ** (J - 1))]
        return np.asarray(np.r_[known, 1.0 - known.sum()])

    @cached_property
    def _variance(self) -> Array:
        """Variance of health: on the first day, and per t, t² and t³ passed since, (4, J)."""
        prior, p = self.wear.prior.cov.diagonal(), len(self.wear.parameters)
        first = prior[self.at]
        own, rate, push = self.wear.own.diagonal()[self.at], np.zeros_like(first), 0.0 * first
        drifts = (self.at.start <= self.wear.drifting) & (self.wear.drifting < self.at.stop)
        of = self.wear.drifting[drifts] - self.at.start
        rate[of] = prior[p + np.flatnonzero(drifts)]
        push[of] = self.wear.push.diagonal()[drifts]
        return np.stack([first, own, rate, push / 3.0])


def _less(z: float) -> float:
    """log 2 P(z < 0), for a mean of z standard deviations."""
    # Of all SciPy a run would need this one function: its import takes 26 MB.
    twice = erfc(z / sqrt(2.0))
    return log(twice) if twice > 0.0 else -inf
