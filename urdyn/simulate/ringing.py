"""A ringing loop: the effect of an unstable controller on the motion, without the loop.

The inverse fidelity has no loop that could become unstable. It imposes the outcome instead: beyond
the margins of gain and delay, the joint oscillates about its trajectory, with an amplitude that
grows to that of the limit cycle of saturated motors. For realism, use the closed loop.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.simulate.schedule import Course
from urdyn.types import Array, Motion

GAIN_MARGIN = 2.0  # [-] of the usual gain
DELAY_MARGIN = 0.008  # [s] at the usual gain: one cycle of a CB3
FREQUENCY = 8.0  # [Hz]
AMPLITUDE = 2e-3  # [rad] of the limit cycle: 5 rad/s² at 8 Hz


def amplitude(course: Course) -> Array:
    """Amplitude of each joint's oscillation, (N, J) [rad]; 0 within the margins.

    Gain k and delay d use up the margins together: k (1 + (margin - 1) d / d_margin) = margin.
    """
    delayed = 1.0 + (GAIN_MARGIN - 1.0) * course.loop_delay[:, None] / DELAY_MARGIN
    beyond = np.maximum(course.loop_gain * delayed / GAIN_MARGIN - 1.0, 0.0)
    return np.asarray(AMPLITUDE * beyond / (1.0 + beyond))


def ringing(motion: Motion, course: Course) -> Motion:
    """The motion plus A sin(w t), with A slow compared to w."""
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
