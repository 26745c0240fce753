"""The poses' information on all unknowns in a few matrices: least squares that add up.

sum w |e_i - A_i x|^2 = x' H x - 2 b' x + c      for place and turn separately
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from urdyn.identify.kinematics.placement import Placement, residuals, slopes
from urdyn.types import Array, Index

CHUNK = 600  # poses whose Jacobians are in memory at a time
BLOCKS = (slice(0, 3), slice(3, 6))  # place, turn


@dataclass(frozen=True, eq=False)
class Moments:
    """Moments of place and of turn: axis 0."""

    H: Array  # (2, P, P)
    b: Array  # (2, P)
    c: Array  # (2,)
    count: Array  # (2,) weighted count of measured numbers

    def __sub__(self, other: Moments) -> Moments:
        return Moments(
            self.H - other.H, self.b - other.b, self.c - other.c, self.count - other.count
        )

    def only(self, columns: Index) -> Moments:
        """The moments with all other unknowns zero."""
        return Moments(self.H[:, columns[:, None], columns], self.b[:, columns], self.c, self.count)

    def squares(self, x: Array) -> Array:
        """Residual sums of squares of place and turn, (2,) [m², rad²]."""
        return np.maximum(self.c - 2.0 * self.b @ x + (self.H @ x) @ x, 0.0)


def total(parts: Iterable[Moments]) -> Moments:
    """The moments of all poses together."""
    first, *rest = parts
    for part in rest:
        first = Moments(
            first.H + part.H, first.b + part.b, first.c + part.c, first.count + part.count
        )
    return first


def moments(
    placement: Placement,
    q: Array,
    place: Array,
    turn: Array,
    weight: Array,
) -> Moments:
    """Moments of poses about `placement`; `weight` (N,): probability of no gross error."""
    size = placement.size
    H, b = np.zeros((2, size, size)), np.zeros((2, size))
    c, count = np.zeros(2), np.zeros(2)
    for start in range(0, len(q), CHUNK):
        rows = slice(start, start + CHUNK)
        e = residuals(placement, q[rows], place[rows], turn[rows])
        A = slopes(placement, q[rows])
        for k, block in enumerate(BLOCKS):
            known = np.isfinite(e[:, block]).all(axis=1)
            root = np.sqrt(weight[rows][known])[:, None]
            left = (A[known, block] * root[:, :, None]).reshape(-1, size)
            right = (e[known, block] * root).ravel()
            H[k] += left.T @ left
            b[k] += left.T @ right
            c[k] += right @ right
            count[k] += 3.0 * float((root**2).sum())
    return Moments(H, b, c, count)
