"""Which of UR's types an arm is, whatever its URDF calls it: the driver's are called "ur".

Told by the distances from its shoulder to its flange in some poses, which depend neither on how it
is mounted nor on how frames are turned. Factory calibrations change them by 3 mm; between two types
one of them differs by 26 mm or more.
"""

from __future__ import annotations

import re
from functools import cache

import numpy as np

from urdyn.model.arm import Arm, load_arm
from urdyn.model.library import names
from urdyn.types import Array

UR = re.compile(r"ur\d+[a-z]?")
POSES = np.random.default_rng(0).uniform(-np.pi, np.pi, (16, 6))  # [rad]
ALIKE = 0.01  # [m]


def ur_type(arm: Arm) -> str:
    """Such as "ur5e": its name where that is a type's, else the library's arm of its dimensions.

    "" where there is none.
    """
    if UR.fullmatch(name := arm.name.lower()):
        return name
    if arm.joints != POSES.shape[1]:
        return ""
    off, nearest = min((float(np.abs(_reach(arm) - _known(name)).max()), name) for name in names())
    return nearest if off < ALIKE else ""


def _reach(arm: Arm) -> Array:
    """Distances from the shoulder to the flange, (16,) [m]."""
    between = arm.pose(POSES, arm.link_names[0])[:, :3, 3] - arm.pose(POSES)[:, :3, 3]
    return np.asarray(np.linalg.norm(between, axis=1))


@cache
def _known(name: str) -> Array:
    return _reach(load_arm(name))
