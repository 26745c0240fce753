"""The extended Kalman filter (the paper's eq. 8), on the model's own analytic Jacobians."""

from __future__ import annotations

from dataclasses import dataclass

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.estimate.bare_belief import BareBelief
from urdyn.estimate.innovation import Innovation
from urdyn.estimate.linearised import correct, predict
from urdyn.given import given_count
from urdyn.types import Array, Gaussian


@dataclass(frozen=True)
class EKF(BareBelief):
    """First-order linearisation; more iterations are Gauss-Newton to the MAP [Bell1993]_."""

    iterations: int = 1  # linearisations of the observation, each at the last estimate

    def __post_init__(self) -> None:
        object.__setattr__(self, "iterations", given_count(self.iterations, "iterations"))

    def init(self, model: TwoSlice[U]) -> Gaussian:
        """The model's prior."""
        return model.prior

    def step(
        self, model: TwoSlice[U], state: Gaussian, u: U, y: Array
    ) -> tuple[Gaussian, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,)."""
        predicted = predict(model, state, u)
        posterior, innovation = correct(model, predicted, u, y)
        for _ in range(self.iterations - 1):
            posterior, _ = correct(model, predicted, u, y, at=posterior.mean)
        return posterior, innovation
