"""Pieces too light to show in one moment: many moments show them, by their coming and going.

A piece m is in the gripper or not, moment by moment, as a Markov chain; the chain's likelihood is
computed forward and backward and m is estimated from the moments with it [Rabiner1989]_:

    L(m) = sum over paths of  p(path) prod exp(s_n (d_n' m - m' C_n m / 2)),      s_n in {0, 1}

What is there all the time, or came within the first moment and stays, is no piece, nor are loads
that moments have already separated: their likelihood is subtracted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import expit

from urdyn.diagnose.load.carried import ANYTHING, CHANGED, NOTHING, PRIOR, Mode, Shown
from urdyn.types import Array

RUN = 4  # successive moments from which a guess is made
BEGINS = 2  # first moments: what came within one of them and stays is no piece
ROUNDS = 12  # of the chain and of m, each given the other
LENGTHS = (20.0, 6.0)  # mean moments for which a piece is held, or not


def unseen(
    told: Sequence[Shown], first: Mode, t: float, whose: Sequence[int] = ()
) -> tuple[Mode, float]:
    """The piece that comes and goes, and how much better that explains than a constant load [nats].

    Args:
        told: at least RUN successive moments.
        first: the usual load.
        t: [s] of the last.
        whose: load that each was assigned to, (N,); (): not assigned.
    """
    C = np.array([each.C for each in told])
    d = np.array([each.d for each in told]) - C @ first.mean
    guess = _guess(C, d)
    found = [_coming_and_going(guess, C, d, length) for length in LENGTHS]
    gain, m, cov = max(found, key=lambda one: one[0])
    gain -= np.log(len(LENGTHS))
    always = max(_any_load(C[k:].sum(axis=0), d[k:].sum(axis=0)) for k in range(BEGINS))
    known = max(always, _in_turn(np.array(whose), C, d), 0.0)
    return Mode(first.mean + m, cov + np.diag(NOTHING**2), t), gain - known


def _coming_and_going(held: Array, C: Array, d: Array, length: float) -> tuple[float, Array, Array]:
    """The piece of a chain with mean stays of `length` moments: gain, mean, covariance."""
    for _ in range(ROUNDS):
        m, cov = _piece(held, C, d)
        fits = d @ m - 0.5 * np.einsum("i,nij,j->n", m, C, m)
        held, evidence = _chain(fits, length)
    narrowed = 2.0 * np.sum(np.log(ANYTHING)) - np.linalg.slogdet(cov)[1]
    return float(evidence - 0.5 * (m @ PRIOR @ m + narrowed)), m, cov


def at_most(piece: Mode, told: Sequence[Shown], first: Mode, run: int) -> float:
    """Largest evidence for a piece in at most `run` successive moments [nats].

    Args:
        first: the usual load.
    """
    m = piece.mean - first.mean
    fits = np.array([each.d @ m - m @ each.C @ (first.mean + 0.5 * m) for each in told])
    return max(float(np.convolve(fits, np.ones(n), "valid").max()) for n in range(1, run + 1))


def _piece(held: Array, C: Array, d: Array) -> tuple[Array, Array]:
    """Mean (10,) and covariance of a piece held with these probabilities, (N,)."""
    cov = np.linalg.inv(np.tensordot(held, C, 1) + PRIOR)
    return cov @ (held @ d), np.asarray(cov)


def _any_load(C: Array, d: Array) -> float:
    """Log likelihood ratio of a constant load against none."""
    gain = 0.5 * d @ np.linalg.solve(C + PRIOR, d)
    return float(gain - 0.5 * np.linalg.slogdet(np.eye(len(d)) + np.diag(ANYTHING**2) @ C)[1])


def _in_turn(whose: Array, C: Array, d: Array) -> float:
    """Log likelihood ratio of several loads, one of them in each moment, against none.

    Args:
        whose: which one, (N,); (0,): unknown.
    """
    if not len(whose):
        return -np.inf
    of_each = [whose == k for k in np.unique(whose)]
    gain = sum(_any_load(C[of].sum(axis=0), d[of].sum(axis=0)) for of in of_each)
    return float(gain - CHANGED * np.count_nonzero(np.diff(whose)))


def _guess(C: Array, d: Array) -> Array:
    """The RUN of moments that a load explains best, (N,) 0 or 1."""
    runs = [slice(k, k + RUN) for k in range(len(C) - RUN + 1)]
    best = max(runs, key=lambda run: _any_load(C[run].sum(axis=0), d[run].sum(axis=0)))
    held = np.zeros(len(C))
    held[best] = 1.0
    return held


def _chain(fits: Array, length: float) -> tuple[Array, float]:
    """Probability that the piece is held in each moment, (N,), and log of the chain's likelihood.

    Args:
        fits: log likelihood ratio of each moment with it against without it, (N,) [nats].
    """
    ahead, back = np.zeros(len(fits)), np.zeros(len(fits))  # log odds that it is held
    scale = 0.0  # log of the chain's likelihood up to here
    for n, fit in enumerate(fits):
        before = _switched(ahead[n - 1], length) if n else 0.0
        ahead[n] = before + fit
        scale += np.logaddexp(0.0, before + fit) - np.logaddexp(0.0, before)
    for n in range(len(fits) - 1, 0, -1):
        back[n - 1] = _switched(back[n] + fits[n], length)
    return expit(ahead + back), float(scale)


def _switched(odds: float, length: float) -> float:
    """Log odds a moment later, or earlier."""
    stays = np.log(length - 1.0)
    return float(np.logaddexp(odds + stays, 0.0) - np.logaddexp(odds, stays))
