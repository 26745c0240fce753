"""Criteria of an information matrix, and their gradients.

All are functions of C = Bᵀ M⁻¹ B, the posterior covariance of the directions of interest B:

    D  -log det C                   volume                    [Pukelsheim2006]_
    A  -log (tr C / r)              mean variance
    E  -log lambda_max(C)           the worst direction
    condition  -log (lambda_max / lambda_min)(C)

The largest eigenvalue is taken as (tr C^p)^(1/p), which is smooth where eigenvalues cross.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from urdyn.types import Array

POWER = 12.0  # p: the largest of r equal eigenvalues comes out too large by r^(1/p)

Judged = tuple[float, Array]  # the value, and its gradient in the logarithms of C's eigenvalues


def _volume(x: Array) -> Judged:
    return -float(x.sum()), -np.ones_like(x)


def _mean(x: Array) -> Judged:
    share = np.exp(x - x.max())
    return -float(np.log(share.mean()) + x.max()), -share / share.sum()


def _worst(x: Array) -> Judged:
    share = np.exp(POWER * (x - x.max()))
    return -float(np.log(share.sum()) / POWER + x.max()), -share / share.sum()


def _spread(x: Array) -> Judged:
    (worst, down), (best, up) = _worst(x), _worst(-x)
    return worst + best, down - up


CRITERIA: Mapping[str, Callable[[Array], Judged]] = {
    "D": _volume,
    "A": _mean,
    "E": _worst,
    "condition": _spread,
}


def judge(name: str, M: Array, B: Array) -> tuple[float, Array]:
    """The criterion, larger is better, and S = d criterion / d M, (P, P) symmetric."""
    MB = cho_solve(cho_factor(M), B)
    values, U = np.linalg.eigh(B.T @ MB)
    value, slope = CRITERIA[name](np.log(values))
    # d log lambda = uᵀ dC u / lambda, and dC = -Bᵀ M⁻¹ dM M⁻¹ B.
    V = MB @ U
    return value, -(V * (slope / values)) @ V.T
