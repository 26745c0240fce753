"""Kalman's two halves on a model linearised where the belief stands.

    x⁻ = f(x),  P⁻ = F P Fᵀ + Q
    S = H P⁻ Hᵀ + R,  K = P⁻ Hᵀ S⁻¹,  x = x⁻ + K r,  P = (1 - K H) P⁻ (1 - K H)ᵀ + K R Kᵀ

The last is Joseph's form [Bucy1968]_, which is a covariance for any gain K; here it is associated
so that it costs n² m and not n³.
"""

from __future__ import annotations

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U, linearised
from urdyn.estimate.innovation import Innovation, Rows, innovation, measured_rows, whitening
from urdyn.types import Array, Gaussian, Mask


def predict(model: TwoSlice[U], state: Gaussian, u: U) -> Gaussian:
    """The belief about the next slice before it is measured."""
    if model.still:
        return state
    F = model.transition_jacobian(state.mean, u)
    cov = carried(F, state.cov) + model.transition_cov(u)
    return Gaussian(model.transition(state.mean, u), cov)


def carried(F: Array, P: Array) -> Array:
    """F P Fᵀ, (n, n); n² and not n³ where every state moves by itself alone."""
    own = F.diagonal()
    if np.count_nonzero(F) == np.count_nonzero(own):
        return np.asarray(own[:, None] * P * own)
    return F @ P @ F.T


def correct(
    model: TwoSlice[U],
    predicted: Gaussian,
    u: U,
    y: Array,
    at: Array | None = None,
    moved: Mask | None = None,
) -> tuple[Gaussian, Innovation]:
    """The belief after the slice is measured.

    The observation is linearised at `at`, (n,), by default where it was predicted; only the states
    in `moved`, (n,), by default all, take a new mean.
    """
    rows, x = measured_rows(y), predicted.mean
    at = x if at is None else at
    seen, H, R = linear_rows(model, at, u, rows)
    residual = y[rows] - seen - (0.0 if at is x else H @ (x - at))
    HP = H @ predicted.cov
    S = HP @ H.T + R
    W, log_det = whitening(S)
    K = HP.T @ (W.T @ W)
    if moved is not None:
        K = np.where(moved[:, None], K, 0.0)
    posterior = Gaussian(x + K @ residual, joseph(predicted.cov, K, H, HP, R))
    return posterior, innovation(y, rows, residual, S, W, log_det)


def linear_rows(model: TwoSlice[U], x: Array, u: U, rows: Rows) -> tuple[Array, Array, Array]:
    """What is expected of the measured rows, and their H and R: (r,), (r, n), (r, r)."""
    seen, H = linearised(model, x, u)
    return seen[rows], H[rows], model.observe_cov(u)[rows][:, rows]


def joseph(P: Array, K: Array, H: Array, HP: Array, R: Array) -> Array:
    """Covariance after a gain K, optimal or not, (..., n, n)."""
    A = P - K @ HP
    A -= (A @ np.swapaxes(H, -1, -2) - K @ R) @ np.swapaxes(K, -1, -2)
    return 0.5 * (A + np.swapaxes(A, -1, -2))
