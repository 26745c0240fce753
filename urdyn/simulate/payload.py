"""What an arm carries, by its mass and where that is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from urdyn.errors import InputError
from urdyn.types import Array, frozen

DENSITY = 3000.0  # [kg/m³], between aluminium and steel with holes: grippers and work pieces


@dataclass(frozen=True)
class Payload:
    """A solid ball at the tool."""

    mass: float  # [kg]
    com: Array = field(default_factory=lambda: np.zeros(3))  # (3,) [m], in the last joint's frame

    def __post_init__(self) -> None:
        object.__setattr__(self, "com", frozen(self.com))
        if not (self.mass > 0.0 and np.isfinite(self.mass) and np.isfinite(self.com).all()):
            raise InputError(f"a payload of {self.mass:g} kg at {self.com} cannot be carried")
        assert self.com.shape == (3,), "a point in space"

    def inertials(self) -> Array:
        """Mass, first moment, inertia about the last joint's frame, (10,), Pinocchio's order."""
        radius = (3.0 * self.mass / (4.0 * np.pi * DENSITY)) ** (1.0 / 3.0)
        own = 0.4 * self.mass * radius**2 * np.eye(3)
        return inertials(self.mass, self.com, own)


# Where the six numbers Ixx, Ixy, Iyy, Ixz, Iyz, Izz stand in a tensor.
ORDER = (np.array([0, 0, 1, 0, 1, 2]), np.array([0, 1, 1, 2, 2, 2]))


def inertials(mass: float, com: Array, inertia: Array) -> Array:
    """Inertials (10,) of a body whose inertia (3, 3) is about its centre of mass."""
    return np.concatenate([[mass], mass * com, (inertia + steiner(mass, com))[ORDER]])


def about_com(body: Array) -> tuple[float, Array, Array]:
    """Mass [kg], centre of mass (3,) [m], inertia (6,) about it [kg·m²] of inertials (10,)."""
    mass, com = float(body[0]), body[1:4] / body[0]
    return mass, com, body[4:] - steiner(mass, com)[ORDER]


def steiner(mass: float, com: Array) -> Array:
    """What a point mass at `com` adds to the inertia about the origin, (3, 3) [kg·m²]."""
    return mass * (com @ com * np.eye(3) - np.outer(com, com))
