"""How far the tool will be from where a calibrated arm predicts it, all over the workspace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.identify.kinematics.placement import Placement, slopes
from urdyn.model.arm import Arm
from urdyn.model.collision import free
from urdyn.types import Array, frozen

SAMPLES = 600  # poses without self-collision, at random


@dataclass(frozen=True)
class Workspace:
    """Poses all over, and what is to be expected there."""

    q: Array  # (N, J) [rad]
    place: Array  # (N, 3) of the tool, in the base [m]
    error: Array  # (N,) RMS distance of the tool from its prediction [m]
    before: Array  # (N,) the same of an arm that was not calibrated, tool and base known [m]

    def __post_init__(self) -> None:
        for name in ("q", "place", "error", "before"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def roam(arm: Arm, count: int, rng: np.random.Generator) -> Array:
    """Poses (count, J) [rad] within limits, and free of self-collision."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    found = np.empty((0, arm.joints))
    while len(found) < count:
        tried = rng.uniform(lower, upper, (2 * count, arm.joints))
        found = np.concatenate([found, tried[free(arm, tried)]])
    return found[:count]


def expected(placement: Placement, cov: Array, prior: Array, noise: float, q: Array) -> Workspace:
    """What the posterior says of poses q (N, J).

    Args:
        cov: of all unknowns.
        prior: variance of the geometry's coordinates before any pose was met.
        noise: what each coordinate of a place is off besides [m].
    """
    A = slopes(placement, q)[:, :3]
    variance = np.einsum("nip,pq,niq->n", A, cov, A, optimize=True)
    before = np.einsum("nip,p,nip->n", A[:, :, : len(prior)], prior, A[:, :, : len(prior)])
    place = (placement.flanges(q) @ placement.tool)[:, :3, 3]
    error = np.sqrt(np.maximum(variance, 0.0) + 3.0 * noise**2)
    return Workspace(q, place, error, np.sqrt(before))
