"""How an arm's joints got to an instant, and which of their currents can be compared there."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from urdyn.model.drive import Drive
from urdyn.model.friction import follow
from urdyn.signal import Instant
from urdyn.tracking.state import TrackerState
from urdyn.tracking.warmth import warmed
from urdyn.types import Array, Mask

STANDING = 0.02  # [rad/s] slower than this, friction is whatever holds the joint
# [rad] of travel, after which a joint that stood for long turns as it does as a rule: its bristles
# are known, and what broke it away is over. Real arms snap by a degree where programs begin.
LOOSE = 0.08
INTERRUPTED = 0.5  # [s] without a sample: the joints may have moved
LONGEST = 60.0  # [s] of drift that one gap may add: a night does not make an arm unknown
HELD, REPEATS = 0.2, 8.0  # [s] and samples for which a current may stay while its joint slides


@dataclass(frozen=True, eq=False)
class JointMotion:
    """From the last instant to this one."""

    passed: float  # [s] as far as anybody knows
    moving: bool  # some joint slides
    bristles: Array  # (2, J) [-]
    travelled: Array  # (J,) [rad] since they were unknown
    unchanged: Array  # (J,) [s] for which a current has not changed while its joint slid
    lubricant: Array  # (J,) [°C]; NaN while nobody measures the joint's temperature
    stuck: Mask  # (J,) currents that have not changed for too long while their joints slid
    comparable: Mask  # (J,) all others, of joints that slide and have for a while

    def presliding(self, drive: Drive) -> Array:
        """Presliding state, (J,) [-]."""
        near, tail = self.bristles
        return np.asarray(near + drive.presliding_tail * (tail - near))


def joint_motion(
    before: TrackerState[Any], now: Instant, dt: float, drive: Drive, period: float
) -> JointMotion:
    """The passage to an instant dt [s] after the last.

    Args:
        period: between samples, as a rule [s].
    """
    passed = min(dt, LONGEST) if isfinite(dt) else 0.0
    bristles, travelled = _moved(before, now, dt, drive)
    slides = np.abs(now.v) > STANDING
    unchanged = np.where(now.current == before.current, before.unchanged + passed * slides, 0.0)
    lubricant = warmed(before.lubricant, now.temperature, passed)
    stuck = slides & (unchanged > max(HELD, REPEATS * period))
    comparable = slides & (travelled > LOOSE) & ~stuck
    moving = bool(np.count_nonzero(slides))
    return JointMotion(
        passed=passed,
        moving=moving,
        bristles=bristles,
        travelled=travelled,
        unchanged=unchanged,
        lubricant=lubricant,
        stuck=stuck,
        comparable=comparable,
    )


def _moved(before: TrackerState[Any], now: Instant, dt: float, drive: Drive) -> tuple[Array, Array]:
    """Bristles and travel after the way since the last instant."""
    if dt > INTERRUPTED:
        return np.zeros_like(before.bristles), np.zeros_like(before.travelled)
    way = 0.5 * (before.v + now.v) * dt
    ahead = way + drive.friction_lead * (now.v - before.v)
    bristles = follow(before.bristles, ahead, drive.presliding_distance)
    return bristles, before.travelled + np.abs(way)
