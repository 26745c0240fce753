"""Sigma points: weighted points that carry a Gaussian's mean and covariance through any function.

The sets and weights are filterpy's, drawn once for the standard normal and then only scaled; a
model sees all points of a step in one call.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import sqrt
from typing import Any, Literal, get_args

import numpy as np

from urdyn.errors import InputError
from urdyn.estimate.filterpy_points import filterpy_points
from urdyn.types import Array, freeze, frozen

Rule = Literal["merwe", "simplex"]


@dataclass(frozen=True, eq=False)
class SigmaPoints:
    """Points of the standard normal, arranged so that every covariance is a sum of squares.

    With a centre x0 whose weight may be negative, deviations are taken from y0 = f(x0),

        cov = sum_i w_i (y_i - y0)(y_i - y0)ᵀ + excess (ȳ - y0)(ȳ - y0)ᵀ,

    which equals the customary form, and is positive while excess = beta - alpha² is not negative.
    """

    unit: Array  # (k, n) points
    mean_weight: Array  # (k,)
    scale: Array  # (k,) square roots of covariance weights; if centred, the first is the excess's
    centred: bool  # deviations from the first point, not from the mean

    def __post_init__(self) -> None:
        freeze(self, "unit", "mean_weight", "scale")

    @cached_property
    def _reach(self) -> float:
        """c where the points are 0, c e_i, -c e_i in this order, as in most sets; else 0."""
        n = self.unit.shape[1]
        c = float(self.unit[1, 0])
        cross = np.vstack([np.zeros(n), c * np.eye(n), -c * np.eye(n)])
        same = cross.shape == self.unit.shape and np.allclose(cross, self.unit, rtol=1e-12, atol=0)
        return c if same else 0.0

    @cached_property
    def _design(self) -> Array:
        """Scaled points, (k, n): a regression's design, whose columns are orthonormal."""
        return frozen(self.scale[:, None] * self.unit)

    def around(self, mean: Array, root: Array) -> Array:
        """The points of Gaussians (..., n) with P = root rootᵀ, (k, ..., n)."""
        if not self._reach:
            return np.asarray(mean + np.moveaxis(self.unit @ np.swapaxes(root, -1, -2), -2, 0))
        arms, n = self._reach * root.transpose(-1, *range(root.ndim - 1)), len(self.unit) // 2
        points = np.empty((len(self.unit), *mean.shape), order="F")  # what follows loops over them
        points[0], points[1 : n + 1], points[n + 1 :] = mean, mean + arms, mean - arms
        return points

    def moments(self, values: Array) -> tuple[Array, Array]:
        """Mean (m,) and scaled deviations D (k, m) of a function's values, with cov = DᵀD."""
        if not self.centred:
            mean = self.mean_weight @ values
            return mean, self.scale[:, None] * (values - mean)
        deviation = values - values[0]
        shift = self.mean_weight @ deviation
        deviation[0] = shift
        deviation *= self.scale[:, None]
        return values[0] + shift, deviation

    def linearised(self, values: Array) -> tuple[Array, Array, Array]:
        """A function's mean (m,), its slope G (m, n) in the points, and residual covariance (m, m).

        G is the regression of the values on the points; its residuals are due to the function's
        curvature.
        """
        mean, D = self.moments(values)
        if not self._reach:
            G = D.T @ self._design
            left = D - self._design @ G.T
            return mean, G, left.T @ left
        # In pairs about a centre, half the difference is linear and half the sum is curvature.
        n = self.unit.shape[1]
        plus, minus = D[1 : n + 1], D[n + 1 :]
        G = float(self._design[1, 0]) * (plus - minus).T
        bent = np.concatenate([D[:1], sqrt(0.5) * (plus + minus)])
        return mean, G, bent.T @ bent


@lru_cache(maxsize=32)
def sigma_points(n: int, rule: Rule, alpha: float | None, beta: float, kappa: float) -> SigmaPoints:
    """filterpy's set for n states: merwe 2n + 1 points, simplex n + 1.

    With alpha = 1 and beta = 0, merwe is Julier's set.
    `alpha` None puts the points sqrt(3) standard deviations away, or nearer.
    """
    if rule not in get_args(Rule):
        raise InputError(f"no sigma points {rule!r}; choose one of {', '.join(get_args(Rule))}")
    if n == 0:
        raise InputError("a model without states has no sigma points; use Kalman")
    if not n + kappa > 0.0:
        raise InputError(f"kappa {kappa}: with {n} states it has to be above {-n}")
    alpha = min(1.0, sqrt(3.0 / (n + kappa))) if alpha is None else alpha
    if rule == "merwe" and not n + (alpha**2 * (n + kappa) - n) > 0.0:
        raise InputError(f"alpha {alpha}: rounding leaves no spread of its points; take 1e-3, say")
    drawn = _filterpy_points(n, rule, alpha, beta, kappa)
    unit = np.reshape(drawn.sigma_points(np.zeros(n), np.eye(n)), (-1, n))
    wm, wc = np.array(drawn.Wm), np.array(drawn.Wc)
    if (wc >= 0.0).all():
        return SigmaPoints(unit, wm, np.sqrt(wc), centred=False)
    excess = wc.sum() - 2.0
    if excess < -1e-9 or (wc[1:] < 0.0).any():
        raise InputError(
            f"{rule} points with alpha {alpha}, beta {beta}, kappa {kappa} can give negative "
            f"variances for {n} states; take merwe with beta >= alpha², or simplex"
        )
    return SigmaPoints(unit, wm, np.sqrt([max(excess, 0.0), *wc[1:]]), centred=True)


def _filterpy_points(n: int, rule: Rule, alpha: float, beta: float, kappa: float) -> Any:
    module = filterpy_points()
    if rule == "merwe":
        return module.MerweScaledSigmaPoints(n, alpha, beta, kappa)
    return module.SimplexSigmaPoints(n)
