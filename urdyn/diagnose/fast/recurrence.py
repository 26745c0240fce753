"""Evidence that windows about reversals have a common mean, each slightly early or late.

Of windows y = d + e, e ~ N(0, C), the mean d is N(0, recurs² C) for a sound joint, and N(0, C / k)
for one with play, k in RECURS. C has an inverse Wishart distribution, which gives each marginal
likelihood a closed form [Murphy2007]_.

A model's errors shift the time at which its load reverses. The ratio of windows that may be early
or late is a mean over all their places, and so at least that at one place times its probability:
this bound is used, with each window where it is most like the later ones.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

FEWEST = 3  # windows that recur
RECURS = (1.0, 0.1)  # windows that the prior on play counts as
LATE = np.array([0.0, -0.02, 0.02])  # [s] after its reversal: possible places of a window
LIKELY = np.array([0.5, 0.25, 0.25])  # their probabilities


def aligned(y: Array, cov: Array) -> tuple[Array, Array]:
    """Windows placed where they are most like the later ones; the last is on time.

    Args:
        y: at each place of LATE, (n, LATE, p) [A]; NaN: there is none.
        cov: C (p, p) [A²].

    Returns:
        Windows, (n, p), and log probabilities of the places of the last 1, 2, ..., (n,).
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
    """Log likelihood ratios of the last FEWEST, FEWEST + 1, ... windows y (n, p) [nats].

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
        """Log of the windows' marginal likelihood, up to a constant."""
        inner = Psi + scatter + (k * n / (k + n)) * square
        shrunk = 0.5 * p * np.log(k / (k + n[:, 0, 0]))
        return np.asarray(shrunk - 0.5 * (dof + n[:, 0, 0]) * np.linalg.slogdet(inner)[1])

    recurs = np.logaddexp.reduce([marginal(k) for k in RECURS]) - np.log(len(RECURS))
    return np.asarray((recurs - marginal(sound))[FEWEST - 1 :])
