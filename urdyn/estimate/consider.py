"""A filter whose mean is held: it judges a model without changing it [Schmidt1966]_.

A filter that adapts smears a fault over all parameters within seconds. This one keeps the mean of
the considered states where the process puts it, yet knows how uncertain they are: its innovations
have the covariance H P Hᵀ + R, so that a detector's thresholds hold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.bare_belief import BareBelief
from urdyn.estimate.innovation import Innovation
from urdyn.estimate.linearised import correct, predict
from urdyn.types import Array, Gaussian, Mask, index_of


@dataclass(frozen=True)
class Consider(BareBelief):
    """Schmidt-Kalman filter: suboptimal gain, consistent covariance."""

    learnt: frozenset[str] = frozenset()  # states whose mean may move; the others are considered

    def __post_init__(self) -> None:
        if isinstance(self.learnt, str):  # would be read as its letters
            raise InputError(f"learnt {self.learnt!r}: takes a set of names of states")
        object.__setattr__(self, "learnt", frozenset(self.learnt))

    def init(self, model: TwoSlice[U]) -> Gaussian:
        """The model's prior."""
        for name in self.learnt:
            index_of(name, model.names, "state")
        return model.prior

    def step(
        self, model: TwoSlice[U], state: Gaussian, u: U, y: Array
    ) -> tuple[Gaussian, Innovation]:
        """Predict over u.dt, then judge the finite rows of y, (m,)."""
        predicted = predict(model, state, u)
        return correct(model, predicted, u, y, moved=self._moved(model.names))

    def _moved(self, names: tuple[str, ...]) -> Mask:
        return np.fromiter((name in self.learnt for name in names), bool, len(names))
