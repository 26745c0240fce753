"""Whether the tool carried another load from some row of a log on.

A fit assumes one load throughout, and spreads a piece that came half-way over the whole log: too
much weight before, too little after. So its residuals are mainly the gravity torque of one load up
to that row and of another from there on, w = m, mx, my, mz each:

    share = (g(0, k) + g(k, N)) / |r|²,    g = b' A^-1 b,    A = sum Y' Y,    b = sum Y' r

over residuals r and columns Y in units of the noise, of joints that move.
"""

from __future__ import annotations

import numpy as np

from urdyn.identify.fit import Fit
from urdyn.identify.scoring import Score
from urdyn.types import Array

PARTS = 40  # of a log, at whose beginnings a load may come
MOST = 4000  # rows used, about
TOLD = 1e-9  # [-] of a load's best-known direction, below which one is unknown


def another_load(fit: Fit, score: Score) -> tuple[float, float]:
    """Share of a fit's residuals in a log that another load explains [-], and since when [s]."""
    log, rows = score.log, slice(None, None, max(len(score.log) // MOST, 1))
    t, moves, q = log.t[rows], score.moves[rows], np.nan_to_num(log.joint("actual_q")[rows])
    left = log.joint("actual_current")[rows] - score.predicted[rows]
    r = np.where(moves, left, 0.0) / fit.noise.sd
    still = np.zeros_like(q)
    weighs = fit.dynamics.arm.regressor(q, still, still)[..., -10:-6]  # (N, J, 4) [N·m]
    Y = weighs * (moves / (fit.dynamics.drive.gain * fit.noise.sd))[..., None]
    begin = np.linspace(0, len(t), PARTS, endpoint=False).astype(int)
    A = np.cumsum(np.add.reduceat(np.einsum("njp,njq->npq", Y, Y), begin), axis=0)
    b = np.cumsum(np.add.reduceat(np.einsum("njp,nj->np", Y, r), begin), axis=0)
    before = np.array([_explained(*of) for of in zip(A[:-1], b[:-1], strict=True)])
    after = [_explained(*of) for of in zip(A[-1] - A[:-1], b[-1] - b[:-1], strict=True)]
    k = int(np.argmax(before + after))
    share = (before + after)[k] / max(np.sum(r**2), np.finfo(float).tiny)
    return float(share), float(t[begin[k + 1]])


def _explained(A: Array, b: Array) -> float:
    """g, by the minimum-norm least-squares load where a motion does not show all of it."""
    return float(b @ np.linalg.lstsq(A, b, rcond=TOLD)[0])
