"""Evidence that windows about reversals have something in common, each a little early or late.

Of windows y = d + e, e ~ N(0, C), the mean d is N(0, recurs² C) of a sound joint, and N(0, C / k)
of one with play, k in RECURS. C has an inverse Wishart distribution, which leaves of each a closed
form [Murphy2007]_.

When a model has a load turn over is off as that model is. The ratio of windows that may be early or
late is a mean over all their places, and so no less than at one of them times its probability: that
is taken, with each window where it is most like the later ones.
"""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp

from urdyn.types import Array

FEWEST = 3  # windows that recur
RECURS = (1.0, 0.1)  # windows that what is known of play counts for
LATE = np.array([0.0, -0.02, 0.02])  # [s] after its reversal that a window may be
LIKELY = np.array([0.5, 0.25, 0.25])  # that it is


def aligned(y: Array, cov: Array) -> tuple[Array, Array]:
    """Windows where they are most like the later ones, the last one in time.

    Args:
        y: as late as LATE, (n, LATE, p) [A]; NaN: there is none.
        cov: C (p, p) [A²].

    Returns:
        Windows, (n, p), and log probabilities that the last 1, 2, ... are where they are, (n,).
    """
    chance = np.where(np.isfinite(y[:, :, 0]), LIKELY, 0.0)
    with np.errstate(divide="ignore"):
        chance = np.log(chance / chance.sum(axis=1, keepdims=True))
    inverse, y = np.linalg.pinv(cov), np.nan_to_num(y)
    chosen, told = y[:, 0].copy(), np.zeros(len(y))
    mean = chosen[-1]
    for n, k in enumerate(range(len(y) - 2, -1, -1), start=1):
        off, doubt = y[k] - mean, (n + 1.0) / n  # of the mean of n windows, and of one more
        like = chance[k] - 0.5 * np.einsum("lp,pq,lq->l", off, inverse, off) / doubt
        best = int(np.argmax(like))
        chosen[k], told[n] = y[k, best], told[n - 1] + chance[k, best]
        mean = mean + (chosen[k] - mean) / (n + 1.0)
    return chosen, told


def ratios(y: Array, Psi: Array, dof: float, sound: float) -> Array:
    """Log of the likelihood ratios of the last FEWEST, FEWEST + 1, ... windows y (n, p) [nats].

    Args:
        Psi: scale of the inverse Wishart distribution of C, (p, p).
        dof: its degrees of freedom.
        sound: k of a sound joint.
    """
    n, p = np.arange(1.0, len(y) + 1.0)[:, None, None], y.shape[1]
    latest = y[::-1]
    mean = np.cumsum(latest, axis=0)[:, :, None] / n
    square = mean * np.swapaxes(mean, 1, 2)
    scatter = np.cumsum(latest[:, :, None] * latest[:, None, :], axis=0) - n * square

    def marginal(k: float) -> Array:
        """Log of what the windows' likelihood is, but for what all k share."""
        inner = Psi + scatter + (k * n / (k + n)) * square
        shrunk = 0.5 * p * np.log(k / (k + n[:, 0, 0]))
        return np.asarray(shrunk - 0.5 * (dof + n[:, 0, 0]) * np.linalg.slogdet(inner)[1])

    recurs = logsumexp([marginal(k) for k in RECURS], axis=0) - np.log(len(RECURS))
    return np.asarray((recurs - marginal(sound))[FEWEST - 1 :])
