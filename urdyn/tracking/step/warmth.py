"""Temperature of a joint's lubricant, which has no sensor: it follows the joint's."""

from __future__ import annotations

import numpy as np

from urdyn.tracking.belief.model import LAG
from urdyn.types import Array

FASTEST = 0.01  # [K/s] of a joint that was just switched on or off: 18 K over half an hour


def warmed(lubricant: Array, joint: Array, dt: float) -> Array:
    """Lubricant (J,) [°C] after `dt` [s] at the joints' temperatures (J,) [°C]; NaN: unknown.

        lag dL/dt = T - L

    It starts as warm as the joint when that is first measured, and stays constant while that is
    not measured.
    """
    followed = joint + np.exp(-at_least(lubricant, joint, dt) / LAG) * (lubricant - joint)
    return np.where(np.isnan(followed), np.fmax(lubricant, joint), followed)


def at_least(lubricant: Array, joint: Array, dt: float) -> Array:
    """Time since the lubricant was that warm, (J,) [s], of which stamps tell `dt`.

    A clock that restarts with its robot does not tell how long that was off; its joints do. They
    were within FASTEST lag of their lubricants, and went no further than FASTEST times the time.
    """
    return np.fmax(dt, np.abs(joint - lubricant) / FASTEST - LAG)
