"""Moments at random: what they show about an arm is all that motion can show."""

from __future__ import annotations

import numpy as np

from urdyn.model.arm import Arm
from urdyn.types import Array

MOMENTS = 400  # many more than an arm has parameters, at one row per joint


def generic_moments(
    arm: Arm, rng: np.random.Generator | None = None, count: int = MOMENTS
) -> tuple[Array, Array, Array]:
    """q anywhere within the joints' limits, v and a of unit spread, (count, J) each in SI units.

    Args:
        rng: the same moments at every call where none is given.
    """
    rng = rng or np.random.default_rng(0)
    q = rng.uniform(arm.lower, arm.upper, (count, arm.joints))
    v, a = rng.standard_normal((2, count, arm.joints))
    return q, v, a
