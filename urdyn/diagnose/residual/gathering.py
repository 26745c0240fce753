"""The moments of an unfinished block."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.residual.moment import Pool
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class Gathering:
    """Their joint information."""

    A: Array  # (n, n)
    b: Array  # (n,)
    warm: Array  # (3, J) sum over moments
    moments: int = 0
    begin: float = np.nan  # [s] of the block; NaN: none
    end: float = np.nan  # [s] of the last moment
    # (n, n), (n,) what another load removed from A and b, in a block that began with one
    laden: tuple[Array, Array] | None = None
    lost: Array | float = 0.0  # as `friction.lost` has it

    @property
    def warmth(self) -> Array:
        """Mean warmth of the joints, (3, J)."""
        return self.warm / self.moments

    @property
    def unladen(self) -> Gathering:
        """The same as if no other load had been carried."""
        A, b = self.laden or (0.0, 0.0)
        return replace(self, A=self.A + A, b=self.b + b, laden=None)

    def usually(self, more: Array) -> Gathering:
        """With another usual load, whose states differ by `more`, (n,)."""
        if self.laden is None:
            return self
        A, b = self.laden
        return replace(self, laden=(A, b - A @ more))

    def bearing(self, usual: Pool, left: Pool) -> Gathering:
        """Add what another load removes from a new moment, where the block began with one.

        Args:
            usual: the moment under the usual load.
            left: what the other load leaves of it.
        """
        if self.moments and self.laden is None:
            return self
        A, b = self.laden or (0.0, 0.0)
        return replace(self, laden=(A + usual.A - left.A, b + usual.b - left.b))

    def after(self, pool: Pool, begin: float, end: float, lost: Array) -> Gathering:
        """Add one moment, from begin to end [s]."""
        return replace(
            self,
            A=self.A + pool.A,
            b=self.b + pool.b,
            warm=self.warm + pool.warm,
            lost=self.lost + lost,
            moments=self.moments + 1,
            begin=begin if np.isnan(self.begin) else self.begin,
            end=end,
        )


def none_gathered(n: int, joints: int) -> Gathering:
    """No block begun, of n states."""
    return Gathering(np.zeros((n, n)), np.zeros(n), np.zeros((3, joints)))
