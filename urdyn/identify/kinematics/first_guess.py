"""A first guess of base and tool, from poses of which some may be wrong."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.model.geometry.turns import pose_of
from urdyn.types import Array

DRAWS, SUBSET = 40, 12  # trials, and poses in each
JUDGES = 300  # poses by which a trial is judged
ROUNDS = 20  # of the alternation between base and tool


def guess(
    flanges: Array, place: Array, turn: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """transform_base_to_world and transform_tool_to_flange, (4, 4) each.

    Least median of errors over many small subsets: half of the poses may be wrong [Leroy1987]_.

    Args:
        flanges: transform_flange_to_base as drawn (N, 4, 4).
        place: measured (N, 3) [m].
        turn: measured (N, 3, 3); NaN where only positions were measured.
    """
    judges = rng.permutation(len(place))[:JUDGES]
    oriented = bool(np.isfinite(turn).all())
    best, least = (np.eye(4), np.eye(4)), np.inf
    for _ in range(DRAWS):
        rows = rng.choice(len(place), min(SUBSET, len(place)), replace=False)
        for base, arm in _candidates(flanges[rows], place[rows], turn[rows], oriented):
            off = place[judges] - (base @ flanges[judges] @ arm)[:, :3, 3]
            error = float(np.median(np.linalg.norm(off, axis=1)))
            if error < least:
                best, least = (base, arm), error
    return best[0], _turned(best[0] @ flanges[judges], best[1], turn[judges], oriented)


def tool_of(flanges: Array, place: Array, turn: Array) -> Array:
    """transform_tool_to_flange (4, 4) where the world is the base, by medians."""
    seen = np.einsum("nji,nj->ni", flanges[:, :3, :3], place - flanges[:, :3, 3])
    arm = pose_of(np.median(seen, axis=0), np.eye(3))
    return _turned(flanges, arm, turn, bool(np.isfinite(turn).all()))


def _candidates(
    flanges: Array, place: Array, turn: Array, oriented: bool
) -> list[tuple[Array, Array]]:
    """Base and tool from a few poses, by positions, and by orientations if measured."""
    found = [_alternated(flanges, place)]
    if oriented:
        found.append(_by_turns(flanges, place, turn))
    return found


def _alternated(flanges: Array, place: Array) -> tuple[Array, Array]:
    """Base and tool by positions: alternately one given the other."""
    tip = np.zeros(3)
    for _ in range(ROUNDS):
        points = flanges[:, :3, 3] + flanges[:, :3, :3] @ tip
        base = _fitted(points, place)
        seen = (place - base[:3, 3]) @ base[:3, :3] - flanges[:, :3, 3]
        tip = np.einsum("nji,nj->ni", flanges[:, :3, :3], seen).mean(axis=0)
    return base, pose_of(tip, np.eye(3))


def _fitted(points: Array, place: Array) -> Array:
    """The rigid transform that fits points (N, 3) to places (N, 3) best [Arun1987]_."""
    middle, there = points.mean(axis=0), place.mean(axis=0)
    turn = _nearest_turn((place - there).T @ (points - middle))
    return pose_of(there - turn @ middle, turn)


def _by_turns(flanges: Array, place: Array, turn: Array) -> tuple[Array, Array]:
    """Base and tool by orientations: base' turn = flange tool is linear in both; places follow."""
    eye = np.eye(3)
    rows = [
        np.hstack([np.kron(eye, seen.T), -np.kron(flange, eye)])
        for seen, flange in zip(turn, flanges[:, :3, :3], strict=True)
    ]
    null = np.linalg.svd(np.vstack(rows))[2][-1].reshape(2, 3, 3)
    base = _nearest_turn(null[0] * np.sign(np.linalg.det(null[0]))).T
    still = np.broadcast_to(eye, (len(place), 3, 3))
    A = np.concatenate([base @ flanges[:, :3, :3], still], axis=2).reshape(-1, 6)
    y = (place - flanges[:, :3, 3] @ base.T).ravel()
    x = np.linalg.lstsq(A, y, rcond=None)[0]
    return pose_of(x[3:], base), pose_of(x[:3], eye)


def _nearest_turn(matrix: Array) -> Array:
    """The rotation nearest to a matrix."""
    U, _, V = np.linalg.svd(matrix)
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V)


def _turned(reached: Array, arm: Array, turn: Array, oriented: bool) -> Array:
    """The tool with the turn on which most poses agree; unchanged where none was measured."""
    if not oriented:
        return arm
    seen = np.swapaxes(reached[:, :3, :3], 1, 2) @ turn
    apart = [np.median(Rotation.from_matrix(one.T @ seen).magnitude()) for one in seen]
    return pose_of(arm[:3, 3], seen[int(np.argmin(apart))])
