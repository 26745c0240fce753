"""The unscented Kalman filter (the paper's Algorithm 1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.dbn.arguments import Arguments
from urdyn.dbn.two_slice import Narrow, TwoSlice, U, is_narrow
from urdyn.errors import InputError
from urdyn.estimate.bare_belief import BareBelief
from urdyn.estimate.innovation import Innovation, measured_rows, nothing_measured
from urdyn.estimate.linearised import Expected, noise_of, predict, updated
from urdyn.estimate.sigma_points import Rule, SigmaPoints, sigma_points
from urdyn.estimate.square_root import SquareRoot, lower_root
from urdyn.types import Array, Gaussian

# Jitter, relative to its variance and in units of the argument squared, that keeps the arguments'
# covariance positive definite where one is a function of others. It does not change the slopes.
APART, TINY = 1e-9, 1e-14


@dataclass(frozen=True)
class UKF(BareBelief):
    """Moments by sigma points [Wan2000]_; drawn anew after the prediction, so that they include Q.

    The paper does not draw anew; then the noise of the slice is missing from the innovation, and
    the filter is not Kalman's on a linear model. Where each row of an observation depends on a few
    combinations of the states, points are drawn of these alone [Greiff2020]_.
    """

    rule: Rule = "merwe"
    # Spread of the points, in units of sqrt(n + kappa) standard deviations. None: sqrt(3) standard
    # deviations, where a Gaussian's fourth moments are matched; further out, at 1 and with many
    # states, poorly known logarithms are bent beyond any value that they will ever have.
    alpha: float | None = None
    beta: float = 2.0  # 2 is right for a Gaussian
    kappa: float = 0.0

    def __post_init__(self) -> None:
        spread = 1.0 if self.alpha is None else self.alpha
        if not (0.0 < spread < np.inf and np.isfinite([self.beta, self.kappa]).all()):
            raise InputError(
                f"alpha {self.alpha}, beta {self.beta}, kappa {self.kappa}: "
                "they have to be finite, and alpha above 0"
            )
        if self.rule == "simplex" and self.alpha is not None:
            raise InputError(f"alpha {self.alpha}: simplex points have none; take merwe")

    def init(self, model: TwoSlice[U]) -> Gaussian:
        """The model's prior."""
        return model.prior

    def step(
        self, model: TwoSlice[U], state: Gaussian, u: U, y: Array
    ) -> tuple[Gaussian, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,)."""
        predicted, rows = self.predicted(model, state, u), measured_rows(y)
        if not y[rows].size:
            return predicted, nothing_measured(len(y))
        return updated(predicted, self._expected(model, predicted, u).of(rows), y, rows)

    def predicted(self, model: TwoSlice[U], state: Gaussian, u: U) -> Gaussian:
        """The belief about the next slice before its measurement."""
        if model.affine_transition:  # the moments of any points are exact
            return predict(model, state, u)
        points = self._points(len(state.mean))
        moved = model.transition(points.around(state.mean, lower_root(state.cov)), u)
        mean, D = points.moments(moved)
        return Gaussian(mean, D.T @ D + model.transition_cov(u))

    def _expected(self, model: TwoSlice[U], predicted: Gaussian, u: U) -> Expected:
        if is_narrow(model) and (few := model.arguments(u)) is not None:
            return narrow(model, few, self._points(few.count), predicted, u)
        root = SquareRoot.of(predicted.mean, predicted.cov)
        return wide(model, self._points(len(root.mean)), root, u)

    def _points(self, n: int) -> SigmaPoints:
        return sigma_points(n, self.rule, self.alpha, self.beta, self.kappa)


def wide(model: TwoSlice[U], points: SigmaPoints, predicted: SquareRoot, u: U) -> Expected:
    """Prediction of all rows, by statistical linearisation in all n states.

    y = ȳ + G xi + e with the standard scores xi: the regression's residual, the model's curvature,
    counts as noise, N = cov(e) = R + (residual)².
    """
    x = points.around(predicted.mean, predicted.root)
    mean, G, left = points.linearised(model.observe(x, u))
    noise = noise_of(model, u, mean) + left
    return Expected(mean, G @ predicted.root.T, G @ G.T, noise)


def narrow(
    model: Narrow[U], few: Arguments, points: SigmaPoints, predicted: Gaussian, u: U
) -> Expected:
    """The same row by row, each in its own arguments, and with its own residual."""
    across = few.across(predicted.cov)
    cov = few.within(across)
    m, d = len(cov), few.count
    variance = cov.reshape(m, -1)[:, :: d + 1]
    variance += APART * variance + TINY
    root = np.asarray(np.linalg.cholesky(cov))
    z = points.around(few.of(predicted.mean), root)
    mean, G, left = points.linearised(model.through(z, u))
    slope = np.asarray(np.linalg.solve(root.swapaxes(1, 2), G[..., None])[..., 0])
    cross, H = (slope[:, None] @ across)[:, 0], few.back(slope)
    noise = model.observe_cov(u) + np.diag(left.diagonal())
    return Expected(mean, cross, cross[:, : H.shape[1]] @ H.T, noise)
