"""Any six frames as coordinates: the same axes, with frames where the convention wants them."""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from urdyn.errors import ArmError
from urdyn.model.geometry.hayati import Form, decompose
from urdyn.model.geometry.turns import places_of, pose_of
from urdyn.types import Array, Mask

LEAST = 1e-9  # [-] sine of the angle below which axes have no unique common normal
UPRIGHT = 1e-9  # [m, rad] how far the first axis may be off the base's z
TURNING = [1, 4]  # alpha and theta, which are the same angle after a whole turn

Line = tuple[Array, Array]  # a point (3,) [m], and a direction (3,) of length 1


def coordinates(form: Form, origins: Array) -> Array:
    """(J, 5) a ... theta in `form` of an arm whose joints' frames are `origins` (J, 4, 4).

    Poses of the last frame are unchanged; the frames between move along and about their axes.
    """
    table = decompose(_moved(origins, form.nominal, form.free[:, 2]))
    off = table[:, TURNING] - form.nominal[:, TURNING]
    table[:, TURNING] -= 2.0 * np.pi * np.round(off / (2.0 * np.pi))
    return table


def _moved(origins: Array, nominal: Array, parallel: Mask) -> Array:
    """The frames again, each on its axis where the next joint's convention wants it, (J, 4, 4)."""
    chain = np.array([*accumulate(origins, np.matmul, initial=np.eye(4))])  # in the base
    _require_upright(chain[1])
    moved = [chain[0]]
    for j in range(1, len(chain) - 1):
        own, ahead = ((chain[k, :3, 3], chain[k, :3, 2]) for k in (j, j + 1))
        placed = _beside if parallel[j] else _foot
        foot, x = placed(moved[-1], own, ahead, nominal[j - 1, 3])
        drawn = moved[-1] @ places_of(nominal[j - 1 : j])[0]
        x, z = x * np.sign(x @ drawn[:3, 0]), own[1]
        moved.append(pose_of(foot, np.column_stack([x, np.cross(z, x), z])))
    moved.append(chain[-1])
    back = np.linalg.inv(np.array(moved[:-1]))
    return np.asarray(back @ np.array(moved[1:]))


def _beside(before: Array, own: Line, ahead: Line, d: float) -> tuple[Array, Array]:
    """Origin and x of a frame whose next axis is parallel to its own: d is as drawn."""
    (_, z), (there, along) = own, ahead
    foot = _nearest(own, (before[:3, 3], before[:3, 0])) + d * z
    level = there + along * (((foot - there) @ z) / (along @ z))
    return foot, _unit(level - foot)


def _foot(before: Array, own: Line, ahead: Line, d: float) -> tuple[Array, Array]:
    """Origin and x of a frame on the common normal of its axis and the next."""
    normal = np.cross(own[1], ahead[1])
    if np.linalg.norm(normal) < LEAST:  # exactly parallel: any normal will do
        return _beside(before, own, ahead, d)
    return _nearest(own, ahead), _unit(normal)


def _nearest(line: Line, other: Line) -> Array:
    """The point of a line that is nearest to another line."""
    (place, z), (there, ahead) = line, other
    normal = np.cross(z, ahead)
    along = np.linalg.det(np.array([there - place, ahead, normal])) / (normal @ normal)
    return np.asarray(place + along * z)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


def _require_upright(first: Array) -> None:
    """ArmError where the first axis is not the base's z: that is the mounting, not the arm."""
    off = max(np.abs(first[:2, 3]).max(), np.abs(first[:2, 2]).max())
    if off > UPRIGHT:
        raise ArmError(
            f"the first axis lies {1e3 * off:.3g} mm or mrad beside the base's z; "
            "a base that is tilted belongs into the mounting"
        )
