"""What each row of an observation is a function of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array, Index


@dataclass(frozen=True, eq=False)
class Arguments:
    """z_j = W_j x, the d arguments of row j: c combinations of states, and s states themselves."""

    combined: Array  # (m, c, p) of the p leading states
    states: Index  # (m, s)
    width: int  # of the states that any row depends on, which lead as well

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
        combined = x[..., :p] @ self.combined.reshape(-1, p).T
        return np.concatenate([combined.reshape(*x.shape[:-1], m, c), x[..., self.states]], axis=-1)

    def across(self, P: Array) -> Array:
        """W_j P, their covariance with the states, (n, n) -> (m, d, n)."""
        (m, c, p), n = self.combined.shape, len(P)
        out = np.empty((m, self.count, n))
        out[:, :c] = (self.combined.reshape(-1, p) @ P[:p]).reshape(m, c, n)
        out[:, c:] = P.take(self.states, axis=0)
        return out

    def within(self, across: Array) -> Array:
        """W_j P W_jᵀ, each row's own covariance, (m, d, d)."""
        m, c, p = self.combined.shape
        out = np.empty((m, self.count, self.count))
        out[:, :c] = self.combined @ across[..., :p].swapaxes(1, 2)
        out[:, c:] = across[self._row, :, self.states]
        return out

    def back(self, slope: Array) -> Array:
        """Slopes by states from those by arguments, (..., m, d) -> (..., m, width)."""
        c, p = self.combined.shape[1:]
        H = np.zeros((*slope.shape[:-1], self.width))
        H[..., :p] = (slope[..., None, :c] @ self.combined)[..., 0, :]
        H[..., self._row, self.states] += slope[..., c:]
        return H
