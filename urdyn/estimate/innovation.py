"""Innovation: how far a measurement lies from its prediction, and how far it might."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, log

import numpy as np

from urdyn.errors import InputError
from urdyn.types import Array, Index

LOG_2PI = float(np.log(2.0 * np.pi))
Rows = slice | Index  # which rows of an observation were measured


@dataclass(frozen=True, eq=False)
class Innovation:
    """What one measurement adds to the model's prediction."""

    residual: Array  # (m,) measured minus expected; NaN where not measured
    cov: Array  # (m, m) S, its expected covariance; NaN where not measured
    log_likelihood: float  # of the measured rows given all earlier ones
    nis: float  # normalised innovation squared, chi-square with `measured` degrees of freedom
    measured: int  # number of measured rows


def measured_rows(y: Array) -> Rows:
    """The finite rows of y; as a slice where all are, so that taking them copies nothing."""
    finite = np.isfinite(y)
    return slice(None) if np.count_nonzero(finite) == len(y) else np.flatnonzero(finite)


def residual_of(y: Array, rows: Rows, expected: Array) -> Array:
    """Measured minus expected values of the measured rows, (..., r)."""
    measured = y[rows]
    if measured.shape != expected.shape[-1:]:
        raise InputError(
            f"y has the shape {y.shape}; what is expected of its {len(measured)} measured rows has "
            f"{expected.shape[-1:]}"
        )
    return np.asarray(measured - expected)


def require_finite(told: float, *belief: Array) -> None:
    """InputError where a belief is not finite; checked only if `told`, a likelihood say, is not."""
    if not isfinite(told) and not all(np.isfinite(part).all() for part in belief):
        raise InputError(
            "the belief is no longer finite: the model's functions give NaN or infinity where it "
            "stands, and a reading may have led it there; mark such a reading NaN"
        )


def factor_of(S: Array) -> Array:
    """Cholesky factors of measurements' covariances, (..., m, m); InputError without one."""
    try:
        return np.asarray(np.linalg.cholesky(S))
    except np.linalg.LinAlgError:
        raise InputError(
            "the covariance expected of a measurement is not positive definite; "
            "let R say that every sensor has noise"
        ) from None


def whitening(S: Array) -> tuple[Array, float]:
    """W with W S Wᵀ = 1, (m, m), and log |S|."""
    factor = factor_of(S)
    log_det = 2.0 * sum(map(log, factor.diagonal().tolist()))
    return np.asarray(np.linalg.inv(factor)), log_det


def innovation(
    y: Array, rows: Rows, residual: Array, S: Array, W: Array, log_det: float
) -> Innovation:
    """Innovation of all rows of y from the measured rows' `residual` and S, which W whitens."""
    white = W @ residual
    nis = float(white @ white)
    log_likelihood = -0.5 * (nis + log_det + len(residual) * LOG_2PI)
    if not isinstance(rows, slice):
        residual, S = _scatter(rows, residual, S, len(y))
    return Innovation(residual, S, log_likelihood, nis, len(white))


def nothing_measured(m: int) -> Innovation:
    """Innovation of m rows, none of them measured."""
    return Innovation(np.full(m, np.nan), np.full((m, m), np.nan), 0.0, 0.0, 0)


def _scatter(rows: Index, residual: Array, S: Array, m: int) -> tuple[Array, Array]:
    """Measured rows at their places among all m, NaN elsewhere."""
    all_residual, all_S = np.full(m, np.nan), np.full((m, m), np.nan)
    all_residual[rows] = residual
    all_S[rows[:, None], rows] = S
    return all_residual, all_S
