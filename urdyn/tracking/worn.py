"""Drives that wore before a run began, and not as a healthy arm's do from day to day.

A prior that allowed for both would tell nothing of the first seconds. So it is that of a healthy
arm, N(x0, P0), and what was learnt since, N(x, P), is asked how much better one explains it that
allows for what breaks, P0 + W. By the information on the drive that measurements alone hold, G, and
the slope of their likelihood, u, both of which the belief tells,

    log B = u' (W^-1 + G)^-1 u / 2 - log |I + W G| / 2,    u = P0^-1 (x - x0),
                                                           G = P0^-1 (P0 - P) P0^-1,

the ratio of the marginal likelihoods [Dickey1971]_, with all other states integrated out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from urdyn.tracking.model import JOLTS
from urdyn.types import Array, Gaussian, Index, Mask

ASKED = 60.0  # [s] of its motion in which a drive is: then its own drift counts
ASK = 0.5  # [s] from one time to the next
# [-] log odds. A healthy UR10e in 98 pairs of a twin and a run: 22 at most, and its base 30; half
# as much friction again, or a fifth less health, put into its currents: 23 to 119.
SURE = 20.0


@dataclass(frozen=True, eq=False)
class Worn:
    """What is asked of a belief."""

    mean: Array  # (n,) x0
    information: Array  # (n, n) P0^-1
    at: Index  # (J, g) states of each drive
    sd: Array  # (g,) W's roots

    @classmethod
    def of(cls, prior: Gaussian, places: Mapping[str, slice]) -> Worn:
        """Of drives whose groups have these places in the prior's states."""
        at = np.array([np.arange(places[g].start, places[g].stop) for g in JOLTS]).T
        information: Array = np.asarray(np.linalg.inv(prior.cov), dtype=np.float64)
        return cls(prior.mean, information, at, np.array([*JOLTS.values()]))

    def log_odds(self, belief: Gaussian) -> Array:
        """Of wear beside none, drive by drive, (J,)."""
        J, g = self.at.shape
        rows = self.information[self.at.ravel()]
        u = (rows @ (belief.mean - self.mean)).reshape(J, g) * self.sd
        gained = (rows[:, self.at.ravel()] - rows @ belief.cov @ rows.T).reshape(J, g, J, g)
        own = gained[np.arange(J), :, np.arange(J)] * np.outer(self.sd, self.sd)
        value, vector = np.linalg.eigh(np.eye(g) + 0.5 * (own + own.swapaxes(1, 2)))
        along = (vector.swapaxes(1, 2) @ u[..., None])[..., 0]
        # Along what drifted since, and is known less well than at first, nothing was measured.
        told = np.maximum(value, 1.0)
        terms = (along**2 / told - np.log(told)) * (value > 1.0)
        return np.asarray(0.5 * terms.sum(axis=1))

    def found(self, belief: Gaussian, asked: Mask) -> Mask:
        """The drive that surely wore, of those asked (J,); others may, once it is known, (J,)."""
        odds = np.where(asked, self.log_odds(belief), -np.inf)
        return np.asarray((odds > SURE) & (odds == odds.max()))
