"""How much of a signature slow noise absorbs before innovations show the rest.

A filter with slow noise among its states attributes part of an unmodelled change to that. With psi
the change's row in the white currents and w that of slow noise, the innovations show of one unit
of the change [Willsky1976]_

    phi = psi - w tau,    tau' = exp(-dt / MEMORY) (tau + k phi),

where tau is what slow noise has absorbed so far, and k the gain of a filter that knows all else.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from urdyn.dbn.robot_slice import RobotSlice
from urdyn.identify.slow import MEMORY
from urdyn.types import Array, Mask, changed, freeze


@dataclass(frozen=True, eq=False)
class SlowNoiseAbsorption:
    """What slow noise has absorbed of k signatures in each joint's current."""

    taken: Array  # (J, k) tau [A]
    variance: Array  # (J,) of slow noise, as such a filter knows it [A²]

    def __post_init__(self) -> None:
        freeze(self, "taken", "variance")


def no_absorption(joints: int, signatures: int) -> SlowNoiseAbsorption:
    """The absorption of changes that begin now."""
    return SlowNoiseAbsorption(np.zeros((joints, signatures)), np.zeros(joints))


def after_absorption(
    before: SlowNoiseAbsorption, white: RobotSlice, rows: Array, known: Mask, dt: float
) -> tuple[Array, SlowNoiseAbsorption]:
    """What innovations show of signatures, (J, k) [A], and the absorption after them.

    Args:
        white: the whitened slice; its slow noise is known.
        rows: the signatures in its currents, (J, k) [A].
        known: joints whose current was measured, (J,).
    """
    assert white.stray is not None, "slow noise is known"
    w, kept = white.one, exp(-dt / MEMORY)
    variance = kept**2 * before.variance + (1.0 - kept**2) * white.stray**2
    covariance = w * variance  # of slow noise with its part of the current
    gain = known * covariance / (w * covariance + white.power)
    taken = kept * before.taken
    left = rows - w[:, None] * taken
    taken, variance = taken + gain[:, None] * left, variance - gain * covariance
    return left, changed(before, taken=taken, variance=variance)
