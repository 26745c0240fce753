"""Gaussian posterior of all unknowns from their moments, and the noise that it implies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from urdyn.errors import IdentifiabilityError
from urdyn.identify.kinematics.moments import Moments
from urdyn.types import Array, Index

QUIET = np.array([1e-8, 1e-8])  # [m, rad] no instrument is better


@dataclass(frozen=True, eq=False)
class Posterior:
    """x ~ N(mean, cov), and the noise learnt with it."""

    mean: Array  # (P,) step from where the moments were taken
    cov: Array  # (P, P)
    noise: Array  # (2,) standard deviation of a coordinate of place [m] and of turn [rad]


def posterior(moments: Moments, precision: Array, offset: Array, noise: Array) -> Posterior:
    """The posterior for known noise.

    Args:
        precision: of the prior, (P,); zero for a flat one.
        offset: from where the moments were taken to the prior's mean, (P,).
        noise: standard deviations of place [m] and turn [rad].
    """
    H = np.tensordot(noise**-2.0, moments.H, axes=1) + np.diag(precision)
    b = noise**-2.0 @ moments.b + precision * offset
    scale = 1.0 / np.sqrt(np.diag(H))
    cov = _inverse(scale[:, None] * H * scale) * scale[:, None] * scale
    return Posterior(cov @ b, cov, noise)


def _inverse(H: Array) -> Array:
    """Inverse of a positive definite matrix: by Cholesky, in half the time."""
    if not H.size:  # LAPACK would complain on standard output
        return H
    root, failed = lapack.dpotrf(H)
    if failed:
        raise IdentifiabilityError(
            "the poses do not tell base, tool and geometry apart: they are too few or too much "
            "alike; `urdyn calibrate --suggest 30` names some that do"
        )
    upper = np.triu(lapack.dpotri(root)[0])
    return np.asarray(upper + np.triu(upper, 1).T)


def renoised(moments: Moments, found: Posterior) -> Array:
    """Noise from the residuals, corrected for what the unknowns absorbed (EM), (2,)."""
    taken = np.einsum("kij,ij->k", moments.H, found.cov)
    squares = moments.squares(found.mean) + taken
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = np.sqrt(squares / moments.count)
    return np.asarray(np.maximum(np.where(moments.count > 0.0, noise, 1.0), QUIET))


def learned(
    moments: Moments, precision: Array, offset: Array, noise: Array, rounds: int = 4
) -> Posterior:
    """The posterior with the noise that maximises its likelihood."""
    found = posterior(moments, precision, offset, noise)
    for _ in range(rounds):
        found = posterior(moments, precision, offset, renoised(moments, found))
    return found


def restricted(found: Posterior, columns: Index, size: int) -> Posterior:
    """`found` for some columns, extended to all `size`, with the others zero and known."""
    mean, cov = np.zeros(size), np.zeros((size, size))
    mean[columns] = found.mean
    cov[np.ix_(columns, columns)] = found.cov
    return Posterior(mean, cov, found.noise)
