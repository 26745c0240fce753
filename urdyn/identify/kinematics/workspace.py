"""Errors to expect of a calibrated arm's tool predictions all over the workspace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.errors import ArmError
from urdyn.identify.kinematics.placement import Placement, slopes
from urdyn.model.arm import Arm
from urdyn.model.cell import STANDING, Cell
from urdyn.model.collision import free
from urdyn.types import Array, freeze

SAMPLES = 600  # free poses, at random
DRAWS = 20  # per pose wanted: at least every fifth pose of a real arm is free


@dataclass(frozen=True, eq=False)
class Workspace:
    """Poses all over the workspace, and the errors to expect there."""

    q: Array  # (N, J) [rad]
    place: Array  # (N, 3) of the tool, in the base [m]
    error: Array  # (N,) RMS distance of the tool, as measured, from its prediction [m]
    before: Array  # (N,) the same for an uncalibrated arm, tool and base known [m]

    def __post_init__(self) -> None:
        freeze(self, "q", "place", "error", "before")


def roam(arm: Arm, count: int, rng: np.random.Generator) -> Array:
    """Poses (count, J) [rad] within limits, free of self-collision, and above the floor.

    The mounting is unknown: an arm without a pose above the plane of its base is taken to hang,
    without a floor.

    Raises:
        ArmError: hardly any pose is free, by the description's shapes.
    """
    for cell in (STANDING, Cell()):
        found = _drawn(arm, cell, count, rng)
        if len(found) == count:
            return found
    raise ArmError(
        f"{arm.name}: of {DRAWS * 2 * count} poses {len(found)} are free of self-collision; "
        "look at the collision shapes of its description"
    )


def _drawn(arm: Arm, cell: Cell, count: int, rng: np.random.Generator) -> Array:
    """`count` poses, or the few that are free, (..., J) [rad]."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    found = np.empty((0, arm.joints))
    for _ in range(DRAWS):
        tried = rng.uniform(lower, upper, (2 * count, arm.joints))
        found = np.concatenate([found, tried[free(arm, tried, cell)]])
        if len(found) >= count:
            break
    return found[:count]


def expected(placement: Placement, cov: Array, prior: Array, noise: float, q: Array) -> Workspace:
    """The errors to expect at poses q (N, J), by the posterior.

    Args:
        cov: of all unknowns.
        prior: prior variance of the geometry's coordinates.
        noise: further error of each coordinate of a place [m].
    """
    A = slopes(placement, q)[:, :3]
    variance = np.einsum("nip,pq,niq->n", A, cov, A, optimize=True)
    before = np.einsum("nip,p,nip->n", A[:, :, : len(prior)], prior, A[:, :, : len(prior)])
    place = (placement.flanges(q) @ placement.tool)[:, :3, 3]
    error = np.sqrt(np.maximum(variance, 0.0) + 3.0 * noise**2)
    return Workspace(q, place, error, np.sqrt(before))
