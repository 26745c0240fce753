"""Lines that follow a motor's angle, at whatever speed: those of gears and motors.

A loop that rings keeps its phase with time, a gear with the angle of its motor. Where speed varies
little, both explain a line equally and cannot be distinguished. A gear's vibration also shakes the
neighbouring joints.
"""

from __future__ import annotations

import numpy as np

from urdyn.diagnose.fast.swings import amplitude, by_quarter, without
from urdyn.model.friction import GEAR_RATIO
from urdyn.types import Array

SLOW = 0.05  # [rad/s] a joint that is never faster makes no detectable line
# Orders of motor turns: the wave generator's two lobes meet a tooth of the fixed spline, or of the
# one that turns with the joint, and a drive's torque ripples with its poles and slots.
GEAR = (1.0, 2.0 - 2.0 / GEAR_RATIO, 2.0, 4.0)
MOTOR = (8.0, 10.0, 12.0)  # too weak to show in other joints
BINS = 1.5  # [-] of a window's resolution, within which a motor turns about a line


def beside(x: Array, t: Array, frequency: float, v: Array, joint: int) -> float:
    """Size of a line in a signal (n,) of this joint, less what best follows a motor's angle.

    Only a motor that turns by about the line's frequency for half of the time makes one there.

    Args:
        frequency: of the line [Hz], at which the joints themselves may swing.
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
    """Frequencies [Hz] as they appear in rows of this rate: too high ones are aliased."""
    return np.asarray(np.abs(f - rate * np.round(f / rate)))


def _angles(t: Array, v: Array) -> Array:
    """How far joints have turned at these speeds, (n, J) [rad]."""
    steps = 0.5 * (v[1:] + v[:-1]) * np.diff(t)[:, None]
    return np.concatenate([np.zeros((1, v.shape[1])), np.cumsum(steps, axis=0)])
