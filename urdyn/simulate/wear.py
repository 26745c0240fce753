"""Growing faults: the effect of wear on an arm's course after its onset.

Friction follows eq. 5 of the paper, with a rate relative to the friction without the fault: two
faults of a joint compound. Health follows its eq. 6.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from urdyn.simulate.schedule import Course, at_joint
from urdyn.types import Array

Shape = Literal["linear", "step", "exponential"]

LEAST_HEALTH = 0.05  # [-] below which a drive would trip


@dataclass(frozen=True)
class FrictionIncrease:
    """Coulomb friction f (1 + growth); viscous friction likewise if requested."""

    joint: int
    rate: float  # [1/s] relative to f without the fault; shape step: [-]
    onset: float = 0.0  # [s]
    shape: Shape = "linear"
    viscous: float = 0.0  # [1/s], the same for viscous friction

    def befall(self, course: Course) -> Course:
        """f (1 + rate (t - onset))."""
        j, since = self.joint, course.t - self.onset
        coulomb = course.coulomb[:, j] * (1.0 + growth(self.shape, self.rate, since))
        viscous = course.viscous[:, j] * (1.0 + growth(self.shape, self.viscous, since))
        return replace(
            course,
            coulomb=at_joint(course.coulomb, j, coulomb),
            viscous=at_joint(course.viscous, j, viscous),
        )


@dataclass(frozen=True)
class HealthDegradation:
    """The drive gives less torque per ampere, down to LEAST_HEALTH."""

    joint: int
    rate: float  # [1/s]; shape step: [-]
    onset: float = 0.0  # [s]
    shape: Shape = "linear"

    def befall(self, course: Course) -> Course:
        """z(t) = z(0) - rate (t - onset), or z(0) exp(-rate (t - onset))."""
        before = course.health[:, self.joint]
        lost = growth(self.shape, self.rate, course.t - self.onset)
        left = before / (1.0 + lost) if self.shape == "exponential" else before - lost
        after = np.maximum(left, np.minimum(before, LEAST_HEALTH))
        return replace(course, health=at_joint(course.health, self.joint, after))


@dataclass(frozen=True)
class JointBacklash:
    """The gear's half gap grows."""

    joint: int
    rate: float  # [rad/s]; shape step: [rad]
    onset: float = 0.0  # [s]
    shape: Literal["linear", "step"] = "linear"

    def befall(self, course: Course) -> Course:
        """b(t) = b(0) + rate (t - onset)."""
        grown = growth(self.shape, self.rate, course.t - self.onset)
        gap = course.half_gap[:, self.joint] + grown
        return replace(course, half_gap=at_joint(course.half_gap, self.joint, gap))


@dataclass(frozen=True)
class ControllerInstability:
    """The loop's gain grows, or the delay in it, until it rings."""

    joint: int  # whose gain grows; the delay is common to all joints
    rate: float = 0.0  # [1/s] relative to the gain without the fault; shape step: [-]
    onset: float = 0.0  # [s]
    shape: Shape = "linear"
    delay: float = 0.0  # [s/s]; shape step: [s]

    def befall(self, course: Course) -> Course:
        """k (1 + rate (t - onset))."""
        j, since = self.joint, course.t - self.onset
        gain = course.loop_gain[:, j] * (1.0 + growth(self.shape, self.rate, since))
        way: Shape = "step" if self.shape == "step" else "linear"
        return replace(
            course,
            loop_gain=at_joint(course.loop_gain, j, gain),
            loop_delay=course.loop_delay + growth(way, self.delay, since),
        )


def growth(shape: Shape, rate: float, since: Array) -> Array:
    """Growth by the time `since` the onset (N,) [s]; 0 before.

    By shape: rate since, or rate at once, or exp(rate since) - 1.
    """
    after = np.maximum(since, 0.0)
    match shape:
        case "linear":
            return rate * after
        case "step":
            return np.where(since >= 0.0, rate, 0.0)
        case "exponential":
            return np.asarray(np.expm1(rate * after))
