"""How warm a joint's lubricant is, of which nobody has a sensor: it follows the joint."""

from __future__ import annotations

from math import exp

import numpy as np

from urdyn.tracking.model import LAG
from urdyn.types import Array


def warmed(lubricant: Array, joint: Array, dt: float) -> Array:
    """Lubricant (J,) [°C] after `dt` [s] beside joints (J,) [°C]; NaN: unknown.

        lag dL/dt = T - L

    It is taken to be as warm as the joint when that is first measured, and stays where it is while
    it is not.
    """
    followed = joint + exp(-dt / LAG) * (lubricant - joint)
    return np.where(np.isnan(followed), np.fmax(lubricant, joint), followed)
