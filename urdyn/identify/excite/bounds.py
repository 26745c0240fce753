"""Constraints on a motion: numbers that must not be above zero, and their gradients.

Every bound is dimensionless: 0 at the limit, -1 at no load. With the values comes a function from
weights of the same shape to the gradient of their weighted sum.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdyn.identify.excite.columns import Columns
from urdyn.identify.excite.proof import QVA
from urdyn.model.arm import Arm
from urdyn.model.collision import Collider
from urdyn.simulate.limits import Limits
from urdyn.types import Array

SCALE = 0.1  # [m] shortfall of a distance at which its bound is 1


def kinematic(limits: Limits, motion: QVA) -> tuple[Array, Callable[[Array], QVA]]:
    """Bounds on q, v, a from either side, (6, N, J); gradients in each, (N, J)."""
    q, v, a = motion
    scales = np.array([limits.room, limits.velocity, limits.acceleration])[:, None]
    shares = np.array([q - limits.middle, v, a]) / scales

    def slopes(weights: Array) -> QVA:
        dq, dv, da = (weights[:3] - weights[3:]) / scales
        return dq, dv, da

    return np.concatenate([shares, -shares]) - 1.0, slopes


def torques(limits: Limits, columns: Columns) -> tuple[Array, Callable[[Array], Array]]:
    """Bounds on torque from either side, (2, N, J); gradient in the load, (N, J)."""
    share = columns.load / limits.torque

    def slopes(weights: Array) -> Array:
        return np.asarray((weights[0] - weights[1]) / limits.torque)

    return np.array([share, -share]) - 1.0, slopes


def holding(arm: Arm, limits: Limits, q: Array) -> tuple[Array, Callable[[Array], Array]]:
    """Bounds on static torque from either side, (2, N, J); gradient in angles, (N, J)."""
    still = np.zeros_like(q)
    share = arm.torque(q, still, still) / limits.torque
    slope = arm.torque_derivatives(q, still, still)[0] / limits.torque[:, None]

    def slopes(weights: Array) -> Array:
        return np.asarray(np.einsum("nk,nkj->nj", weights[0] - weights[1], slope))

    return np.array([share, -share]) - 1.0, slopes


def clearances(
    collider: Collider, q: Array, apart: Array
) -> tuple[Array, Callable[[Array], Array]]:
    """How far each pair falls short of `apart` (P,) [m], (N, P); gradient in angles, (N, J)."""
    near, slope = collider.slopes(q, float(apart.max(initial=0.0)) + SCALE)
    return (apart - near) / SCALE, lambda w: -np.einsum("np,npj->nj", w, slope) / SCALE
