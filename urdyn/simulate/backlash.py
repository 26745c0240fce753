"""Backlash on the motor side: the gap opens whenever the load changes sign.

The load leaves one flank, and the motor is unloaded until the rotor has crossed to the other.
Accelerated by the torque f that friction no longer takes, the crossing lasts, from rest,

    T = sqrt(4 b I_r / f)        over the whole gap 2 b

A load that keeps its sign, like gravity's, never shows a gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.model.drive import Drive
from urdyn.types import Array, Mask


@dataclass(frozen=True, eq=False)
class Flanks:
    """The flank on which each joint's gear is in contact, and since when."""

    side: Array  # (J,) [-], sign of the load
    since: Array  # (J,) [s]


def first_flanks(joints: int) -> Flanks:
    """Gears before the first row, in contact since ever."""
    return Flanks(np.zeros(joints), np.full(joints, -np.inf))


def in_gap(
    drive: Drive, half_gap: Array, load: Array, t: Array, before: Flanks
) -> tuple[Mask, Flanks]:
    """Whether the motor is between the flanks, (N, J), and the flanks after the last row.

    Args:
        half_gap: b, (N, J) [rad].
        load: transmitted by the gear, (N, J) [N·m].
        t: times of the rows, (N,) [s].
    """
    side = _last_where(np.sign(load), load != 0.0, before.side)
    came = np.vstack([before.side, side[:-1]])
    turned = (side != came) & (came != 0.0)
    since = _last_where(np.broadcast_to(t[:, None], load.shape), turned, before.since)
    crossing = np.sqrt(4.0 * half_gap * drive.rotor_inertia / drive.coulomb)
    return t[:, None] - since < crossing, Flanks(side[-1], since[-1])


def _last_where(values: Array, told: Mask, before: Array) -> Array:
    """For each row, the last value up to it where `told`, (N, J); `before` where there is none."""
    row = np.where(told, np.arange(1, len(values) + 1)[:, None], 0)
    last = np.maximum.accumulate(row, axis=0)
    return np.asarray(np.take_along_axis(np.vstack([before, values]), last, axis=0))
