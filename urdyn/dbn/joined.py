"""A process and an observation, joined into one model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic, cast

import numpy as np

from urdyn.dbn.arguments import Arguments
from urdyn.dbn.process import RandomWalk
from urdyn.dbn.two_slice import (
    Narrow,
    Observation,
    Process,
    U_contra,
    is_narrow,
    linearised,
    predicted,
)
from urdyn.errors import InputError
from urdyn.types import Array, Gaussian, Mask


@dataclass(frozen=True, eq=False)
class Joined(Generic[U_contra]):
    """Observation of the p leading states of a process; a `TwoSlice`.

    States that the process adds to the parameters (rates, drifts) come after them and are not
    observed, so that any process can be combined with any observation.
    """

    process: Process[U_contra]  # n states, the observed parameters first
    observation: Observation[U_contra]  # of p <= n parameters

    def __post_init__(self) -> None:
        if self._width > len(self.names):
            raise InputError(
                f"{self._width} states are observed, and the process has {len(self.names)}: "
                f"{', '.join(self.names)}"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the process's states."""
        return self.process.names

    @property
    def prior(self) -> Gaussian:
        """The process's prior."""
        return self.process.prior

    @cached_property
    def linear(self) -> Mask:
        """Linear in both halves; unobserved states are linear in the observation, (n,)."""
        mask = np.array(self.process.linear)
        mask[: self._width] &= self.observation.linear
        return mask

    @cached_property
    def affine_transition(self) -> bool:
        """That of the process."""
        return bool(self.process.linear.all())

    @cached_property
    def still(self) -> bool:
        """Whether the process is a random walk without diffusion."""
        return isinstance(self.process, RandomWalk) and not self.process.diffusion.any()

    @cached_property
    def _width(self) -> int:
        return len(self.observation.linear)

    def transition(self, x: Array, u: U_contra) -> Array:
        """Of the process, (..., n) -> (..., n)."""
        return self.process.transition(x, u)

    def transition_jacobian(self, x: Array, u: U_contra) -> Array:
        """Of the process, (n, n) or (..., n, n)."""
        return self.process.transition_jacobian(x, u)

    def transition_cov(self, u: U_contra) -> Array:
        """Of the process, (n, n)."""
        return self.process.transition_cov(u)

    def predicted(self, belief: Gaussian, u: U_contra) -> Gaussian | None:
        """By the process."""
        return predicted(self.process, belief, u)

    def observe(self, x: Array, u: U_contra) -> Array:
        """Of the leading states, (..., n) -> (..., m)."""
        return self.observation.observe(x[..., : self._width], u)

    def observe_jacobian(self, x: Array, u: U_contra) -> Array:
        """Of the leading states, zero for the others, (m, n) or (..., m, n)."""
        return self._widened(self.observation.observe_jacobian(x[..., : self._width], u))

    def linearised(self, x: Array, u: U_contra) -> tuple[Array, Array]:
        """Both at once."""
        seen, H = linearised(self.observation, x[..., : self._width], u)
        return seen, self._widened(H)

    def arguments(self, u: U_contra) -> Arguments | None:
        """Those of the observation: no row depends on any other state."""
        return self.observation.arguments(u) if is_narrow(self.observation) else None

    def through(self, z: Array, u: U_contra) -> Array:
        """Of the observation."""
        return cast(Narrow[U_contra], self.observation).through(z, u)

    def _widened(self, H: Array) -> Array:
        if self._width == len(self.process.names):
            return H
        if H.shape[-1] != self._width:
            raise InputError(f"H has the shape {H.shape}; {self._width} states are observed")
        wide = np.zeros((*H.shape[:-1], len(self.process.names)))
        wide[..., : self._width] = H
        return wide

    def observe_cov(self, u: U_contra) -> Array:
        """Of the observation, (m, m)."""
        return self.observation.observe_cov(u)
