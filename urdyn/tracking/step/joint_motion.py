"""How the joints moved between two instants, and which of their currents can be compared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from urdyn.model.drive import Drive
from urdyn.model.friction import follow
from urdyn.signal import Instant
from urdyn.tracking.step.warmth import warmed
from urdyn.types import STANDSTILL, Array, Mask

STANDING = STANDSTILL  # [rad/s] below this, friction is whatever holds the joint
# [rad] of travel after which a joint that stood for long turns normally: its bristles are known
# and its breakaway is over. Real arms snap by a degree where programs begin.
LOOSE = 0.08
INTERRUPTED = 0.5  # [s] without a sample: the joints may have moved
LONGEST = 60.0  # [s] of drift that one gap may add: a night does not make an arm unknown
HELD, REPEATS = 0.2, 8.0  # [s] and samples for which a sliding joint's current may be constant


@dataclass(frozen=True, eq=False)
class JointState:
    """State of the joints at an instant, beside the parameters."""

    v: Array  # (J,) [rad/s]
    current: Array  # (J,) [A]
    unchanged: Array  # (J,) [s] for which that has not changed while the joint slid
    bristles: Array  # (2, J) [-]
    travelled: Array  # (J,) [rad] since the bristles were unknown
    lubricant: Array  # (J,) [°C]; NaN while the joint's temperature is not measured


def before_any(joints: int) -> JointState:
    """The state before the first instant."""
    nothing, unknown = np.zeros(joints), np.full(joints, np.nan)
    return JointState(nothing, unknown, nothing, np.zeros((2, joints)), nothing, unknown)


def long_ago(before: JointState) -> JointState:
    """The state after an unknown time: lubricant is as warm as its joint."""
    return replace(before, lubricant=np.full_like(before.lubricant, np.nan))


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Motion from the last instant to this one."""

    passed: float  # [s] as far as is known
    moving: bool  # some joint slides
    end: JointState
    stuck: Mask  # (J,) currents that have not changed for too long while their joints slid
    comparable: Mask  # (J,) currents that are not stuck, of joints that have slid for a while

    def presliding(self, drive: Drive) -> Array:
        """Presliding state, (J,) [-]."""
        near, tail = self.end.bristles
        return np.asarray(near + drive.presliding_tail * (tail - near))


def joint_motion(
    before: JointState, now: Instant, dt: float, drive: Drive, period: float
) -> JointMotion:
    """The motion up to an instant dt [s] after the last.

    Args:
        period: nominal, between samples [s].
    """
    passed = min(dt, LONGEST) if isfinite(dt) else 0.0
    bristles, travelled = _moved(before, now, dt, drive)
    slides = np.abs(now.v) > STANDING
    unchanged = np.where(now.current == before.current, before.unchanged + passed * slides, 0.0)
    stuck = slides & (unchanged > max(HELD, REPEATS * period))
    end = JointState(
        v=now.v,
        current=now.current,
        unchanged=unchanged,
        bristles=bristles,
        travelled=travelled,
        lubricant=warmed(before.lubricant, now.temperature, dt),
    )
    return JointMotion(
        passed=passed,
        moving=bool(np.count_nonzero(slides)),
        end=end,
        stuck=stuck,
        comparable=slides & (travelled > LOOSE) & ~stuck,
    )


def _moved(before: JointState, now: Instant, dt: float, drive: Drive) -> tuple[Array, Array]:
    """Bristles and travel after the distance moved since the last instant."""
    if dt > INTERRUPTED:
        return np.zeros_like(before.bristles), np.zeros_like(before.travelled)
    way = 0.5 * (before.v + now.v) * dt
    ahead = way + drive.friction_lead * (now.v - before.v)
    bristles = follow(before.bristles, ahead, drive.presliding_distance)
    return bristles, before.travelled + np.abs(way)
