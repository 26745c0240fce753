"""A Gaussian kept as a square root of its covariance: it cannot lose positive definiteness.

P = root rootᵀ,    x = mean + root xi with xi ~ N(0, 1)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.types import Array, Gaussian, freeze

# Rounding of a sum of n products, relative to the diagonal, by which a factorisation may fail.
JITTER = 1e-15
SINGULAR = 1e-13  # of its variance: rounding leaves this of a state that the others determine


@dataclass(frozen=True, eq=False)
class SquareRoot:
    """A belief with P = root rootᵀ; the root need not be triangular."""

    mean: Array  # (n,)
    root: Array  # (n, n)

    def __post_init__(self) -> None:
        freeze(self, "mean", "root")

    @classmethod
    def of(cls, mean: Array, cov: Array) -> SquareRoot:
        """From a covariance that may be singular by rounding, or have zeros on its diagonal."""
        return cls(mean, lower_root(cov))

    @property
    def gaussian(self) -> Gaussian:
        """Mean and covariance."""
        return Gaussian(self.mean, self.root @ self.root.T)

    @cached_property
    def sd(self) -> Array:
        """Standard deviations, (n,)."""
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", self.root, self.root)))

    def at(self, unit: Array) -> Array:
        """Points at standard scores `unit`, (k, n) -> (k, n)."""
        return np.asarray(self.mean + unit @ self.root.T)


def lower_root(cov: Array) -> Array:
    """Cholesky factor; where rounding prevents one, a root with eigenvalues raised to rounding."""
    try:
        return np.asarray(np.linalg.cholesky(cov))
    except np.linalg.LinAlgError:
        return _lifted_root(cov)


def _lifted_root(cov: Array) -> Array:
    sd = np.sqrt(cov.diagonal())
    scale = np.where(sd > 0.0, sd, 1.0)
    correlation = cov / np.outer(scale, scale)
    value, vector = np.linalg.eigh(0.5 * (correlation + correlation.T))
    lifted = np.maximum(value, JITTER * len(cov) * value[-1])
    return np.where(sd[:, None] > 0.0, scale[:, None] * vector * np.sqrt(lifted), 0.0)


def inverse(cov: Array) -> Array:
    """Inverse of a covariance; LinAlgError where it is singular within rounding."""
    root = np.linalg.cholesky(cov)
    if (root.diagonal() ** 2 < SINGULAR * cov.diagonal()).any():
        raise np.linalg.LinAlgError("singular but for rounding")
    white = np.linalg.inv(root)
    return np.asarray(white.T @ white)


def pseudo_inverse(cov: Array) -> Array:
    """Pseudo-inverse of covariances (..., a, a) of any scales; zero for what has no variance."""
    sd = np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1))
    scale = np.divide(1.0, sd, out=np.zeros_like(sd), where=sd > 0.0)
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(both * np.linalg.pinv(cov * both, SINGULAR, hermitian=True))
