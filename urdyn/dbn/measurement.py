"""A linear measurement of a few states, by something other than the joints' own sensors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from urdyn.types import Array, Gaussian, Index, Mask, freeze, frozen


@dataclass(frozen=True, eq=False)
class LinearMeasurement:
    """A slice in which no time passes: y = H x[at] + e, e ~ N(0, R).

    Just before it, the measured states may have jumped by `jump`.
    """

    dt: ClassVar[float] = 0.0  # [s]
    at: Index  # (a,) states
    H: Array  # (m, a)
    R: Array  # (m, m)
    jump: Array  # (a,) sd; 0: no jump

    def __post_init__(self) -> None:
        freeze(self, "H", "R", "jump")
        assert self.H.shape == (len(self.R), len(self.at)), "a row an observation"


@dataclass(frozen=True, eq=False)
class Standing:
    """Any model's states, at rest while they are measured; a `TwoSlice`."""

    names: tuple[str, ...]  # n
    prior: Gaussian  # (n,)

    @cached_property
    def linear(self) -> Mask:
        """All states, (n,)."""
        return np.ones(len(self.names), dtype=bool)

    @property
    def affine_transition(self) -> bool:
        """True: the transition is the identity."""
        return True

    @property
    def still(self) -> bool:
        """False: states may have jumped."""
        return False

    @cached_property
    def _still(self) -> Array:
        return frozen(np.eye(len(self.names)))

    def transition(self, x: Array, u: LinearMeasurement) -> Array:
        """x itself, (..., n)."""
        return x

    def transition_jacobian(self, x: Array, u: LinearMeasurement) -> Array:
        """Identity, (n, n)."""
        return self._still

    def transition_cov(self, u: LinearMeasurement) -> Array:
        """Covariance of the jumps, (n, n)."""
        Q = np.zeros((len(self.names),) * 2)
        Q[u.at, u.at] = u.jump**2
        return Q

    def observe(self, x: Array, u: LinearMeasurement) -> Array:
        """H x[at], (..., n) -> (..., m)."""
        return np.asarray(x[..., u.at] @ u.H.T)

    def observe_jacobian(self, x: Array, u: LinearMeasurement) -> Array:
        """H padded with zeros, (m, n)."""
        H = np.zeros((len(u.H), len(self.names)))
        H[:, u.at] = u.H
        return H

    def observe_cov(self, u: LinearMeasurement) -> Array:
        """R, (m, m)."""
        return u.R
