"""Gate: whether a sample can have come from the arm, judged when it arrives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.types import MAD_TO_SD, Array, Mask

REACH = 100.0  # [rad/s²] more than a UR's joints accelerate in use
FINEST = 5e-4  # [rad] what logs are rounded to, and more
STAMP = 1e-3  # [s] by which stamps scatter
# [s] in which a shaken joint may move in any way: a real one that was pushed moved by 1 mrad that
# its speeds do not show. Over longer, up to ONE_WAY, its speed is monotonic.
SHAKEN, ONE_WAY = 0.01, 0.06


def furthest(dt: Array | float, speed: Array, change: Array, acceleration: float = REACH) -> Array:
    """How far an arm's motion over dt [s] may be off the trapezoid of its speeds, (..., J) [rad].

    Accelerations up to a put it at most a dt² / 4 off, and a monotonic speed at most dt / 2 times
    its change. NaN where that is not known.

    Args:
        speed: around [rad/s].
        change: its largest change in the steps around [rad/s].
    """
    shaken, at_most = (0.25 * acceleration * np.square(time) for time in (SHAKEN, dt))
    one_way = shaken + 0.5 * dt * change + STAMP * speed
    return np.asarray(FINEST + np.fmin(at_most, np.where(np.less(dt, ONE_WAY), one_way, np.inf)))


@dataclass(frozen=True)
class Gate:
    """Refuses what exceeds both what the arm can do and what the sensor usually does.

    A sample is predicted from the one before: its speed from that, its angle by a trapezoid. The
    arm cannot depart from these by more than a dt and `furthest`, respectively; the sensor is known
    by the running MAD of its departures. After a refusal there is nothing to predict from, so the
    next sample passes: a torn sample is caught, a true step costs one sample.
    """

    sigma: float = 6.0  # [-] running MAD, in standard deviations
    acceleration: float = REACH

    def departure(self, before: Array, row: Array, dt: Array | float) -> Array:
        """Departure of q and v from their prediction; as before and row, (2, ..., J) [rad, rad/s].

        An angle's is the lesser of those by the speed before and, where both are measured, by the
        trapezoid: a torn speed tears no angle.
        """
        apart = row - before
        apart[0] -= dt * np.where(np.isnan(before[1]), row[1], before[1])
        trapezoid = apart[0] - 0.5 * dt * apart[1]
        apart = np.abs(apart)
        apart[0] = np.fmin(apart[0], np.abs(trapezoid))
        return apart

    def refuses(self, departure: Array, history: Array, dt: float, speeds: Sequence[Array]) -> Mask:
        """Which of q and v, (2, J), to mark as not measured.

        Args:
            history: (n, 2, J) of departures.
            speeds: of the sample before and of this one, (J,) each [rad/s].
        """
        beyond: Mask = departure > [[FINEST], [self.acceleration * dt]]
        if np.count_nonzero(beyond):  # hardly ever: the rest is only asked for where it matters
            speed = np.fmax.reduce(np.abs(speeds))
            change = np.fmax.reduce([departure[1], *history[:, 1]])
            beyond[0] &= departure[0] > furthest(dt, speed, change, self.acceleration)
            beyond &= departure > self.sigma * MAD_TO_SD * _median_of_known(history)
        return beyond


def _median_of_known(history: Array) -> Array:
    """Lower median over rows, NaN left out; 0 where nothing is known, so that the reach decides."""
    middle = np.maximum(np.isfinite(history).sum(0) - 1, 0) // 2
    found = np.take_along_axis(np.sort(history, axis=0), middle[None], axis=0)[0]
    return np.where(np.isnan(found), 0.0, found)
