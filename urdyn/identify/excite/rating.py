"""Rating of excitations: a motion's information on the base parameters, without any prior.

    M_b = sum_j rows mean(Phi_jᵀ Phi_j) / (K_j sigma_j)²,    tau = Phi beta

beta are the base inertials [Gautier1991]_ with every joint's rotor inertia, Coulomb and viscous
friction and offset, as far as they are identifiable separately, in SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from urdyn.identify.excite.columns import TERMS, columns
from urdyn.identify.excite.question import Question, level
from urdyn.identify.rank import CORE, TOLERANCE
from urdyn.model.moments import generic_moments
from urdyn.types import Array, Index


@dataclass(frozen=True)
class Rating:
    """A motion's rating; infinitely bad where it does not identify all of them."""

    log_det: float  # of M_b; larger is better
    condition: float  # of the weighted regressor, the root of M_b's; smaller is better


@dataclass(frozen=True, eq=False)
class Scale:
    """The scale on which an arm's motions are rated."""

    question: Question
    independent: Index  # linearly independent columns of a joint-by-joint regressor

    def rate(self, q: Array, v: Array, a: Array, rows: float) -> Rating:
        """Rating of a motion sampled at N moments (N, J), logged in `rows` rows."""
        W = _regressor(self.question, q, v, a)[:, self.independent]
        singular = np.linalg.svd(W * np.sqrt(rows / len(q)), compute_uv=False)
        if singular[-1] <= TOLERANCE * singular[0]:
            return Rating(-np.inf, np.inf)
        return Rating(2.0 * float(np.log(singular).sum()), float(singular[0] / singular[-1]))


def scale(question: Question) -> Scale:
    """The scale for motions that are to answer a question."""
    W = _regressor(question, *generic_moments(question.point.arm))
    norms = np.linalg.norm(W, axis=0)
    nonzero = np.flatnonzero(norms > TOLERANCE * norms.max())
    R, pivots = qr(W[:, nonzero] / norms[nonzero], mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    return Scale(question, np.sort(nonzero[pivots[: int((size > TOLERANCE * size[0]).sum())]]))


def _regressor(question: Question, q: Array, v: Array, a: Array) -> Array:
    """[Y, core terms] of all joints, in units of each joint's noise, (N J, 10 J + 4 J)."""
    found, drive = columns(question.point, q, v, a), question.point.drive
    rigid, J = found.phi.shape[2] - len(TERMS), q.shape[1]
    noise = level(question.noise) * drive.gain
    Y = found.phi[:, :, :rigid]
    terms = np.zeros((len(q), J, len(CORE), J))
    for n, name in enumerate(CORE):
        terms[:, range(J), n, range(J)] = found.phi[:, :, rigid + TERMS.index(name)]
    W = np.concatenate([Y, terms.reshape(len(q), J, -1)], axis=2) / noise[:, None]
    return np.asarray(W.reshape(len(q) * J, -1))
