"""The exact filter of an affine model [Kalman1960]_; every other filter must equal it on one."""

from __future__ import annotations

from dataclasses import dataclass

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.bare_belief import BareBelief
from urdyn.estimate.innovation import Innovation
from urdyn.estimate.linearised import correct, predict
from urdyn.types import Array, Gaussian


@dataclass(frozen=True)
class Kalman(BareBelief):
    """Exact where the model is affine; refuses any other."""

    def init(self, model: TwoSlice[U]) -> Gaussian:
        """The model's prior."""
        bent = [name for name, linear in zip(model.names, model.linear, strict=True) if not linear]
        if bent:
            raise InputError(
                f"Kalman needs an affine model and {', '.join(bent)} are not affine; use EKF or UKF"
            )
        return model.prior

    def step(
        self, model: TwoSlice[U], state: Gaussian, u: U, y: Array
    ) -> tuple[Gaussian, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,)."""
        return correct(model, predict(model, state, u), u, y)
