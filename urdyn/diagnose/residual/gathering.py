"""The moments of an unfinished block."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.residual.moment import Pool
from urdyn.types import Array

NOTHING = 1e-9  # [-] of the information on single states, on a combination of them


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
    each: tuple[tuple[float, Array], ...] = ()  # moments: middle [s] and information, (n, n)

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
            each=(*self.each, (0.5 * (begin + end), pool.A)),
        )

    def since(self, t: Array) -> Array:
        """The mean shift as which a unit of each state since each of these times shows, (k, n, n).

        By information, not by time: from a change d on A' d is added to b, so it is A^-1 A' d.

        Args:
            t: (k,) [s].
        """
        whole = np.sum([A for _, A in self.each], axis=0)
        late = np.array([np.sum([(at > s) * A for at, A in self.each], axis=0) for s in t])
        var = whole.diagonal()
        sd = np.sqrt(np.divide(1.0, var, out=np.zeros_like(var), where=var > 0.0))
        inverse = np.linalg.pinv(whole * np.outer(sd, sd), NOTHING, hermitian=True)
        return np.asarray((inverse * np.outer(sd, sd)) @ late)


def none_gathered(n: int, joints: int) -> Gathering:
    """No block begun, of n states."""
    return Gathering(np.zeros((n, n)), np.zeros(n), np.zeros((3, joints)))
