"""How a healthy stream's next value follows from its last ones, outliers in both notwithstanding.

Bounded influence: a row counts less where its residual is large (Huber) and where one of the values
that it predicts from is (Mallows) [Martin1986]_. Otherwise 2 % of outliers halve an
autoregression of .9, and what is left of the colour raises false alarms.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import MAD_TO_SD, Array

ORDERS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24)  # candidates
BOUND = 2.5  # [sd] of a value or a residual, beyond which a row counts less
ROUNDS = 15
SETTLED = 1e-3  # [-] change of a coefficient in a round; a tenth of what 1000 steps can tell
COMPLETE = 0.8  # of the measured steps need a complete past, or the order is too high
RIDGE = 1e-9  # of the normal matrix: values that repeat


def lagged(series: Array, order: int) -> Array:
    """The last `order` values before each step, (N, p, n), newest first; NaN before the first."""
    steps, n = series.shape
    past = np.full((steps, order, n), np.nan)
    for k in range(1, min(order, steps - 1) + 1):
        past[k:, k - 1] = series[:-k]
    return past


def autoregression(y: Array) -> Array:
    """Coefficients (p,) of y, (N,) around its level, of the order by the Bayesian criterion."""
    order = _longest(y)
    past = lagged(y[:, None], order)[:, :, 0]
    told = np.isfinite(y) & np.isfinite(past).all(axis=1)
    X, z = past[told], y[told]
    size = MAD_TO_SD * float(np.median(np.abs(z)))
    if not size > 0.0 or not order:
        return np.zeros(0)
    X, z = X / size, z / size  # whose squares are floats in any unit
    allowed = [p for p in ORDERS if p <= order]
    found = {p: _fit(X[:, :p], z) for p in allowed}
    residual = {p: z - X[:, :p] @ a for p, a in found.items()}
    # One set of weights for all orders: what differs between them is the colour alone.
    weight = _bounded(residual[order])
    told_of = {p: float(weight @ r**2) / float(weight.sum()) for p, r in residual.items()}
    n = float(weight.sum())
    best = min(allowed, key=lambda p: n * np.log(told_of[p]) + p * np.log(n))
    return found[best]


def _longest(y: Array) -> int:
    """Highest order that so many steps show, most of them with a complete past."""
    measured = np.isfinite(y)
    allowed = 0
    for order in ORDERS:
        past = np.isfinite(lagged(y[:, None], order)[:, :, 0]).all(axis=1)
        if (past & measured)[order:].sum() >= COMPLETE * measured[order:].sum() and (
            order * 20 <= measured.sum()
        ):
            allowed = order
    return allowed


def _fit(X: Array, z: Array) -> Array:
    """Least squares of values of unit size, weighed by residuals and leverage, (p,)."""
    p = X.shape[1]
    if not p:
        return np.zeros(0)
    leverage = np.minimum(1.0, BOUND / np.maximum(np.abs(X).max(axis=1), 1e-300)) ** 2
    weight, a = leverage, np.zeros(p)
    for _ in range(ROUNDS):
        XW = X.T * weight
        normal = XW @ X
        before, a = a, np.linalg.solve(normal + RIDGE * np.trace(normal) / p * np.eye(p), XW @ z)
        if np.abs(a - before).max() < SETTLED:
            break
        weight = leverage * _bounded(z - X @ a)
    return a


def _bounded(residual: Array) -> Array:
    """Huber's weights of residuals, (N,)."""
    size = MAD_TO_SD * float(np.median(np.abs(residual)))
    return np.minimum(1.0, BOUND * max(size, 1e-300) / np.maximum(np.abs(residual), 1e-300))
