"""Observations that are affine in the state: with such every filter equals the Kalman filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from urdyn.dbn.two_slice import U_contra
from urdyn.errors import InputError
from urdyn.given import given_count, given_covariance, given_each
from urdyn.types import Array, Mask


@dataclass(frozen=True, eq=False)
class AffineObservation(Generic[U_contra]):
    """y = H(u) x + d + e: regression on the state with regressors from the slice's inputs."""

    states: int  # p, columns of H
    H: Callable[[U_contra], Array]  # -> (m, p)
    R: Array  # (m, m) measurement noise
    d: Array | float = 0.0  # (m,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", given_count(self.states, "states", 0))
        object.__setattr__(self, "R", given_covariance(self.R, "R"))
        m, shape = len(self.R), np.shape(self.d)
        if shape not in ((), (1,), (m,)):
            raise InputError(f"d has the shape {shape}; it has to be {(m,)}, or one for all")
        given_each(self.d, "d", shape)

    @cached_property
    def linear(self) -> Mask:
        """All states, (p,)."""
        return np.ones(self.states, dtype=bool)

    def observe(self, x: Array, u: U_contra) -> Array:
        """H x + d, one matrix product for all x, (..., p) -> (..., m)."""
        return x @ self._H(u).T + self.d

    def observe_jacobian(self, x: Array, u: U_contra) -> Array:
        """H, (m, p)."""
        return self._H(u)

    def observe_cov(self, u: U_contra) -> Array:
        """R, (m, m)."""
        return self.R

    def _H(self, u: U_contra) -> Array:
        H, shape = self.H(u), (len(self.R), self.states)
        if H.shape != shape:
            raise InputError(f"H has the shape {H.shape}; of R's sensors by states it is {shape}")
        return H
