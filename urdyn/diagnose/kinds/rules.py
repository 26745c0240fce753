"""Rules as values: what is healthy, and how evidence is named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.kinds.fast_rules import FastRules, Levels, levels_of
from urdyn.diagnose.residual.space import Space
from urdyn.faults.decision import Costs
from urdyn.model.dynamics import Dynamics
from urdyn.model.rated_payload import rated_payload
from urdyn.types import Array

JOINT_STATES = ("f", "alpha", "beta", "z", "k", "o", "rotor")
PAYLOAD_STATES = ("mass", "mx", "my", "mz")

SHAPES = ("step", "ramp")  # of a change in time, in the order of a bank's arrays
JUMPS = "encoder_offset"  # a slow kind that is fast where it comes at once
# What changes: the payload; a drive's health, inverse to current; a current sensor's gain; any
# other state of a joint, as it is.
FAMILIES = ("payload", "health", "sensor", "joint")


@dataclass(frozen=True)
class SlowKind:
    """A direction of change that is tracked over windows."""

    name: str
    change: Mapping[str, float]  # state -> sd of a change; the first one measures it
    least: float  # size of that state's change from which it is reported
    warning: float
    critical: float = np.inf  # of a payload, where not given: what is left of the arm's rating
    sign: int = 0  # which way it goes; 0: either
    family: str = "joint"  # of FAMILIES
    told_as: str = ""  # the kind of its findings; "": its own name
    shapes: tuple[str, ...] = SHAPES
    quantity: str = ""
    unit: str = ""
    advice: str = ""
    looks_like: str = ""  # what no recording distinguishes from it
    hold: float = 0.0  # [s] of motion, after which a payload counts as lasting
    hold_lighter: float = 0.0  # [s] the same where it is lighter than before

    @property
    def of_tool(self) -> bool:
        """A change of the payload, which belongs to no joint."""
        return self.family == "payload"

    @property
    def of_health(self) -> bool:
        """A change of health, to which current is inverse."""
        return self.family == "health"

    @property
    def of_sensor(self) -> bool:
        """A change of a sensor's gain: no drive itself needs less current throughout."""
        return self.family == "sensor"

    @property
    def of_friction(self) -> bool:
        """A change of friction, sized by all friction of its joint, whichever term grows."""
        return self.finding_kind == "friction_increase"

    @property
    def finding_kind(self) -> str:
        """The kind of its findings."""
        return self.told_as or self.name


@dataclass(frozen=True)
class Noise:
    """The part of a residual's colour that is slower than a log's own noise model."""

    share: float  # [-] of the variance
    lasting: float  # [s]


@dataclass(frozen=True)
class Rules:
    """A set of rules."""

    hours: float  # [h] mean time to a false alarm, at least
    shift: float  # [h] that a run counts as
    healthy: Mapping[str, Mapping[str, float]]  # state -> day, hour, window
    warmth: Mapping[str, float]  # sd of its unknowns
    friction: Mapping[str, float]  # day: sd of a joint's total [-]
    noise: Noise
    slow: tuple[SlowKind, ...]
    fast: FastRules
    costs: Costs  # for recommending a service
    named: Mapping[str, Sequence[int]]  # by kind, right findings of campaigns, and all
    rated: Mapping[str, float]  # largest payload by the arm's name or UR type, tool included [kg]

    @property
    def jump(self) -> float:
        """Least jump [rad] of an encoder's zero that is reported: the same as for creep."""
        return next(kind.least for kind in self.slow if kind.name == JUMPS)

    def levels(self, kind: str) -> Levels:
        """The sizes from which a fast kind matters."""
        slow = {each.name: each for each in self.slow}
        return levels_of(vars(self.fast).get(kind) or slow[kind])

    def slow_of(self, dynamics: Dynamics) -> tuple[SlowKind, ...]:
        """The slow kinds for an arm: a payload above its rating is critical."""
        left = rated_payload(dynamics.arm, self.rated) - float(dynamics.payload[0])
        return tuple(
            replace(kind, critical=max(left, kind.warning)) if np.isinf(kind.critical) else kind
            for kind in self.slow
        )

    def stray(self, space: Space, what: str) -> Array:
        """How far each state of an arm strays: by day, by hour or by window, (n,)."""
        spread = np.zeros(space.size)
        for state, of in self.healthy.items():
            spread[space.places[state]] = of.get(what, 0.0) * unit(space, state)
        return spread


def unit(space: Space, state: str) -> Array | float:
    """The rules' unit of a state in the filter's: offsets are in units of Coulomb friction."""
    return space.reference.drive.coulomb if state == "o" else 1.0
