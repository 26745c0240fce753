"""Gaussian variational inference (the paper's eq. 10) by natural-gradient steps.

In each slice q = N(m, Lambda⁻¹) minimises KL(q || posterior) given the Gaussian prediction
N(m0, Lambda0⁻¹), by the Bayesian learning rule [Khan2023]_:

    Lambda += step (Lambda0 + E_q[H]ᵀ R⁻¹ E_q[H] - Lambda)
    m      += step Lambda⁻¹ (Lambda0 (m0 - m) + E_q[Hᵀ R⁻¹ (y - h)])

Expectations are taken at sigma points of q. It is an approximation from a Gaussian family, with
Gauss-Newton's Hessian (second derivatives of h are omitted, so that Lambda stays positive) and the
past summed up in one Gaussian, as in every filter here. It is not variational over the whole
history, or over anything but the mean and covariance of the state. It starts from UKF's result, and
no step increases the divergence above that. It seeks one mode, and does not count the model's
curvature as noise, as UKF does: where a model is not linear within its uncertainty it is
overconfident, the more so the more states there are. On an affine model one full step is Kalman's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U, linearised
from urdyn.errors import InputError
from urdyn.estimate.innovation import Innovation, factor_of, measured_rows, require_finite
from urdyn.estimate.linearised import updated
from urdyn.estimate.sigma_points import Rule, SigmaPoints, sigma_points
from urdyn.estimate.square_root import SquareRoot, lower_root
from urdyn.estimate.ukf import UKF, wide
from urdyn.given import given_count, given_number, not_negative
from urdyn.types import Array, Gaussian


@dataclass(frozen=True)
class Variational:
    """Fits a Gaussian to the posterior of every slice, by natural-gradient descent."""

    iterations: int = 5  # at most
    step_size: float = 1.0  # of the natural gradient; 1 is Newton's
    tolerance: float = 1e-3  # stop when the mean moves by less, in standard deviations
    rule: Rule = "merwe"

    def __post_init__(self) -> None:
        object.__setattr__(self, "iterations", given_count(self.iterations, "iterations"))
        if not 0.0 < self.step_size <= 1.0:
            raise InputError(f"step_size {self.step_size}: above 0, and 1 at most")
        given_number(self.tolerance, "tolerance", "a finite number, 0 or more", not_negative)

    def init(self, model: TwoSlice[U]) -> SquareRoot:
        """The model's prior."""
        return SquareRoot.of(model.prior.mean, model.prior.cov)

    def step(
        self, model: TwoSlice[U], state: SquareRoot, u: U, y: Array
    ) -> tuple[SquareRoot, Innovation]:
        """Predict over u.dt, then descend on the finite rows of y, (m,)."""
        points = sigma_points(len(state.mean), self.rule, None, 2.0, 0.0)
        moved = UKF(self.rule).predicted(model, state.gaussian, u)
        predicted = SquareRoot.of(moved.mean, moved.cov)
        rows = measured_rows(y)
        first, innovation = updated(moved, wide(model, points, predicted, u).of(rows), y, rows)
        likelihood = Likelihood(model, u, y, points, predicted)
        try:
            q = self._descended(likelihood, _whitened(first, predicted))
        except np.linalg.LinAlgError:
            known = [n for n, sd in zip(model.names, predicted.sd, strict=True) if not sd > 0.0]
            told = ", ".join(known) or "a combination of states"
            raise InputError(f"{told} has no variance to descend in; use UKF") from None
        mean, root = predicted.at(q.mean), predicted.root @ q.root
        require_finite(float(mean.sum()), mean)
        return SquareRoot(mean, root), innovation

    def _descended(self, likelihood: Likelihood[U], q: SquareRoot) -> SquareRoot:
        """Descent from q, by shorter steps where the divergence would exceed its initial value."""
        here, size = likelihood.seen_from(q), self.step_size
        begun = here.divergence
        require_finite(begun, here.gradient, here.curvature)
        for _ in range(self.iterations):
            tried = here.step(size)
            there = likelihood.seen_from(tried)
            moved = float((np.abs(tried.mean - here.q.mean) / tried.sd).max())
            if there.divergence <= begun:
                here = there
            else:
                size *= 0.5
            if moved < self.tolerance:
                break
        return here.q

    def belief(self, state: SquareRoot) -> Gaussian:
        """Mean and covariance of q."""
        return state.gaussian

    def shifted(self, state: SquareRoot, by: Array) -> SquareRoot:
        """The same belief about states that have all moved by known amounts, (n,)."""
        return SquareRoot(state.mean + by, state.root)

    def with_belief(self, state: SquareRoot, belief: Gaussian) -> SquareRoot:
        """The root of this belief."""
        return SquareRoot.of(belief.mean, belief.cov)


@dataclass(frozen=True, eq=False)
class Likelihood(Generic[U]):
    """log p(y | x) of the measured rows of one slice, and the points to average it at.

    All is in the prediction's whitened coordinates, x = m0 + L0 z: there Lambda0 is 1, so that a
    stiff prior costs no digits.
    """

    model: TwoSlice[U]
    u: U
    y: Array  # (m,)
    points: SigmaPoints
    predicted: SquareRoot

    def seen_from(self, q: SquareRoot) -> Slope:
        """Averages over q, a belief about z."""
        rows, w = measured_rows(self.y), self.points.mean_weight
        R = self.model.observe_cov(self.u)[rows][:, rows]
        white = np.linalg.inv(factor_of(R))
        x = self.predicted.at(q.at(self.points.unit))
        seen, H = linearised(self.model, x, self.u)
        residual = (self.y - seen)[:, rows] @ white.T
        H = white @ H[..., rows, :] @ self.predicted.root
        mean, D = self.points.moments(residual)
        misfit = 0.5 * float(mean @ mean + (D**2).sum())
        if H.ndim == 2:
            return Slope(q, misfit, H.T @ mean, H.T @ H)
        slope = np.tensordot(w, H, axes=1)
        return Slope(q, misfit, np.einsum("k,kr,krn->n", w, residual, H), slope.T @ slope)


@dataclass(frozen=True, eq=False)
class Slope:
    """Averages over q, a belief about states whose prediction is N(0, 1)."""

    q: SquareRoot
    misfit: float  # [nats] -E_q[log p(y | x)], up to a constant
    gradient: Array  # (n,) E_q[Hᵀ R⁻¹ (y - h)]
    curvature: Array  # (n, n) E_q[H]ᵀ R⁻¹ E_q[H]

    @property
    def divergence(self) -> float:
        """KL(q || posterior), up to a constant [nats]."""
        own = 0.5 * float((self.q.root**2).sum() + self.q.mean @ self.q.mean)
        return self.misfit + own - float(np.linalg.slogdet(self.q.root)[1])

    def step(self, size: float) -> SquareRoot:
        """q after a natural-gradient step."""
        mean, precision = self.q.mean, np.linalg.inv(self.q.root @ self.q.root.T)
        precision += size * (np.eye(len(mean)) + self.curvature - precision)
        factor = np.linalg.inv(np.linalg.cholesky(0.5 * (precision + precision.T)))
        return SquareRoot(mean + size * factor.T @ (factor @ (self.gradient - mean)), factor.T)


def _whitened(belief: Gaussian, by: SquareRoot) -> SquareRoot:
    """A belief in the standard scores of another."""
    mean = np.linalg.solve(by.root, belief.mean - by.mean)
    root = np.linalg.solve(by.root, lower_root(belief.cov))
    return SquareRoot(np.asarray(mean), np.asarray(root))
