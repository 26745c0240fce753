"""Models that are affine in their state: on these every filter is Kalman's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from urdyn.dbn.two_slice import U_contra
from urdyn.errors import InputError
from urdyn.types import Array, Gaussian, Mask, frozen


@dataclass(frozen=True, eq=False)
class AffineObservation(Generic[U_contra]):
    """y = H(u) x + d + e: regression on the state with regressors from the slice's inputs."""

    states: int  # p, columns of H
    H: Callable[[U_contra], Array]  # -> (m, p)
    R: Array  # (m, m) measurement noise
    d: Array | float = 0.0  # (m,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", frozen(self.R))
        if self.R.ndim != 2 or not (self.R.diagonal() >= 0.0).all():
            raise InputError("R has to be a covariance (m, m), with no variance below 0")

    @cached_property
    def linear(self) -> Mask:
        """All of it, (p,)."""
        return np.ones(self.states, dtype=bool)

    def observe(self, x: Array, u: U_contra) -> Array:
        """H x + d, one matrix product for all x, (..., p) -> (..., m)."""
        return x @ self.H(u).T + self.d

    def observe_jacobian(self, x: Array, u: U_contra) -> Array:
        """H, (m, p)."""
        return self.H(u)

    def observe_cov(self, u: U_contra) -> Array:
        """R, (m, m)."""
        return self.R


@dataclass(frozen=True, eq=False)
class AffineProcess(Generic[U_contra]):
    """x' = F x + b + w, the same in every slice whatever its inputs."""

    names: tuple[str, ...]  # n
    prior: Gaussian  # (n,), (n, n)
    F: Array  # (n, n)
    Q: Array  # (n, n) process noise
    b: Array | float = 0.0  # (n,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "F", frozen(self.F))
        object.__setattr__(self, "Q", frozen(self.Q))

    @cached_property
    def linear(self) -> Mask:
        """All of it, (n,)."""
        return np.ones(len(self.names), dtype=bool)

    def transition(self, x: Array, u: U_contra) -> Array:
        """F x + b, (..., n) -> (..., n)."""
        return x @ self.F.T + self.b

    def transition_jacobian(self, x: Array, u: U_contra) -> Array:
        """F, (n, n)."""
        return self.F

    def transition_cov(self, u: U_contra) -> Array:
        """Q, (n, n)."""
        return self.Q
