"""The payload as reported while it is unknown whether it was exchanged.

A filter that learns the payload anew begins with a prior N(r, V) that is wide enough for anything.
More is known meanwhile: either it is what it was before, N(m, S), or a light piece or none, or a
bulky one, N(0, W) each. All measurements since then are in the filter's belief N(x, P), as
information on the load with everything else integrated out,

    G = P^-1 - V^-1,    h = P^-1 x - V^-1 r.

With a prior N(m, S), the load's posterior is N(m + (S^-1 + G)^-1 (h - G m), (S^-1 + G)^-1), and
the log likelihood of the measurements is

    h' m - m' G m / 2 + (h - G m)' (S^-1 + G)^-1 (h - G m) / 2 - log |I + S G| / 2,

up to a common constant. Bayes' rule weighs the hypotheses [Magill1965]_.

The payload before and since then shares the same errors of friction and gain, to an unknown degree.
So the two are combined by covariance intersection [Niehsen2002]_: agreement makes nothing surer.
The filter itself is given none of this: it would take a light piece for none, at the expense of
friction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.tracking.belief.model import ANYTHING, LIGHT, PAYLOAD_SD
from urdyn.tracking.belief.physical import KNOWN
from urdyn.types import Array, Gaussian, freeze

LOAD = 4  # mass and first moments: a few seconds say little of inertia
CHANGE = 1.0 / 3.0  # [-] share of a handling program's rests in which a piece comes or goes
SURE = 5.0  # [-] log odds of another payload, at which it is reported
WIDE = (ANYTHING * PAYLOAD_SD)[:LOAD]  # square roots of V
OTHERS = np.array([LIGHT, PAYLOAD_SD])[:, :LOAD]  # square roots of W


@dataclass(frozen=True, eq=False)
class PayloadHypotheses:
    """What was known of the load before learning it anew."""

    mean: Array  # (4,) [kg, kg m]
    cov: Array  # (4, 4)
    first: Array  # (4,) r
    change: float  # [-] prior probability that it is another; NaN: it is not learnt anew
    told: bool  # another payload was reported

    def __post_init__(self) -> None:
        freeze(self, "mean", "cov", "first")

    @property
    def doubted(self) -> bool:
        """Whether the hypotheses add to the filter's belief."""
        return not np.isnan(self.change)

    def anew(self, now: Gaussian, first: Array, change: float, told: bool) -> PayloadHypotheses:
        """What is known as learning anew begins, around `first` (4,), given the belief `now`.

        What was known before stands as long as neither another load was told nor what is carried
        is known: an arm that stands jerks as it gets or loses a piece, and sets off after that.
        From a load in doubt, none would surely be another.
        """
        known = self.believed(now)
        if self.doubted and not (self.told or told) and known.sd[0] > KNOWN:
            return replace(self, first=first)
        return PayloadHypotheses(known.mean, known.cov, first, change, told)

    def given_up(self) -> PayloadHypotheses:
        """With learning anew given up."""
        return replace(self, change=np.nan, told=False)

    def believed(self, now: Gaussian) -> Gaussian:
        """The load, (4,), given the filter's belief `now`: the likeliest, with the whole spread."""
        if not self.doubted:
            return now
        G, h = self._shown(now)
        mean, cov, odds = self._each(G, h)
        mean[0], cov[0] = self._intersected(now, G, h)
        share = np.exp(odds - odds.max())
        share /= share.sum()
        likeliest = mean[share.argmax()]
        apart = mean - likeliest
        spread = cov + apart[:, :, None] * apart[:, None, :]
        return Gaussian(likeliest, np.tensordot(share, spread, 1))

    def exchanged(self, now: Gaussian) -> bool:
        """Whether it surely is not what it was."""
        odds = self._each(*self._shown(now))[2]
        return bool(np.logaddexp.reduce(odds[1:]) - odds[0] > SURE)

    def _shown(self, now: Gaussian) -> tuple[Array, Array]:
        """G and h; 0 along directions known less well than at the beginning."""
        value, axes = np.linalg.eigh(now.cov / np.outer(WIDE, WIDE))
        along, gained = axes / WIDE[:, None], value < 1.0
        G = (along * np.where(gained, 1.0 / value - 1.0, 0.0)) @ along.T
        moved = axes.T @ ((now.mean - self.first) / WIDE)
        return G, along @ (np.where(gained, 1.0 / value, 0.0) * moved) + G @ self.first

    def _each(self, G: Array, h: Array) -> tuple[Array, Array, Array]:
        """Means (3, 4), covariances and log odds of the hypotheses; the first: no change."""
        m = np.stack([self.mean, *np.zeros_like(OTHERS)])
        root = np.stack([np.linalg.cholesky(self.cov), *map(np.diag, OTHERS)])  # of S
        across = root.swapaxes(1, 2)
        L = np.linalg.cholesky(np.eye(LOAD) + across @ G @ root)
        lever = np.linalg.solve(L, across)
        news = h - m @ G
        white = (lever @ news[..., None])[..., 0]
        lost = np.log(np.diagonal(L, axis1=1, axis2=2)).sum(axis=1)
        prior = np.array([1.0 - self.change, *[self.change / len(OTHERS)] * len(OTHERS)])
        with np.errstate(divide="ignore"):
            odds = np.log(prior) + 0.5 * ((white**2).sum(axis=1) + m @ h + (m * news).sum(axis=1))
        back = lever.swapaxes(1, 2)
        return m + (back @ white[..., None])[..., 0], back @ lever, odds - lost

    def _intersected(self, now: Gaussian, G: Array, h: Array) -> tuple[Array, Array]:
        """Covariance intersection of the load before and the measurements since: mean, covariance.

        Each is weighted by how well it knows the mass.
        """
        was, known = 1.0 / self.cov[0, 0], 1.0 / now.cov[0, 0]
        share = was / (was + known)
        before = np.linalg.inv(self.cov)
        cov = np.linalg.inv(share * before + (1.0 - share) * G)
        return cov @ (share * before @ self.mean + (1.0 - share) * h), cov


def no_hypotheses() -> PayloadHypotheses:
    """Before anything is learnt anew."""
    nothing = np.zeros(LOAD)
    return PayloadHypotheses(nothing, np.diag(WIDE**2), nothing, np.nan, told=False)
