"""What the tests of fast kinds go by: a table of the rules for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any


@dataclass(frozen=True)
class Levels:
    """From which size on a kind matters, and what is said of it."""

    warning: float
    critical: float
    quantity: str
    unit: str
    advice: str


def levels_of(kind: object) -> Levels:
    """Those of a kind that has them among others."""
    return Levels(**{f.name: getattr(kind, f.name) for f in fields(Levels)})


@dataclass(frozen=True)
class CollisionRule:
    """Of pushes."""

    least: float  # [N] below, they are not told
    longest: float  # [s] what stays longer is no push
    warning: float  # [N]
    critical: float
    quantity: str
    unit: str
    advice: str


@dataclass(frozen=True)
class RingingRule:
    """Of loops that ring."""

    threshold: float  # [-] times the noise floor that a line has to stand out
    sure: float  # [-] the same of one that no noise makes
    lowest: float  # [Hz] below, programs do such things
    prompt: float  # [s] that a line which is sure, and does not grow, has to last
    patience: float  # [s] that others have to last
    least: float  # [N·m] amplitude
    swing: float  # [rad/s] the same of a joint that swings, whatever torque that takes
    warning: float  # [N·m]
    critical: float
    quantity: str
    unit: str
    advice: str


@dataclass(frozen=True)
class BacklashRule:
    """Of gears with play."""

    promise: float  # reversals of load to a false alarm, over all joints
    enough: float  # reversals before a gap is told
    recurs: float  # [-] of the scatter, sd of what recurs where there is no play
    foreseen: float  # [-] of Coulomb friction, to which at best a current is foreseen
    warning: float  # [rad] half a gap
    critical: float
    quantity: str
    unit: str
    advice: str


@dataclass(frozen=True)
class SensorRule:
    """Of sensors that tell nothing, or too much."""

    held: float  # [s] that a current may repeat itself while the joint slides
    silent: float  # [s] that one joint's current may be missing
    noisy: float  # [-] times the usual noise
    lasting: float  # [s] for which it is, by far


@dataclass(frozen=True)
class FastRules:
    """Of every fast kind, by its name in the rules."""

    collision: CollisionRule
    controller_instability: RingingRule
    joint_backlash: BacklashRule
    sensor_silent: SensorRule


def fast_rules(tables: Mapping[str, Mapping[str, Any]]) -> FastRules:
    """Those that tables by these names tell."""
    return FastRules(
        collision=CollisionRule(**tables["collision"]),
        controller_instability=RingingRule(**tables["controller_instability"]),
        joint_backlash=BacklashRule(**tables["joint_backlash"]),
        sensor_silent=SensorRule(**tables["sensor_silent"]),
    )
