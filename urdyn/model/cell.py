"""An arm's surroundings, and what is bolted to its tool: simple solids, in the root's frame.

The root is the first link of the description, `base_link` for the arms of the library: x forward,
z up, z = 0 where the arm is mounted.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_each, positive
from urdyn.types import Array, index_of

Shape = Literal["box", "ball", "cylinder"]
SIZES: dict[Shape, int] = {"box": 3, "ball": 1, "cylinder": 2}


@dataclass(frozen=True, eq=False)
class Wall:
    """A plane, and all that is behind it; a floor is a horizontal wall."""

    name: str
    point: Array  # (3,) [m] on the plane
    normal: Array  # (3,) of any length, towards the arm

    def __post_init__(self) -> None:
        for name in ("point", "normal"):
            object.__setattr__(self, name, given_each(getattr(self, name), name, (3,)))
        if not self.normal.any():
            raise InputError("normal: points nowhere")


@dataclass(frozen=True, eq=False)
class Solid:
    """A box, ball or cylinder about its centre."""

    name: str
    shape: Shape
    size: Array  # box: x, y, z [m]; ball: radius; cylinder: radius, length along its z
    xyz: Array = field(default_factory=lambda: np.zeros(3))  # (3,) [m]
    rpy: Array = field(default_factory=lambda: np.zeros(3))  # (3,) [rad]

    def __post_init__(self) -> None:
        index_of(self.shape, tuple(SIZES), "shape")
        shape, takes = (SIZES[self.shape],), "finite metres above zero"
        size = given_each(self.size, "size", shape, takes, lambda x: positive(x) & np.isfinite(x))
        object.__setattr__(self, "size", size)
        for name in ("xyz", "rpy"):
            object.__setattr__(self, name, given_each(getattr(self, name), name, (3,)))


@dataclass(frozen=True)
class Cell:
    """The surroundings; empty by default."""

    walls: tuple[Wall, ...] = ()
    solids: tuple[Solid, ...] = ()  # that stand still
    tool: tuple[Solid, ...] = ()  # in the last joint's frame, and moving with it


def floor(height: float = 0.0) -> Wall:
    """The ground at `height` [m] over the arm's mounting plane."""
    return Wall("floor", np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 1.0]))


STANDING = Cell(walls=(floor(),))  # an arm on a floor or table, and nothing else near
