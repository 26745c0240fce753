"""A payload, by its mass and its centre."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from urdyn.errors import InputError
from urdyn.model.body import about_frame
from urdyn.types import Array, shaped

MOST, FARTHEST = 1e4, 1e2  # [kg], [m] beyond any payload
DENSITY = 3000.0  # [kg/m³], between aluminium and steel with holes: grippers and work pieces


@dataclass(frozen=True, eq=False)
class Payload:
    """A solid ball at the tool."""

    mass: float  # [kg]
    com: Array = field(default_factory=lambda: np.zeros(3))  # (3,) [m], in the last joint's frame

    def __post_init__(self) -> None:
        object.__setattr__(self, "com", shaped("com", self.com, (3,)))
        if not (0.0 < self.mass < MOST and (np.abs(self.com) < FARTHEST).all()):
            raise InputError(f"a payload of {self.mass:g} kg at {self.com} cannot be carried")

    @property
    def radius(self) -> float:
        """Of the ball [m]."""
        return float((3.0 * self.mass / (4.0 * np.pi * DENSITY)) ** (1.0 / 3.0))

    def inertials(self) -> Array:
        """Mass, first moment, inertia about the last joint's frame, (10,), Pinocchio's order."""
        own = 0.4 * self.mass * self.radius**2 * np.eye(3)
        return about_frame(self.mass, self.com, own)
