"""Lines that follow the angle of a motor, at whatever speed: gears and motors make such.

A loop that rings keeps its phase to time, a gear to the angle of the motor that turns it. Where
speed varies but a little, one explains as much of a line as the other: nobody tells them apart
there. What a gear does to its joint shakes those beside it, too.
"""

from __future__ import annotations

import numpy as np

from urdyn.diagnose.swings import amplitude, by_quarter, without
from urdyn.model.friction import GEAR_RATIO
from urdyn.types import Array

SLOW = 0.05  # [rad/s] a joint that is never faster makes no line that is heard
# Of motor turns: the wave generator's two lobes meet a tooth of the housing's spline, or of that
# which turns with the joint, and a drive's torque has the pitch of its poles and slots.
GEAR = (1.0, 2.0 - 2.0 / GEAR_RATIO, 2.0, 4.0)
MOTOR = (8.0, 10.0, 12.0)  # too little to be felt in other joints
BINS = 1.5  # [-] of a window's resolution, within which a motor turns about a line


def beside(x: Array, t: Array, frequency: float, v: Array, joint: int) -> float:
    """Size of a line in a signal (n,) of this joint, beside what best follows a motor's angle.

    Only a motor that turns by about the line's frequency for half of the time makes one there.

    Args:
        frequency: of the line [Hz], which the joints themselves may swing at.
        v: speed of all joints, (n, J) [rad/s].
    """
    known = np.flatnonzero(np.isfinite(v).all(axis=0))
    v = without(v[:, known], t, by_quarter(t, frequency))
    turning, angles = GEAR_RATIO * np.abs(v) / (2.0 * np.pi), GEAR_RATIO * _angles(t, v)
    near, rate = BINS / (t[-1] - t[0]), (len(t) - 1) / (t[-1] - t[0])
    phases = [
        order * angles[:, k]
        for k in np.flatnonzero(np.abs(v).max(axis=0) > SLOW)
        for order in (GEAR + MOTOR if known[k] == joint else GEAR)
        if np.median(np.abs(_heard(order * turning[:, k], rate) - frequency)) < near
    ]
    swings = (np.column_stack([np.cos(phase), np.sin(phase)]) for phase in phases)
    left = (amplitude(without(x, t, swing), t, frequency) for swing in swings)
    return min(left, default=np.inf)


def _heard(f: Array, rate: float) -> Array:
    """As what rows of this rate hear these frequencies [Hz]: what is too quick is folded back."""
    return np.asarray(np.abs(f - rate * np.round(f / rate)))


def _angles(t: Array, v: Array) -> Array:
    """How far joints have turned at these speeds, (n, J) [rad]."""
    steps = 0.5 * (v[1:] + v[:-1]) * np.diff(t)[:, None]
    return np.concatenate([np.zeros((1, v.shape[1])), np.cumsum(steps, axis=0)])
