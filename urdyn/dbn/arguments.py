"""The arguments of which each row of an observation is a function."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.types import Array, Index, Mask, freeze


@dataclass(frozen=True, eq=False)
class Held:
    """States that no observation depends on: it is evaluated with them held at fixed values."""

    values: Array  # (n,) of these states; NaN: the observation depends on the state

    def __post_init__(self) -> None:
        freeze(self, "values")

    @cached_property
    def seen(self) -> Mask:
        """The states that observations depend on, (n,)."""
        return np.isnan(self.values)

    def instead(self, x: Array) -> Array:
        """The n leading states, with held ones replaced, (..., n or more) -> (..., n)."""
        return np.where(self.seen, x[..., : len(self.values)], self.values)


@dataclass(frozen=True, eq=False)
class Arguments:
    """z_j = W_j x, the d arguments of row j: c combinations of states, and s single states."""

    combined: Array  # (m, c, p) of the p leading states
    states: Index  # (m, s)
    width: int  # number of leading states that any row depends on
    held: Held | None = None  # those of them that no row depends on after all

    @property
    def count(self) -> int:
        """d."""
        return int(self.combined.shape[1] + self.states.shape[1])

    @property
    def _row(self) -> Index:
        return np.arange(len(self.states))[:, None]

    def of(self, x: Array) -> Array:
        """z, (..., n) -> (..., m, d)."""
        m, c, p = self.combined.shape
        x = x if self.held is None else self.held.instead(x)
        combined = x[..., :p] @ self.combined.reshape(-1, p).T
        return np.concatenate([combined.reshape(*x.shape[:-1], m, c), x[..., self.states]], axis=-1)

    def across(self, P: Array) -> Array:
        """W_j P, the arguments' covariance with the states, (n, n) -> (m, d, n)."""
        (m, c, p), n = self.combined.shape, len(P)
        out = np.empty((m, self.count, n))
        P = P if self.held is None else P[: self.width] * self.held.seen[:, None]
        out[:, :c] = (self.combined.reshape(-1, p) @ P[:p]).reshape(m, c, n)
        out[:, c:] = P.take(self.states, axis=0)
        return out

    def within(self, across: Array) -> Array:
        """W_j P W_jᵀ, each row's own covariance, (m, d, d)."""
        m, c, p = self.combined.shape
        out = np.empty((m, self.count, self.count))
        across = across if self.held is None else across[..., : self.width] * self.held.seen
        out[:, :c] = self.combined @ across[..., :p].swapaxes(1, 2)
        out[:, c:] = across[self._row, :, self.states]
        return out

    def back(self, slope: Array) -> Array:
        """Derivatives in the states from those in the arguments, (..., m, d) -> (..., m, width)."""
        c, p = self.combined.shape[1:]
        H = np.zeros((*slope.shape[:-1], self.width))
        H[..., :p] = (slope[..., None, :c] @ self.combined)[..., 0, :]
        H[..., self._row, self.states] += slope[..., c:]
        return H if self.held is None else H * self.held.seen
