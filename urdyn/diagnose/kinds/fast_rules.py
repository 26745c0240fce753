"""Rules of the fast kinds' tests: a table for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import log
from typing import Any


@dataclass(frozen=True)
class Levels:
    """The sizes from which a kind matters, and the words for it."""

    warning: float
    critical: float
    quantity: str
    unit: str
    advice: str


def levels_of(kind: object) -> Levels:
    """Levels of a kind that has further fields."""
    return Levels(**{f.name: getattr(kind, f.name) for f in fields(Levels)})


@dataclass(frozen=True)
class CollisionRule:
    """Rule for pushes."""

    least: float  # [N] weaker ones are not reported
    longest: float  # [s] what lasts longer is no push
    warning: float  # [N]
    critical: float
    quantity: str
    unit: str
    advice: str


@dataclass(frozen=True)
class RingingRule:
    """Rule for loops that ring."""

    threshold: float  # [-] times the noise floor that a line has to exceed
    sure: float  # [-] the same for one beyond any noise
    lowest: float  # [Hz] lower ones may be the program's
    prompt: float  # [s] that a sure line which does not grow has to last
    patience: float  # [s] that others have to last
    least: float  # [N·m] amplitude
    swing: float  # [rad/s] amplitude of a joint that swings, whatever its torque
    warning: float  # [N·m]
    critical: float
    quantity: str
    unit: str
    advice: str


@dataclass(frozen=True)
class BacklashRule:
    """Rule for gears with play."""

    promise: float  # reversals of load to a false alarm, over all joints
    enough: float  # reversals before a gap is reported
    recurs: float  # [-] of the scatter: sd of what recurs without play
    foreseen: float  # [-] of Coulomb friction: best accuracy of a predicted current
    warning: float  # [rad] half a gap
    critical: float
    quantity: str
    unit: str
    advice: str

    @property
    def needed(self) -> float:
        """Evidence at which a gap is reported [nats]."""
        return log(self.promise)


@dataclass(frozen=True)
class SensorRule:
    """Rule for silent or noisy sensors."""

    held: float  # [s] that a current may repeat itself while the joint slides
    silent: float  # [s] that one joint's current may be missing
    noisy: float  # [-] times the usual noise
    lasting: float  # [s] for which it is, by a wide margin


@dataclass(frozen=True)
class FastRules:
    """Rules of all fast kinds, by their names in the rules."""

    collision: CollisionRule
    controller_instability: RingingRule
    joint_backlash: BacklashRule
    sensor_silent: SensorRule


def fast_rules(tables: Mapping[str, Mapping[str, Any]]) -> FastRules:
    """Rules from tables of these names."""
    return FastRules(
        collision=CollisionRule(**tables["collision"]),
        controller_instability=RingingRule(**tables["controller_instability"]),
        joint_backlash=BacklashRule(**tables["joint_backlash"]),
        sensor_silent=SensorRule(**tables["sensor_silent"]),
    )
