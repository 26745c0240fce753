"""Kalman's two halves on a model linearised at the belief's mean.

    x⁻ = f(x),  P⁻ = F P Fᵀ + Q
    S = H P⁻ Hᵀ + R = V Vᵀ,  B = V⁻¹ H P⁻,  K = Bᵀ V⁻¹,  x = x⁻ + K r,  P = P⁻ - Bᵀ B

The filter computes H, by derivatives or by sigma points; the rest is common to all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U, linearised, predicted
from urdyn.errors import InputError
from urdyn.estimate.innovation import (
    Innovation,
    Rows,
    innovation,
    measured_rows,
    require_finite,
    residual_of,
    whitening,
)
from urdyn.types import Array, Gaussian, Mask

LOST = 1e-14  # of a variance: if less is left, hardly a digit of it is right


@dataclass(frozen=True, eq=False)
class Expected:
    """Prediction of r rows from a belief about n states."""

    y: Array  # (r,)
    cross: Array  # (r, n) H P, covariance with the states
    own: Array  # (r, r) H P Hᵀ
    noise: Array  # (r, r) R, and the covariance of what is not linear

    def of(self, rows: Rows) -> Expected:
        """The same of these rows alone."""
        if isinstance(rows, slice):
            return self
        both = rows[:, None], rows
        return Expected(self.y[rows], self.cross[rows], self.own[both], self.noise[both])


def predict(model: TwoSlice[U], state: Gaussian, u: U) -> Gaussian:
    """The belief about the next slice before its measurement."""
    if model.still:
        return state
    if not model.affine_transition:
        F = model.transition_jacobian(state.mean, u)
        cov = propagated(F, state.cov) + model.transition_cov(u)
        return Gaussian(model.transition(state.mean, u), cov)
    if (shortly := predicted(model, state, u)) is not None:
        return shortly
    # An affine transition maps a covariance as it maps points: first its rows, then its columns.
    points = np.concatenate([state.mean[None], np.zeros_like(state.mean[None]), state.cov])
    moved = model.transition(points, u)
    mean, origin, rows = moved[0], moved[1], moved[2:]
    linear = not np.count_nonzero(origin)
    rows = rows if linear else rows - origin
    cov = model.transition(np.ascontiguousarray(rows.T), u)
    cov += model.transition_cov(u)
    cov = cov if linear else cov - origin
    return Gaussian(mean, 0.5 * (cov + cov.T))


def propagated(F: Array, P: Array) -> Array:
    """F P Fᵀ, (n, n); O(n²), not O(n³), where most states depend on themselves alone."""
    own = F.diagonal()
    few = np.flatnonzero(np.count_nonzero(F, axis=1) > (own != 0.0))
    if 2 * len(few) > len(F):
        moved = F @ P @ F.T
        return 0.5 * (moved + moved.T)
    other = F[few]
    other[np.arange(len(few)), few] = 0.0
    FP = own[:, None] * P
    FP[few] += other @ P
    moved = FP * own
    moved[:, few] += FP @ other.T
    return 0.5 * (moved + moved.T)


def correct(
    model: TwoSlice[U],
    predicted: Gaussian,
    u: U,
    y: Array,
    at: Array | None = None,
    moved: Mask | None = None,
) -> tuple[Gaussian, Innovation]:
    """The belief after the slice's measurement.

    The observation is linearised at `at`, (n,), by default where it was predicted; only the states
    in `moved`, (n,), by default all, take a new mean.
    """
    rows, x = measured_rows(y), predicted.mean
    at = x if at is None else at
    seen, H, R = linear_rows(model, at, u, rows)
    cross = H @ predicted.cov
    seen = seen if at is x else seen + H @ (x - at)
    return updated(predicted, Expected(seen, cross, cross @ H.T, R), y, rows, moved)


def updated(
    predicted: Gaussian, expected: Expected, y: Array, rows: Rows, moved: Mask | None = None
) -> tuple[Gaussian, Innovation]:
    """The belief after `rows` of y, (m,), were measured, given their prediction.

    States not in `moved` are considered [Schmidt1966]_: an update changes neither their means nor
    their covariance.
    """
    S = expected.own + expected.noise
    W, log_det = whitening(S)
    residual = residual_of(y, rows, expected.y)
    B = W @ expected.cross
    gain = W.T @ B
    step, known = residual @ gain, B.T @ B
    if moved is not None:
        held = np.where(moved, 0.0, B)
        step, known = np.where(moved, step, 0.0), known - held.T @ held
    cov = lessened(predicted.cov, known, gain, expected.noise)
    posterior = Gaussian(predicted.mean + step, cov)
    told = innovation(y, rows, residual, S, W, log_det)
    require_finite(told.log_likelihood, posterior.mean, cov)
    return posterior, told


def lessened(P: Array, known: Array, gain: Array, R: Array) -> Array:
    """P minus what is now `known`, overwriting it, (n, n), by a gain Kᵀ, (r, n).

    Raises:
        InputError: noisy readings left less of a variance than its digits resolve.
    """
    cov, least = np.subtract(P, known, out=known), LOST * P.diagonal()
    gone = cov.diagonal() < least
    if np.count_nonzero(gone):
        noise = np.einsum("rn,rs,sn->n", gain, R, gain)
        if (noise[gone] > LOST * least[gone]).any():
            raise InputError(
                f"readings left less than {LOST:g} of a variance, and its digits are lost; "
                "take a prior that is less vague, or InformationFilter"
            )
        without_negatives(cov)
    return cov


def without_negatives(cov: Array) -> Array:
    """`cov` itself, (n, n), mended: rounding makes variances of known states negative."""
    variance = cov.reshape(-1)[:: len(cov) + 1]
    np.maximum(variance, 0.0, out=variance)
    return cov


def linear_rows(model: TwoSlice[U], x: Array, u: U, rows: Rows) -> tuple[Array, Array, Array]:
    """Prediction of the measured rows, their H and R: (r,), (r, n), (r, r)."""
    seen, H = linearised(model, x, u)
    R = noise_of(model, u, seen)
    if H.shape != seen.shape + x.shape:
        raise InputError(f"H has the shape {H.shape}; here it has to be {seen.shape + x.shape}")
    return seen[rows], H[rows], R[rows][:, rows]


def noise_of(model: TwoSlice[U], u: U, expected: Array) -> Array:
    """R, (m, m), of the predicted readings, (..., m)."""
    R, shape = model.observe_cov(u), expected.shape[-1:] * 2
    if R.shape != shape:
        raise InputError(f"R has the shape {R.shape}; of the readings expected it is {shape}")
    return R


def joseph(P: Array, K: Array, H: Array, HP: Array, R: Array) -> Array:
    """Covariance after a gain K, optimal or not, (..., n, n): Joseph's form [Bucy1968]_.

    (1 - K H) P (1 - K H)ᵀ + K R Kᵀ, associated so that it costs n² m, not n³.
    """
    A = P - K @ HP
    A -= (A @ np.swapaxes(H, -1, -2) - K @ R) @ np.swapaxes(K, -1, -2)
    return 0.5 * (A + np.swapaxes(A, -1, -2))
