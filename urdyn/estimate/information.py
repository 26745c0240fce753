"""The information filter: precision instead of covariance, so that measurements only add.

    Lambda = P⁻¹,  eta = Lambda x;    Lambda += Hᵀ R⁻¹ H,  eta += Hᵀ R⁻¹ (r + H x)

With a static process a whole log is exactly one small matrix, and the order of its rows does not
matter; a prior may be arbitrarily vague. A state or sensor without variance has no precision: such
a model is refused. What is known least is rounded by what is known best: relative to its sd by some
1e-16 times the ratio of their precisions, which is 1e-4 for noise of a millionth of the prior's sd.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.innovation import (
    Innovation,
    innovation,
    measured_rows,
    require_finite,
    residual_of,
    whitening,
)
from urdyn.estimate.linearised import linear_rows, propagated
from urdyn.estimate.square_root import inverse, lower_root
from urdyn.types import Array, Gaussian, Index, freeze


@dataclass(frozen=True, eq=False)
class Information:
    """A belief as precision and precision-weighted mean."""

    precision: Array  # (n, n)
    weighted: Array  # (n,)

    def __post_init__(self) -> None:
        freeze(self, "precision", "weighted")

    @classmethod
    def of(cls, belief: Gaussian, names: Sequence[str]) -> Information:
        """From a belief about states of these names; InputError where one has no variance."""
        precision = _precision(belief.cov, "state", names)
        return cls(precision, precision @ belief.mean)

    @property
    def gaussian(self) -> Gaussian:
        """Mean and covariance."""
        white = np.linalg.inv(lower_root(self.precision))
        # By the root: a covariance has too few digits of what it knows far better than the rest.
        return Gaussian(white.T @ (white @ self.weighted), white.T @ white)


@dataclass(frozen=True)
class InformationFilter:
    """Kalman's filter in the dual coordinates; non-linear models are linearised at the mean."""

    def init(self, model: TwoSlice[U]) -> Information:
        """The model's prior."""
        return Information.of(model.prior, model.names)

    def step(
        self, model: TwoSlice[U], state: Information, u: U, y: Array
    ) -> tuple[Information, Innovation]:
        """Predict over u.dt, then add the information of the finite rows of y, (m,)."""
        predicted, belief = _predict(model, state, u)
        rows, x = measured_rows(y), belief.mean
        seen, H, R = linear_rows(model, x, u, rows)
        residual = residual_of(y, rows, seen)
        S = H @ belief.cov @ H.T + R
        HR = H.T @ _precision(R, "sensor", np.arange(len(y))[rows])
        posterior = Information(
            predicted.precision + HR @ H, predicted.weighted + HR @ (residual + H @ x)
        )
        W, log_det = whitening(S)
        told = innovation(y, rows, residual, S, W, log_det)
        require_finite(told.log_likelihood, posterior.weighted, posterior.precision)
        return posterior, told

    def belief(self, state: Information) -> Gaussian:
        """Mean and covariance, by an inversion."""
        return state.gaussian

    def shifted(self, state: Information, by: Array) -> Information:
        """The same belief about states that have all moved by known amounts, (n,)."""
        return Information(state.precision, state.weighted + state.precision @ by)

    def with_belief(self, state: Information, belief: Gaussian) -> Information:
        """The information that this belief holds; InputError where a state has no variance."""
        return Information.of(belief, tuple(map(str, range(len(belief.mean)))))


def _predict(model: TwoSlice[U], state: Information, u: U) -> tuple[Information, Gaussian]:
    """Both forms of the prediction; a static process keeps the precision as it is."""
    belief = state.gaussian
    F, Q = model.transition_jacobian(belief.mean, u), model.transition_cov(u)
    mean = model.transition(belief.mean, u)
    if not Q.any() and np.array_equal(F, np.eye(len(mean))):
        shifted = state.weighted + state.precision @ (mean - belief.mean)
        return Information(state.precision, shifted), Gaussian(mean, belief.cov)
    moved = Gaussian(mean, propagated(F, belief.cov) + Q)
    return Information.of(moved, model.names), moved


def _precision(cov: Array, what: str, names: Sequence[str] | Index) -> Array:
    """Inverse of a covariance; InputError where a state, sensor or combination has no variance."""
    try:
        return inverse(cov)
    except np.linalg.LinAlgError:
        known = [str(n) for n, v in zip(names, cov.diagonal(), strict=True) if not v > 0.0]
        told = f"{what} {', '.join(known)}" if known else f"a combination of {what}s"
        raise InputError(f"{told} has no variance, and so no precision; use Kalman") from None
