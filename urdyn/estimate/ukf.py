"""The unscented Kalman filter (the paper's Algorithm 1), in square-root form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.estimate.innovation import Innovation, measured_rows
from urdyn.estimate.sigma_points import Rule, SigmaPoints, sigma_points
from urdyn.estimate.square_root import SquareRoot, condition
from urdyn.types import Array, Gaussian


@dataclass(frozen=True)
class UKF:
    """Moments by sigma points [Wan2000]_; drawn anew after the prediction, so that they carry Q.

    The paper does not draw anew; then the noise of the slice is missing from the innovation, and
    the filter is not Kalman's on a linear model.
    """

    rule: Rule = "merwe"
    # Spread of the points, in units of sqrt(n + kappa) standard deviations. None: they lie sqrt(3)
    # of these away, where a Gaussian's fourth moments are met; further out, at 1 and with many
    # states, logarithms that are hardly known are bent beyond all that they will ever be.
    alpha: float | None = None
    beta: float = 2.0  # 2 is right for a Gaussian
    kappa: float = 0.0

    def init(self, model: TwoSlice[U]) -> SquareRoot:
        """The model's prior."""
        return SquareRoot.of(model.prior.mean, model.prior.cov)

    def step(
        self, model: TwoSlice[U], state: SquareRoot, u: U, y: Array
    ) -> tuple[SquareRoot, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,)."""
        points = self._points(len(state.mean))
        if model.still:
            return assimilate(model, points, state, u, y)
        if model.affine_transition:  # the moments of any points are exact: arms alone will do
            mean, origin = model.transition(np.array([state.mean, 0.0 * state.mean]), u)
            D = model.transition(state.root.T, u) - origin
        else:
            mean, D = points.moments(model.transition(points.around(state.mean, state.root), u))
        cov = D.T @ D
        cov += model.transition_cov(u)
        predicted = SquareRoot.of(mean, cov)
        return assimilate(model, points, predicted, u, y)

    def belief(self, state: SquareRoot) -> Gaussian:
        """Mean and covariance."""
        return state.gaussian

    def _points(self, n: int) -> SigmaPoints:
        alpha = min(1.0, np.sqrt(3.0 / (n + self.kappa))) if self.alpha is None else self.alpha
        return sigma_points(n, self.rule, alpha, self.beta, self.kappa)


def assimilate(
    model: TwoSlice[U], points: SigmaPoints, predicted: SquareRoot, u: U, y: Array
) -> tuple[SquareRoot, Innovation]:
    """The belief after the slice is measured, by statistical linearisation.

    y = ȳ + G xi + e with the standard scores xi: what the regression leaves, the model's curvature,
    is noise, N = cov(e) = R + (left over)².
    """
    rows = measured_rows(y)
    seen = model.observe(points.around(predicted.mean, predicted.root), u)[:, rows]
    mean, G, left = points.linearised(seen)
    N = left + model.observe_cov(u)[rows][:, rows]
    return condition(predicted, G, N, y[rows] - mean, y, rows)
