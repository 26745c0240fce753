"""One rigid body's inertials, about its frame and about its centre of mass."""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

BODY = ("mass", "com_x", "com_y", "com_z", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
BODY_UNITS = ("kg", "m", "m", "m", *["kg·m²"] * 6)  # inertia about the centre of mass

LIGHT = 0.1  # [kg] a smaller payload is negligible

# Where the six numbers Ixx, Ixy, Iyy, Ixz, Iyz, Izz stand in a tensor.
ORDER = (np.array([0, 0, 1, 0, 1, 2]), np.array([0, 1, 1, 2, 2, 2]))


def about_frame(mass: float, com: Array, inertia: Array) -> Array:
    """Inertials (10,) of a body whose inertia (3, 3) is about its centre of mass."""
    return np.concatenate([[mass], mass * com, (inertia + steiner(mass, com))[ORDER]])


def centre_of_mass(body: Array) -> Array:
    """(3,) [m] of inertials, or of mass and first moments alone; NaN where there is no mass."""
    return body[1:4] / body[0] if abs(body[0]) > LIGHT else np.full(3, np.nan)


def about_com(body: Array) -> tuple[float, Array, Array]:
    """Mass [kg], centre of mass (3,) [m], inertia (6,) about it [kg·m²] of inertials (10,)."""
    mass, com = float(body[0]), body[1:4] / body[0]
    return mass, com, body[4:] - steiner(mass, com)[ORDER]


def steiner(mass: float, com: Array) -> Array:
    """What a point mass at `com` adds to the inertia about the origin, (3, 3) [kg·m²]."""
    return mass * (com @ com * np.eye(3) - np.outer(com, com))


def tensor(six: Array) -> Array:
    """Symmetric (3, 3) of Ixx, Ixy, Iyy, Ixz, Iyz, Izz."""
    matrix = np.empty((3, 3))
    matrix[ORDER] = six
    matrix[ORDER[::-1]] = six
    return matrix
