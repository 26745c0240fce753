"""A moment's information given a load: about the load itself, and about the arm that carries it.

A gear's losses reverse with its load, so that a moment is linear near one load alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.load import carried
from urdyn.diagnose.load.carried import Mode, Shown
from urdyn.diagnose.load.carrying import Waiting
from urdyn.diagnose.residual.moment import Pool, laden, pooled
from urdyn.diagnose.residual.space import Space
from urdyn.types import Array, Index

Belief = tuple[Array, Array]  # mean (n,) and covariance (n, n) of the states of the space


@dataclass(frozen=True, eq=False)
class GivenLoad:
    """The information in a moment: about the load, and about the arm given a load."""

    space: Space

    @cached_property
    def rest(self) -> Index:
        """Indices of all states but the payload's."""
        return np.setdiff1d(np.arange(self.space.size), self.space.payload)

    @cached_property
    def _rests(self) -> tuple[Index, Index]:
        return self.rest[:, None], self.rest[None]

    def pool(self, moment: Waiting, m: Array) -> Pool:
        """The information in a moment of an arm that carries m in addition, inertials (10,)."""
        if not m.any():
            return moment.pool
        return pooled(laden(moment.means, self.space.reference.drive, m))

    def shown(self, moment: Waiting, belief: Belief, m: Array) -> Shown:
        """A moment's information about the load, near m."""
        return self.said(self.pool(moment, m), belief, m)

    def told(self, moment: Waiting, belief: Belief, modes: Sequence[Mode]) -> Waiting:
        """The moment with that information near each mode."""
        return replace(moment, told=tuple(self.shown(moment, belief, k.mean) for k in modes))

    def unladen(self, pool: Pool, mode: Mode, usual: bool) -> Pool:
        """A moment's information about all states; none about the payload while another is carried.

        Args:
            pool: of an arm that carries the mode.
            usual: the mode is the one usually carried.
        """
        if usual:
            return pool
        at = self.space.payload
        cov = carried.alike(carried.spread(mode)).cov
        cross = pool.A[:, at]
        inner = np.linalg.solve(np.eye(len(at)) + cov @ pool.A[np.ix_(at, at)], cov)
        A = pool.A - cross @ inner @ cross.T
        b = pool.b - cross @ inner @ pool.b[at]
        A[at] = A[:, at] = b[at] = 0.0
        return replace(pool, A=0.5 * (A + A.T), b=b)

    def unsure(self, A: Array, belief: Belief, moments: int) -> Array:
        """Variance to which some moments of an unladen arm would determine any load, (10,).

        Args:
            A: information in one moment, (n, n).
        """
        nobodys = np.zeros(len(carried.ANYTHING))
        told = self.said(Pool(A, np.zeros(len(A)), 0.0, nobodys), belief, nobodys).C
        return np.diag(np.linalg.inv(moments * told + carried.PRIOR))

    def said(self, pool: Pool, belief: Belief, m: Array) -> Shown:
        """Information about the load in moments of an arm that carries m."""
        x, P = belief[0][self.rest], belief[1][self._rests]
        return carried.shown(pool, self.space.payload, self.rest, x, P, m)
