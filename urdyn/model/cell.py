"""What stands around an arm, and what is bolted to its tool: simple solids, in the root's frame.

The root is the first link of the description, `base_link` for the arms of the library: x forward,
z up, z = 0 where the arm is mounted.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from urdyn.types import Array, frozen

Shape = Literal["box", "ball", "cylinder"]


@dataclass(frozen=True)
class Wall:
    """A plane, and all that is behind it; a floor is a wall that lies."""

    name: str
    point: Array  # (3,) [m] on the plane
    normal: Array  # (3,) of any length, towards the arm

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", frozen(self.point))
        object.__setattr__(self, "normal", frozen(self.normal))


@dataclass(frozen=True)
class Solid:
    """A box, ball or cylinder about its centre."""

    name: str
    shape: Shape
    size: Array  # box: x, y, z [m]; ball: radius; cylinder: radius, length along its z
    xyz: Array = field(default_factory=lambda: np.zeros(3))  # (3,) [m]
    rpy: Array = field(default_factory=lambda: np.zeros(3))  # (3,) [rad]

    def __post_init__(self) -> None:
        for name in ("size", "xyz", "rpy"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True)
class Cell:
    """The surroundings; without any the arm has the air to itself."""

    walls: tuple[Wall, ...] = ()
    solids: tuple[Solid, ...] = ()  # that stand still
    tool: tuple[Solid, ...] = ()  # in the last joint's frame, and moving with it


def floor(height: float = 0.0) -> Wall:
    """The ground at `height` [m] over the arm's mounting plane."""
    return Wall("floor", np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 1.0]))


STANDING = Cell(walls=(floor(),))  # an arm on a floor or table, and nothing else near
