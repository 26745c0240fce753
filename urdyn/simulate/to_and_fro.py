"""One joint to and fro, as fast as allowed, so that its load changes sign again and again.

This motion shows a gap in its gear; all other joints are at rest.
"""

from __future__ import annotations

import numpy as np

from urdyn.model.arm import Arm
from urdyn.simulate.fourier import Series, at_rest
from urdyn.simulate.limits import comfortable, rated
from urdyn.simulate.trajectory import Trajectory, grid

PERIOD = 2.0 / 3.0  # [s]
SHARE = 0.9  # [-] of the maker's limits of velocity and acceleration


def to_and_fro(arm: Arm, joint: int, duration: float, rate: float) -> Trajectory:
    """A joint that swings about the arm's upright pose for `duration` [s] at `rate` [Hz]."""
    limits, t = rated(arm), grid(duration, rate)
    sine, cosine = at_rest(np.array([1.0, 0.0]), np.zeros(2))
    swing = Series(np.zeros(1), sine[:, None], cosine[:, None], PERIOD)
    v, a, _ = swing.peaks()
    share = SHARE * min(limits.velocity[joint] / v[0], limits.acceleration[joint] / a[0])
    motion = np.zeros((3, len(t), arm.joints))
    motion[0] = comfortable(arm).middle
    motion[:, :, joint] += np.array(swing.scaled(share).at(t))[..., 0]
    return Trajectory(t, *motion)
