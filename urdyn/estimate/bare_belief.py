"""A filter that remembers nothing but its belief."""

from __future__ import annotations

from abc import ABC, abstractmethod

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.estimate.innovation import Innovation
from urdyn.types import Array, Gaussian


class BareBelief(ABC):
    """Its state is its belief."""

    @abstractmethod
    def init(self, model: TwoSlice[U]) -> Gaussian:
        """The model's prior."""

    @abstractmethod
    def step(
        self, model: TwoSlice[U], state: Gaussian, u: U, y: Array
    ) -> tuple[Gaussian, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,)."""

    def belief(self, state: Gaussian) -> Gaussian:
        """The state itself."""
        return state

    def shifted(self, state: Gaussian, by: Array) -> Gaussian:
        """The same belief about states that have all moved by known amounts, (n,)."""
        return Gaussian(state.mean + by, state.cov)

    def with_belief(self, state: Gaussian, belief: Gaussian) -> Gaussian:
        """The belief itself."""
        return belief
