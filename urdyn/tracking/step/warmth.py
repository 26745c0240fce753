"""Temperature of a joint's lubricant, which has no sensor: it follows the joint's."""

from __future__ import annotations

from math import exp

import numpy as np

from urdyn.tracking.belief.model import LAG
from urdyn.types import Array


def warmed(lubricant: Array, joint: Array, dt: float) -> Array:
    """Lubricant (J,) [°C] after `dt` [s] at the joints' temperatures (J,) [°C]; NaN: unknown.

        lag dL/dt = T - L

    It starts as warm as the joint when that is first measured, and stays constant while that is
    not measured.
    """
    followed = joint + exp(-dt / LAG) * (lubricant - joint)
    return np.where(np.isnan(followed), np.fmax(lubricant, joint), followed)
