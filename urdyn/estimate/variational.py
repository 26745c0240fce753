"""Gaussian variational inference (the paper's eq. 10) by natural-gradient steps.

In every slice q = N(m, Lambda⁻¹) minimises KL(q || posterior) given the Gaussian prediction
N(m0, Lambda0⁻¹), by the Bayesian learning rule [Khan2023]_:

    Lambda += step (Lambda0 + E_q[Hᵀ R⁻¹ H] - Lambda)
    m      += step Lambda⁻¹ (Lambda0 (m0 - m) + E_q[Hᵀ R⁻¹ (y - h)])

Expectations are taken at sigma points of q. What it is: an approximation from a Gaussian family,
whose Hessian is Gauss-Newton's (second derivatives of h are left out, so that Lambda stays
positive), and whose past is summed up in one Gaussian, as in every filter here. What it is not:
variational over the whole history, or over anything but the mean and covariance of the state.
On an affine model one full step is Kalman's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U, linearised
from urdyn.errors import InputError
from urdyn.estimate.innovation import Innovation, factor_of, measured_rows, require_finite
from urdyn.estimate.linearised import predict, updated
from urdyn.estimate.sigma_points import Rule, SigmaPoints, sigma_points
from urdyn.estimate.square_root import SquareRoot
from urdyn.estimate.ukf import wide
from urdyn.given import given_count
from urdyn.types import Array, Gaussian


@dataclass(frozen=True)
class Variational:
    """Fits a Gaussian to the posterior of every slice, by natural-gradient descent."""

    iterations: int = 5  # at most
    step_size: float = 1.0  # of the natural gradient; 1 is Newton's
    tolerance: float = 1e-3  # stop when the mean moves by less, in standard deviations
    rule: Rule = "merwe"  # with no weight negative

    def __post_init__(self) -> None:
        object.__setattr__(self, "iterations", given_count(self.iterations, "iterations"))
        if not 0.0 < self.step_size <= 1.0:
            raise InputError(f"step_size {self.step_size}: above 0, and 1 at most")

    def init(self, model: TwoSlice[U]) -> SquareRoot:
        """The model's prior."""
        return SquareRoot.of(model.prior.mean, model.prior.cov)

    def step(
        self, model: TwoSlice[U], state: SquareRoot, u: U, y: Array
    ) -> tuple[SquareRoot, Innovation]:
        """Predict over u.dt, then descend on the finite rows of y, (m,)."""
        points = sigma_points(len(state.mean), self.rule, 1.0, 2.0, 0.0)
        moved = predict(model, state.gaussian, u)
        predicted = SquareRoot.of(moved.mean, moved.cov)
        rows = measured_rows(y)
        first, innovation = updated(moved, wide(model, points, predicted, u).of(rows), y, rows)
        q = SquareRoot.of(first.mean, first.cov)
        likelihood = Likelihood(model, u, y, points)
        try:
            for _ in range(self.iterations):
                before, q = q, self._descend(likelihood, predicted, q)
                if _distance(before, q) < self.tolerance:
                    break
        except np.linalg.LinAlgError:
            known = [n for n, sd in zip(model.names, predicted.sd, strict=True) if not sd > 0.0]
            told = ", ".join(known) or "a combination of states"
            raise InputError(f"{told} has no variance to descend in; use UKF") from None
        require_finite(float(q.mean.sum()), q.mean)
        return q, innovation

    def _descend(
        self, likelihood: Likelihood[U], predicted: SquareRoot, q: SquareRoot
    ) -> SquareRoot:
        """One natural-gradient step, in the whitened coordinates of the prediction.

        There Lambda0 is 1, so that a stiff prior costs no digits.
        """
        L0 = predicted.root
        gradient, curvature = likelihood.expected(q, L0)
        offset = np.linalg.solve(L0, q.mean - predicted.mean)
        shape = np.linalg.solve(L0, q.root)
        precision = np.linalg.inv(shape @ shape.T)
        precision += self.step_size * (np.eye(len(offset)) + curvature - precision)
        factor = np.linalg.inv(np.linalg.cholesky(0.5 * (precision + precision.T)))
        offset += self.step_size * factor.T @ (factor @ (gradient - offset))
        return SquareRoot(predicted.mean + L0 @ offset, L0 @ factor.T)

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
    """log p(y | x) of the measured rows of one slice, and the points to average it at."""

    model: TwoSlice[U]
    u: U
    y: Array  # (m,)
    points: SigmaPoints

    def expected(self, q: SquareRoot, root: Array) -> tuple[Array, Array]:
        """E_q of its gradient (n,) and of minus its Gauss-Newton Hessian (n, n), by root⁻¹ x."""
        rows, x, w = measured_rows(self.y), q.at(self.points.unit), self.points.mean_weight
        R = self.model.observe_cov(self.u)[rows][:, rows]
        white = np.linalg.inv(factor_of(R))
        seen, H = linearised(self.model, x, self.u)
        residual = (self.y - seen)[:, rows] @ white.T
        H = white @ H[..., rows, :] @ root
        if H.ndim == 2:
            return H.T @ (w @ residual), H.T @ H
        gradient = np.einsum("k,kr,krn->n", w, residual, H)
        flat = (np.sqrt(w)[:, None, None] * H).reshape(-1, H.shape[-1])
        return gradient, flat.T @ flat


def _distance(a: SquareRoot, b: SquareRoot) -> float:
    """How far the mean moved, in standard deviations of b; the largest of all states."""
    sd = np.sqrt((b.root**2).sum(axis=1))
    return float((np.abs(b.mean - a.mean) / np.where(sd > 0.0, sd, 1.0)).max())
