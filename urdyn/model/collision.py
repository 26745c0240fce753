"""What an arm may touch: itself, a floor, walls and boxes, by its URDF's shapes and coal.

Distances are between solids, in metres, below zero where they overlap. Shapes of one link, and
shapes that are closer than the margin in every pose, are one piece: the joint between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
import pinocchio as pin

from urdyn.model.arm import Arm
from urdyn.model.cell import STANDING, Cell
from urdyn.model.solids import geometry
from urdyn.types import Array, Mask, freeze

MARGIN = 0.02  # [m] that shapes keep from each other
POSES = 512  # at random, that show which shapes are always closer than the margin


@dataclass(frozen=True, eq=False)
class Collider:
    """An arm's shapes among its surroundings; not for use by two threads at once."""

    arm: Arm
    pairs: tuple[tuple[str, str], ...]  # P of them, which are not to touch each other
    reach: Array  # (P, J) [m/rad] bound on a distance's change as a joint turns
    _between: Array = field(repr=False)  # (P, J) 1 where the joint moves the second, not the first
    _geometry: Any = field(repr=False)
    _data: Any = field(repr=False)

    def __post_init__(self) -> None:
        freeze(self, "reach")
        assert self.reach.shape == (len(self.pairs), self.arm.joints), "a row a pair"

    def distances(self, q: Array) -> Array:
        """Distance of every pair in poses (..., J) [rad], (..., P) [m]."""
        poses = np.ascontiguousarray(q, dtype=np.float64).reshape(-1, self.arm.joints)
        near = np.array([self._measure(pose) for pose in poses])
        return near.reshape(*q.shape[:-1], len(self.pairs))

    def slopes(self, q: Array, within: float) -> tuple[Array, Array]:
        """Distances (N, P) [m] in poses (N, J), and how they change by joint, (N, P, J) [m/rad].

        Two solids part along the line of their nearest points. Zero where there is more than
        `within` [m] between them.
        """
        near, twists = np.empty((len(q), len(self.pairs))), np.empty((len(q), 6, self.arm.joints))
        places, normals, points = [], [], []
        for row, pose in enumerate(np.ascontiguousarray(q, dtype=np.float64)):
            near[row] = self._measure(pose)
            twists[row] = pin.computeJointJacobians(self.arm._model, self.arm._data, pose)
            for k in np.flatnonzero(near[row] < within).tolist():
                found = self._data.distanceResults[k]
                places.append((row, k))
                normals.append(found.normal.copy())  # coal overwrites it with the next one
                points.append(found.getNearestPoint2().copy())
        slope = np.zeros((len(q), *self.reach.shape))
        if places:
            rows, ks = np.array(places).T
            n, p = np.array(normals), np.array(points)
            # A point moves by linear + angular x p, as the root's origin sees it.
            along = np.concatenate([n, np.cross(p, n)], axis=1)
            slope[rows, ks] = self._between[ks] * np.einsum("ic,icj->ij", along, twists[rows])
        return near, slope

    def _measure(self, pose: Array) -> list[float]:
        """Distance of every pair in one pose."""
        pin.computeDistances(self.arm._model, self.arm._data, self._geometry, self._data, pose)
        return [found.min_distance for found in self._data.distanceResults]


def collider(arm: Arm, cell: Cell = STANDING, margin: float = MARGIN) -> Collider:
    """What `arm` may touch in `cell`.

    Raises:
        ArmError: the description does not give the arm's shapes.
    """
    shapes = geometry(arm, cell)
    things = list(shapes.geometryObjects)
    whole = _collider(arm, shapes, list(_candidates(things)))
    around = len(cell.solids) + len(cell.walls)
    return _collider(arm, shapes, list(_apart(whole, len(things) - around, margin)))


def free(arm: Arm, q: Array, cell: Cell = STANDING) -> Mask:
    """Whether the arm, in poses (..., J) [rad], keeps MARGIN from itself and its cell: (...).

    Give many poses in one call: building the shapes costs as much as some hundred poses.
    """
    return np.asarray((collider(arm, cell).distances(q) >= MARGIN).all(axis=-1))


def _collider(arm: Arm, shapes: Any, chosen: Sequence[tuple[int, int]]) -> Collider:
    """The collider of the chosen pairs of shapes."""
    shapes.removeAllCollisionPairs()
    for pair in chosen:
        shapes.addCollisionPair(pin.CollisionPair(*pair))
    things = [(shapes.geometryObjects[a], shapes.geometryObjects[b]) for a, b in chosen]
    joints = np.arange(1, arm.joints + 1)
    between = [(a.parentJoint < joints) & (joints <= b.parentJoint) for a, b in things]
    reach = [_reach(arm, b) * moves for (_, b), moves in zip(things, between, strict=True)]
    return Collider(
        arm=arm,
        pairs=tuple((a.name, b.name) for a, b in things),
        reach=np.array(reach).reshape(len(things), arm.joints),
        _between=np.array(between, dtype=np.float64).reshape(len(things), arm.joints),
        _geometry=shapes,
        _data=pin.GeometryData(shapes),
    )


def _candidates(things: list[Any]) -> Iterator[tuple[int, int]]:
    """Pairs that move against each other, that on the link nearer to the root first."""
    for one, other in combinations(range(len(things)), 2):
        first, second = sorted((one, other), key=lambda k: int(things[k].parentJoint))
        if things[first].parentJoint != things[second].parentJoint:
            yield first, second


def _reach(arm: Arm, thing: Any) -> Array:
    """Largest distance of the shape's points from every joint in any pose, (J,) [m]."""
    model, out, slides = arm._model, np.zeros(arm.joints), arm.slides
    centre = thing.placement.act(thing.geometry.aabb_center)
    farthest = float(np.linalg.norm(centre)) + float(thing.geometry.aabb_radius)
    for j in range(int(thing.parentJoint), 0, -1):
        out[j - 1] = 1.0 if slides[j - 1] else farthest
        farthest += float(np.linalg.norm(model.jointPlacements[j].translation))
        farthest += max(abs(arm.lower[j - 1]), abs(arm.upper[j - 1])) * slides[j - 1]
    return out


def _apart(whole: Collider, own: int, margin: float) -> Iterator[tuple[int, int]]:
    """All pairs but those of the arm's `own` shapes that are within the margin in every pose."""
    arm = whole.arm
    poses = np.random.default_rng(0).uniform(arm.lower, arm.upper, (POSES, arm.joints))
    apart = whole.distances(poses).max(axis=0) > margin
    for pair, parted in zip(list(whole._geometry.collisionPairs), apart, strict=True):
        if parted or max(pair.first, pair.second) >= own:
            yield pair.first, pair.second
