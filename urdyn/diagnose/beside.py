"""What a moment says beside a load: of the load itself, and of the arm that carries it.

What a gear loses turns over with its load, so that a moment is linear near one load alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose import carried
from urdyn.diagnose.carried import Mode, Shown
from urdyn.diagnose.carrying import Waiting
from urdyn.diagnose.moment import Pool, laden, pooled
from urdyn.diagnose.space import Space
from urdyn.types import Array, Index

Belief = tuple[Array, Array]  # mean (n,) and covariance (n, n) of the states of the space


@dataclass(frozen=True, eq=False)
class Beside:
    """The information in a moment: about the load, and about the arm beside a load."""

    space: Space

    @cached_property
    def rest(self) -> Index:
        """Places of all states but the payload's."""
        return np.setdiff1d(np.arange(self.space.size), self.space.payload)

    @cached_property
    def _rests(self) -> tuple[Index, Index]:
        return self.rest[:, None], self.rest[None]

    def pool(self, moment: Waiting, m: Array) -> Pool:
        """The information in a moment of an arm that carries m besides, inertials (10,)."""
        if not m.any():
            return moment.pool
        return pooled(laden(moment.means, self.space.reference.drive, m))

    def shown(self, moment: Waiting, belief: Belief, m: Array) -> Shown:
        """What a moment says of the load, near m."""
        return self.said(self.pool(moment, m), belief, m)

    def told(self, moment: Waiting, belief: Belief, modes: Sequence[Mode]) -> Waiting:
        """A moment that says this near each mode."""
        return replace(moment, told=tuple(self.shown(moment, belief, k.mean) for k in modes))

    def unladen(self, pool: Pool, mode: Mode, usual: bool) -> Pool:
        """What a moment says of all states; of the payload nothing while another one is carried.

        Args:
            pool: of an arm that carries the mode.
            usual: the mode is what is carried as a rule.
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
        """How well some moments of an unladen arm would tell any load, variance (10,).

        Args:
            A: information in one, (n, n).
        """
        nobodys = np.zeros(len(carried.ANYTHING))
        told = self.said(Pool(A, np.zeros(len(A)), 0.0, nobodys), belief, nobodys).C
        return np.diag(np.linalg.inv(moments * told + np.diag(carried.ANYTHING**-2.0)))

    def said(self, pool: Pool, belief: Belief, m: Array) -> Shown:
        """What moments of an arm that carries m say of the load."""
        x, P = belief[0][self.rest], belief[1][self._rests]
        return carried.shown(pool, self.space.payload, self.rest, x, P, m)
