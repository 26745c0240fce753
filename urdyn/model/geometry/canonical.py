"""Any six frames as coordinates: the same axes, with frames where the convention wants them."""

from __future__ import annotations

import numpy as np

from urdyn.errors import ArmError
from urdyn.model.geometry.hayati import Form, decompose
from urdyn.model.geometry.turns import places_of, pose_of
from urdyn.types import Array, Mask

LEAST = 1e-9  # [-] sine of the angle below which axes have no unique common normal
UPRIGHT = 1e-9  # [m, rad] how far the first axis may be off the base's z


def coordinates(form: Form, origins: Array) -> Array:
    """(J, 5) a ... theta in `form` of an arm whose joints' frames are `origins` (J, 4, 4).

    Poses of the last frame are unchanged; the frames between move along and about their axes.
    """
    table = decompose(_moved(origins, form.nominal, form.free[:, 2]))
    turned = 2.0 * np.pi * np.round((table[:, 4] - form.nominal[:, 4]) / (2.0 * np.pi))
    table[:, 4] -= turned
    table[:, 1] -= 2.0 * np.pi * np.round((table[:, 1] - form.nominal[:, 1]) / (2.0 * np.pi))
    return table


def _moved(origins: Array, nominal: Array, parallel: Mask) -> Array:
    """The frames again, each on its axis where the next joint's convention wants it, (J, 4, 4)."""
    chain = np.array([np.eye(4), *_chained(origins)])
    _require_upright(chain[1])
    moved = [chain[0]]
    for j in range(1, len(chain) - 1):
        z, place = chain[j, :3, 2], chain[j, :3, 3]
        ahead, there = chain[j + 1, :3, 2], chain[j + 1, :3, 3]
        foot, x = (
            _beside(moved[-1], place, z, there, ahead, nominal[j - 1, 3])
            if parallel[j]
            else _foot(place, z, there, ahead, moved[-1], nominal[j - 1, 3])
        )
        drawn = moved[-1] @ places_of(nominal[j - 1 : j])[0]
        x = x * np.sign(x @ drawn[:3, 0])
        moved.append(pose_of(foot, np.column_stack([x, np.cross(z, x), z])))
    moved.append(chain[-1])
    back = np.linalg.inv(np.array(moved[:-1]))
    return np.asarray(back @ np.array(moved[1:]))


def _chained(origins: Array) -> list[Array]:
    """Frames (4, 4) in the base at zero angles."""
    chain = [np.eye(4)]
    for origin in origins:
        chain.append(chain[-1] @ origin)
    return chain[1:]


def _beside(
    before: Array, place: Array, z: Array, there: Array, ahead: Array, d: float
) -> tuple[Array, Array]:
    """Origin and x of a frame whose next axis is parallel to its own: d is as drawn."""
    x, origin = before[:3, 0], before[:3, 3]
    foot = _nearest(place, z, origin, x) + d * z
    level = there + ahead * (((foot - there) @ z) / (ahead @ z))
    return foot, _unit(level - foot)


def _foot(
    place: Array, z: Array, there: Array, ahead: Array, before: Array, d: float
) -> tuple[Array, Array]:
    """Origin and x of a frame on the common normal of its axis and the next."""
    normal = np.cross(z, ahead)
    if np.linalg.norm(normal) < LEAST:  # exactly parallel: any normal will do
        return _beside(before, place, z, there, ahead, d)
    return _nearest(place, z, there, ahead), _unit(normal)


def _nearest(place: Array, z: Array, there: Array, ahead: Array) -> Array:
    """The point of a line that is nearest to another line."""
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
