"""A loop that rings: what an unstable controller does to the motion, told without the loop.

The inverse fidelity has no loop that could become unstable. It is given the outcome instead: past
the margins of gain and delay the joint swings about its trajectory, the wider the further past, up
to a limit cycle that saturated motors would set. The closed loop is where to look for the truth.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.simulate.schedule import Course
from urdyn.types import Array, Motion

GAIN_MARGIN = 2.0  # [-] times the usual gain
DELAY_MARGIN = 0.008  # [s], a cycle of a CB3, at the usual gain
FREQUENCY = 8.0  # [Hz]
AMPLITUDE = 2e-3  # [rad] of the limit cycle: 5 rad/s² at 8 Hz


def amplitude(course: Course) -> Array:
    """How wide each joint swings, (N, J) [rad]; 0 within the margins.

    Gain k and delay d use up the margins together: k (1 + (margin - 1) d / d_margin) = margin.
    """
    delayed = 1.0 + (GAIN_MARGIN - 1.0) * course.loop_delay[:, None] / DELAY_MARGIN
    beyond = np.maximum(course.loop_gain * delayed / GAIN_MARGIN - 1.0, 0.0)
    return np.asarray(AMPLITUDE * beyond / (1.0 + beyond))


def ringing(motion: Motion, course: Course) -> Motion:
    """The motion with A sin(w t) on top of it; A changes slowly beside w."""
    swing = amplitude(course)
    if not swing.any():
        return motion
    w = 2.0 * np.pi * FREQUENCY
    s, c = (swing * f(w * course.t)[:, None] for f in (np.sin, np.cos))
    return replace(
        motion,
        q=motion.q + s,
        v=motion.v + w * c,
        a=motion.a - w**2 * s,
        jerk=motion.jerk - w**3 * c,
    )
