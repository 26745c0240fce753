"""Autoregression of a healthy stream, robust to outliers in its values and their past.

Bounded influence: a row counts less where its residual is large (Huber) or one of its regressors is
(Mallows) [Martin1986]_. Otherwise 2 % of outliers halve an autoregression of .9, and the remaining
colour raises false alarms.
"""

from __future__ import annotations

import numpy as np

from urdyn.faults.robust import is_mostly_one_number
from urdyn.types import MAD_TO_SD, Array, Mask

ORDERS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24)  # candidates
BOUND = 2.5  # [sd] of a value or a residual, beyond which a row counts less
ROUNDS = 15
SETTLED = 1e-3  # [-] change of a coefficient in a round; a tenth of what 1000 steps resolve
ROWS = 20  # needed per coefficient, the first p without a past included
SEEN = 0.25  # of the most frequent lag's pairs: a lag with fewer counts as unseen
RIDGE = 1e-9  # relative to the normal matrix: values may repeat


def lagged(series: Array, order: int) -> Array:
    """The last `order` values before each step, (N, p, n), newest first; NaN before the first."""
    steps, n = series.shape
    past = np.full((steps, order, n), np.nan)
    for k in range(1, min(order, steps - 1) + 1):
        past[k:, k - 1] = series[:-k]
    return past


def autoregression(y: Array) -> tuple[Array, int]:
    """Coefficients (p,) of y, (N,) around its level, and the spacing of their lags.

    The Bayesian information criterion chooses their order. Where rows are missing periodically, so
    that neighbours are never seen, lags are multiples of the shortest one seen. A series that is
    mostly one number has none: that number predicts itself, whatever follows from the others.
    """
    pace = _pace(np.isfinite(y))
    allowed = [p for p in ORDERS if p * pace <= ORDERS[-1]]
    past = lagged(y[:, None], allowed[-1] * pace)[:, pace - 1 :: pace, 0]
    allowed = [p for p in allowed if _shown(y, past[:, :p])]
    size = MAD_TO_SD * float(np.median(np.abs(y[_complete(y, past[:, : allowed[-1]])])))
    if not size > 0.0 or len(allowed) == 1 or is_mostly_one_number(y[np.isfinite(y)]):
        return np.zeros(0), pace
    y, past = y / size, past / size  # so that squares neither overflow nor vanish
    found = _of_all(y, past, allowed) if np.isfinite(y).all() else _step_by_step(y, past, allowed)
    return _spaced(found, pace), pace


def complete(y: Array, coefficients: Array) -> int:
    """Number of steps of y, (N,), that these coefficients are learnt from, the first p included."""
    lags = np.flatnonzero(coefficients)
    past = lagged(y[:, None], len(coefficients))[:, lags, 0]
    return int(_complete(y, past).sum()) + len(coefficients)


def _pace(measured: Mask) -> int:
    """The shortest lag seen; one beyond all orders where none is."""
    pairs = np.array([(measured[k:] & measured[:-k]).sum() for k in range(1, ORDERS[-1] + 1)])
    seen = (pairs >= ROWS) & (pairs >= SEEN * pairs.max())
    return int(seen.argmax()) + 1 if seen.any() else ORDERS[-1] + 1


def _complete(y: Array, past: Array) -> Mask:
    """Steps with a complete past, (N,)."""
    return np.asarray(np.isfinite(y) & np.isfinite(past).all(axis=1))


def _shown(y: Array, past: Array) -> bool:
    """Whether so many coefficients have enough rows, the first ones without a past included."""
    return bool(_complete(y, past).sum() + past.shape[1] >= ROWS * past.shape[1])


def _of_all(y: Array, past: Array, allowed: list[int]) -> Array:
    """Coefficients of the best order, all fitted to the same steps."""
    order = allowed[-1]
    rows = _complete(y, past[:, :order])
    X, z = past[rows], y[rows]
    found = {p: _fit(X[:, :p], z) for p in allowed}
    return found[_best(X, z, found)]


def _step_by_step(y: Array, past: Array, allowed: list[int]) -> Array:
    """Coefficients of the best order: each against the best lower one, by steps that show both."""
    best = allowed[0]
    for order in allowed[1:]:
        rows = _complete(y, past[:, :order])
        X, z = past[rows], y[rows]
        best = _best(X, z, {p: _fit(X[:, :p], z) for p in (best, order)})
    rows = _complete(y, past[:, :best])
    return _fit(past[rows, :best], y[rows])


def _best(X: Array, z: Array, found: dict[int, Array]) -> int:
    """The order with the least Bayesian information criterion."""
    residual = {p: z - X[:, :p] @ a for p, a in found.items()}
    # One set of weights for all orders: what differs between them is the colour alone.
    weight = _bounded(residual[max(found)])
    variances = {p: float((weight * r) @ r) / float(weight.sum()) for p, r in residual.items()}
    n = float(weight.sum())
    return min(found, key=lambda p: n * np.log(variances[p]) + p * np.log(n))


def _spaced(found: Array, pace: int) -> Array:
    """Coefficients of every lag, (p,), from those of multiples of `pace`."""
    if not len(found):
        return found
    a = np.zeros(len(found) * pace)
    a[pace - 1 :: pace] = found
    return a


def _fit(X: Array, z: Array) -> Array:
    """Least squares of values of unit size, weighted by residuals and leverage, (p,)."""
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
