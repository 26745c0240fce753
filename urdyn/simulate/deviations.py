"""Kinematic deviations: no arm is built exactly as drawn.

Each joint's frame is, relative to the previous joint's, at

    place = a x + d R z,    R = R_x(roll) R_y(tilt) R_nominal

(Hayati's form where axes are parallel). Deviations of a, d, roll and tilt are as in factory
calibrations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.model.arm import Arm
from urdyn.model.geometry.origins import Origin, origins_of, with_origins
from urdyn.types import Array

# Standard deviations by joint, base first: 1.48 times the median absolute deviation of the factory
# calibrations of 12 arms (UR3 to UR16e) from their drawings; two arms deviate several times as far
# in roll and d of the parallel axes.
SPREAD = np.array(
    [
        [0.0, 2.7e-4, 0.0, 0.0],
        [1.6e-4, 0.0, 6.9e-4, 0.0],
        [3.3e-4, 0.0, 2.0e-3, 2.1e-3],
        [2.5e-4, 6.7e-4, 5.4e-3, 1.8e-3],
        [5e-5, 6e-5, 1.1e-3, 0.0],
        [8e-5, 3.4e-4, 8e-4, 0.0],
    ]
)


def draw_deviations(arm: Arm, rng: np.random.Generator) -> Array:
    """Random deviations of one arm in a, d, roll, tilt, (J, 4) [m, m, rad, rad]."""
    known = arm.joints == len(SPREAD)
    spread = SPREAD if known else np.broadcast_to(np.median(SPREAD, axis=0), (arm.joints, 4))
    return np.asarray(spread * rng.standard_normal((arm.joints, 4)))


def deviated(arm: Arm, deviations: Array) -> Arm:
    """The arm with its joints' frames moved by `deviations` (J, 4), and the same bodies."""
    pairs = zip(origins_of(arm), deviations, strict=True)
    return with_origins(arm, (_moved(*origin, deviation) for origin, deviation in pairs))


def frames(arm: Arm) -> list[dict[str, Any]]:
    """Each joint's frame in the previous link: xyz [m] and rpy [rad], as in a URDF."""
    return [
        {"name": name, "xyz": place.tolist(), "rpy": angles.tolist()}
        for name, (place, angles) in zip(arm.joint_names, origins_of(arm), strict=True)
    ]


def _moved(place: Array, angles: Array, deviation: Array) -> Origin:
    """A joint's origin, moved by a, d, roll and tilt (4,)."""
    turn = Rotation.from_euler("xyz", angles)
    d = along_axis(place, turn)
    tilted = Rotation.from_euler("yx", [deviation[3], deviation[2]]) * turn
    moved = place - d * turn.apply([0.0, 0.0, 1.0]) + [deviation[0], 0.0, 0.0]
    moved += (d + deviation[1]) * tilted.apply([0.0, 0.0, 1.0])
    return moved, tilted.as_euler("xyz")


def along_axis(place: Array, turn: Rotation) -> float:
    """d of a frame at `place` [m]: its component along the frame's own axis, apart from a x."""
    directions = np.column_stack([[1.0, 0.0, 0.0], turn.apply([0.0, 0.0, 1.0])])
    return float(np.linalg.lstsq(directions, place, rcond=None)[0][1])
