"""Inertial parameters that a solid body can have, and coordinates in which there are no others.

Inertials are in Pinocchio's order m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz [kg, kg m, kg m²],
about the origin of the link's frame. A density exists that has them if and only if the
pseudo-inertia is positive definite [Wensing2018]_:

    J = [[Sigma, h], [hᵀ, m]],    Sigma = tr(I)/2 1 - I = ∫ r rᵀ dm,    h = ∫ r dm = m c

The log-Cholesky coordinates x = (alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3) [Rucker2022]_ are
J = U Uᵀ with

                  [[e^d1, s12,  s13,  t1],
    U = e^alpha *  [0,    e^d2, s23,  t2],
                   [0,    0,    e^d3, t3],
                   [0,    0,    0,    1 ]]

Every x in R^10 is a body and every body is one x. They are physical: m = e^(2 alpha), (t1, t2, t3)
is exactly the centre of mass c [m], and d and s are the factor of the second moment per unit of
mass about c, so a Gaussian in x is a natural prior: relative in mass, in metres for the centre.

All functions broadcast over leading axes.
"""

from __future__ import annotations

import numpy as np

from urdyn.errors import ArmError
from urdyn.model.body import ORDER
from urdyn.types import Array, Mask

# Where Sigma's six numbers stand in J, in the order of I's in the inertials.
ROWS, COLUMNS = ORDER
TRACE = np.outer(ROWS == COLUMNS, ROWS == COLUMNS)  # @: the trace of six numbers, on the diagonal
SIGMA_OF_I = 0.5 * TRACE - np.eye(6)
I_OF_SIGMA = 1.0 * TRACE - np.eye(6)

# Where x stands in U: d on the diagonal, then s12, s23, s13, t1, t2, t3.
ABOVE = (np.array([0, 1, 0, 0, 1, 2]), np.array([1, 2, 2, 3, 3, 3]))


def pseudo_inertia(inertials: Array) -> Array:
    """J of inertials (..., 10): symmetric (..., 4, 4)."""
    J = np.empty((*inertials.shape[:-1], 4, 4))
    J[..., 3, 3] = inertials[..., 0]
    J[..., :3, 3] = J[..., 3, :3] = inertials[..., 1:4]
    J[..., ROWS, COLUMNS] = J[..., COLUMNS, ROWS] = inertials[..., 4:] @ SIGMA_OF_I
    return J


def from_pseudo_inertia(J: Array) -> Array:
    """Inertials (..., 10) of a symmetric J (..., 4, 4); linear, the inverse of `pseudo_inertia`."""
    inertia = J[..., ROWS, COLUMNS] @ I_OF_SIGMA
    return np.concatenate([J[..., 3, 3, None], J[..., :3, 3], inertia], axis=-1)


def is_consistent(inertials: Array, margin: float = 0.0) -> Mask:
    """Whether a solid body has these inertials (..., 10): bool (...).

    Its mass is positive and, about the centre of mass, the second moment per unit of mass along
    every direction exceeds `margin` [m²]: no frame changes the verdict.
    """
    finite = np.isfinite(inertials).all(axis=-1) & (inertials[..., 0] > 0.0)
    J = pseudo_inertia(np.where(finite[..., None], inertials, 1.0))
    J = J / J[..., 3:, 3:]
    c = J[..., :3, 3]
    spread = J[..., :3, :3] - c[..., :, None] * c[..., None, :]
    return finite & (np.linalg.eigvalsh(spread)[..., 0] > margin)


def log_cholesky(inertials: Array) -> Array:
    """Coordinates x (..., 10) of consistent inertials (..., 10)."""
    # J = U Uᵀ with U upper triangular is the Cholesky factor of J with its axes reversed.
    reverse = np.s_[..., ::-1, ::-1]
    try:
        U = np.linalg.cholesky(pseudo_inertia(inertials)[reverse])[reverse]
    except np.linalg.LinAlgError:
        bad = np.argwhere(~is_consistent(inertials)).tolist()
        raise ArmError(f"no solid body has the inertials at index {bad}") from None
    scale = U[..., 3, 3, None]
    d = np.log(np.diagonal(U, axis1=-2, axis2=-1)[..., :3] / scale)
    return np.concatenate([np.log(scale), d, U[(..., *ABOVE)] / scale], axis=-1)


def inertials(x: Array) -> Array:
    """Inertials (..., 10) of log-Cholesky coordinates x (..., 10): a solid body for every x."""
    U = _factor(x)
    return from_pseudo_inertia(U @ np.swapaxes(U, -1, -2))


def log_cholesky_jacobian(x: Array) -> Array:
    """d inertials / d x, (..., 10, 10): row an inertial, column a coordinate.

    dJ = dU Uᵀ + U dUᵀ, and dU/dx has U itself for alpha, one entry for every other coordinate.
    """
    U = _factor(x)
    dU = np.zeros((*x.shape[:-1], 10, 4, 4))
    dU[..., 0, :, :] = U
    for i in range(3):
        dU[..., 1 + i, i, i] = U[..., i, i]
    for k, (row, column) in enumerate(zip(*ABOVE, strict=True)):
        dU[..., 4 + k, row, column] = U[..., 3, 3]
    half = dU @ np.swapaxes(U, -1, -2)[..., None, :, :]
    return np.swapaxes(from_pseudo_inertia(half + np.swapaxes(half, -1, -2)), -1, -2)


def _factor(x: Array) -> Array:
    """U of x (..., 10): upper triangular (..., 4, 4)."""
    U = np.zeros((*x.shape[:-1], 4, 4))
    U[..., range(3), range(3)] = np.exp(x[..., 1:4])
    U[(..., *ABOVE)] = x[..., 4:]
    U[..., 3, 3] = 1.0
    return np.exp(x[..., 0, None, None]) * U
