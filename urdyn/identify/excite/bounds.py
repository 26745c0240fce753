"""What a motion must keep to, as numbers that must not be above zero, and their slopes.

A Bound is dimensionless: 0 at the limit, -1 where nothing is asked of the arm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from urdyn.identify.excite.basis import Basis
from urdyn.identify.excite.columns import Columns
from urdyn.model.collision import Collider
from urdyn.simulate.limits import Limits
from urdyn.types import Array

SCALE = 0.1  # [m] that a distance is short of, where its bound is 1

Weighed = Callable[[Array], tuple[Array, Array, Array]]  # multipliers -> slopes in q, v, a


@dataclass(frozen=True)
class Bound:
    """Values (any,) and what their weighted sum is in the motion at the basis' times."""

    values: Array
    slopes: Weighed


def kinematic(limits: Limits, q: Array, v: Array, a: Array) -> Bound:
    """Angles, velocities, accelerations, from either side, (6, N, J)."""
    shares = np.array(
        [
            (q - limits.middle) / limits.room,
            v / limits.velocity,
            a / limits.acceleration,
        ]
    )

    def slopes(weights: Array) -> tuple[Array, Array, Array]:
        up = weights[:3] - weights[3:]
        return up[0] / limits.room, up[1] / limits.velocity, up[2] / limits.acceleration

    return Bound(np.concatenate([shares, -shares]) - 1.0, slopes)


def torques(limits: Limits, columns: Columns) -> tuple[Array, Callable[[Array], Array]]:
    """Torque over its limit from either side less 1, (2, N, J), and weights -> slope in load."""
    share = columns.load / limits.torque
    return np.array([share, -share]) - 1.0, lambda w: (w[0] - w[1]) / limits.torque


def clearances(collider: Collider, q: Array, margin: float) -> Bound:
    """Lack of distance over SCALE, (N, P); pairs that are far are all right, whatever moves."""
    near, slope = collider.slopes(q, margin + 2.0 * SCALE)
    zero = np.zeros_like(q)

    def slopes(weights: Array) -> tuple[Array, Array, Array]:
        return -np.einsum("np,npj->nj", weights, slope) / SCALE, zero, zero

    return Bound((margin - near) / SCALE, slopes)
