"""Models that are affine in their state: on these every filter equals the Kalman filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from urdyn.dbn.two_slice import U_contra
from urdyn.errors import InputError
from urdyn.given import given_belief, given_count, given_covariance, given_each, given_names
from urdyn.types import Array, Gaussian, Mask


def _one_or(values: Array | float, what: str, n: int) -> None:
    """InputError unless these are n values, or one for all."""
    shape = np.shape(values)
    if shape not in ((), (1,), (n,)):
        raise InputError(f"{what} has the shape {shape}; it has to be {(n,)}, or one for all")


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
        _one_or(self.d, "d", len(self.R))
        given_each(self.d, "d", np.shape(self.d))

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


@dataclass(frozen=True, eq=False)
class AffineProcess(Generic[U_contra]):
    """x' = F x + b + w, the same in every slice whatever its inputs."""

    names: tuple[str, ...]  # n
    prior: Gaussian  # (n,), (n, n)
    F: Array  # (n, n)
    Q: Array  # (n, n) process noise
    b: Array | float = 0.0  # (n,)

    def __post_init__(self) -> None:
        n = len(self.names)
        given_names(self.names)
        object.__setattr__(self, "prior", given_belief(self.prior, "the prior", n))
        object.__setattr__(self, "F", given_each(self.F, "F", (n, n)))
        known = float(self.prior.cov.diagonal().max(initial=0.0))
        object.__setattr__(self, "Q", given_covariance(self.Q, "Q", n, beside=known))
        _one_or(self.b, "b", n)
        given_each(self.b, "b", np.shape(self.b))

    @cached_property
    def linear(self) -> Mask:
        """All states, (n,)."""
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
