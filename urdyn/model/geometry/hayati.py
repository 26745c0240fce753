"""The coordinates of a serial arm's geometry: minimal, complete, well-conditioned.

Each joint's frame sits in the frame of the joint before it at

    T = Tx(a) Rx(alpha) Ry(beta) Tz(d) Rz(theta)

beta belongs to an axis that is parallel to the one before it on the drawing, where the foot of the
common normal, and with it d, is anywhere [Hayati1983]_; elsewhere it is zero [Craig2005]_. Along a
run of parallel axes only the sum of their d can be seen: the last of the run has it. The base fixes
the first axis, so that joint has d and theta alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.errors import ArmError
from urdyn.model.geometry.turns import places_of
from urdyn.types import Array, Mask, freeze

KINDS = ("a", "alpha", "beta", "d", "theta")  # of one joint, in the order of the motions above
UNITS = ("m", "rad", "rad", "m", "rad")
PARALLEL = 0.2  # [rad] axes that lie closer on the drawing are meant to be parallel
DRAWN = 1e-3  # [m] a frame that lies farther from a x + d z follows another convention


@dataclass(frozen=True, eq=False)
class Form:
    """Which coordinates an arm's geometry has, and their values on the drawing."""

    joint_names: tuple[str, ...]  # base first
    nominal: Array  # (J, 5) a, alpha, beta, d, theta of the drawing [m, rad]
    free: Mask  # (J, 5) those that are coordinates; the others stay as drawn

    def __post_init__(self) -> None:
        freeze(self, "nominal")

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates: "elbow_joint.beta"."""
        return tuple(f"{self.joint_names[j]}.{KINDS[k]}" for j, k in np.argwhere(self.free))

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        return tuple(UNITS[k] for _, k in np.argwhere(self.free))

    def table(self, deviations: Array) -> Array:
        """(J, 5) a ... theta of the arm that is `deviations` (P,) off the drawing."""
        values = np.array(self.nominal)
        values[self.free] += deviations
        return values


def form_of(joint_names: tuple[str, ...], origins: Array) -> Form:
    """The coordinates of an arm whose drawing puts joints' frames at `origins` (J, 4, 4)."""
    nominal = decompose(origins)
    parallel = np.abs(origins[:, 2, 2]) > np.cos(PARALLEL)
    free = np.ones(nominal.shape, dtype=np.bool_)
    free[:, 2] = parallel
    free[0, :3] = False
    free[:-1, 3] &= ~parallel[1:]
    free[0, 3] = True
    return Form(joint_names, nominal, free)


def decompose(origins: Array) -> Array:
    """(J, 5) a, alpha, beta, d, theta of frames (J, 4, 4) in the frames before them."""
    R, place = origins[:, :3, :3], origins[:, :3, 3]
    beta = np.arcsin(np.clip(R[:, 0, 2], -1.0, 1.0))
    alpha = np.arctan2(-R[:, 1, 2], R[:, 2, 2])
    theta = np.arctan2(-R[:, 0, 1], R[:, 0, 0])
    d = place[:, 1] * R[:, 1, 2] + place[:, 2] * R[:, 2, 2]
    d /= R[:, 1, 2] ** 2 + R[:, 2, 2] ** 2
    a = place[:, 0] - d * R[:, 0, 2]
    return np.stack([a, alpha, beta, d, theta], axis=1)


def require_drawn(origins: Array, name: str) -> None:
    """ArmError where a frame is where the five coordinates cannot put it."""
    rest = np.linalg.norm((places_of(decompose(origins)) - origins)[:, :3, 3], axis=1)
    if (rest > DRAWN).any():
        raise ArmError(
            f"{name}: joint {rest.argmax()} lies {1e3 * rest.max():.1f} mm beside the common "
            "normal of its axis and the one before; give the frames of the maker's description"
        )
