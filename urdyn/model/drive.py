"""A joint's drive: the coefficients between rigid-body torque and motor current."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from urdyn.types import Array, shaped

UNITS = {
    "gain": "N·m/A",
    "rotor_inertia": "kg·m²",
    "coulomb": "N·m",
    "viscous": "N·m·s/rad",
    "structural": "-",
    "offset": "N·m",
    "stribeck": "N·m",
    "ripple_cos": "N·m",
    "ripple_sin": "N·m",
    "thermal": "N·m·s/(rad·K)",
    "presliding_distance": "rad",
    "presliding_tail": "-",
    "stribeck_velocity": "rad/s",
    "temperature": "°C",
    "health": "-",
}

# Coefficients in which torque is linear, in the order of identification: of the rotor, and of the
# terms of friction.
FRICTION = (
    "coulomb",
    "viscous",
    "structural",
    "offset",
    "stribeck",
    "ripple_cos",
    "ripple_sin",
    "thermal",
)
LINEAR = ("rotor_inertia", *FRICTION)

# What shapes those terms; torque is nonlinear in it.
SHAPE = ("presliding_distance", "presliding_tail", "stribeck_velocity")

# Nonlinear coefficients, in which a linearised problem also has a step.
STEPS = (*SHAPE, "time_offset")

TIMES = ("time_offset", "friction_lead")  # of the whole arm


@dataclass(frozen=True, eq=False)
class Drive:
    """Drives of an arm, one entry per joint; a term that the model does not have is zero."""

    gain: Array  # (J,) [N·m/A], K: joint torque per motor ampere of a new drive
    rotor_inertia: Array  # (J,) [kg·m²], reflected to the joint
    coulomb: Array  # (J,) [N·m], f
    viscous: Array  # (J,) [N·m·s/rad], alpha
    structural: Array  # (J,) [-], beta: loss per transmitted torque
    offset: Array  # (J,) [N·m], o
    stribeck: Array  # (J,) [N·m], friction that fades with speed; negative: it builds up
    ripple_cos: Array  # (J,) [N·m], strain-wave gear, twice a motor turn
    ripple_sin: Array  # (J,) [N·m]
    thermal: Array  # (J,) [N·m·s/(rad·K)], change of viscous friction per kelvin
    presliding_distance: Array  # (J,) [rad]
    presliding_tail: Array  # (J,) [-], share of the soft bristles
    stribeck_velocity: Array  # (J,) [rad/s]
    temperature: Array  # (J,) [°C] at which viscous friction is quoted; NaN: unknown
    health: Array  # (J,) [-], z: 1 when new
    time_offset: float = 0.0  # [s] by which current leads the recorded motion
    friction_lead: float = 0.0  # [s] by which friction reverses before even that

    def __post_init__(self) -> None:
        for field in fields(self):
            if field.name not in TIMES:
                values = shaped(field.name, getattr(self, field.name), np.shape(self.gain))
                object.__setattr__(self, field.name, values)

    def coefficients(self) -> Array:
        """Coefficients of the linear terms, (len(LINEAR), J)."""
        return np.array([getattr(self, name) for name in LINEAR])
