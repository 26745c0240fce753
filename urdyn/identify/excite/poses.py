"""A slow set of poses, for gravity: each adds the most to what the ones before it tell."""

from __future__ import annotations

import numpy as np

from urdyn.errors import InputError, UnsafeMotionError
from urdyn.identify.excite.columns import columns
from urdyn.identify.excite.criterion import judge
from urdyn.identify.excite.proof import Proof, Safe, prove
from urdyn.identify.excite.question import Question
from urdyn.model.arm import Arm
from urdyn.simulate.limits import Limits
from urdyn.simulate.moves import PEAK_ACCELERATION, PEAK_VELOCITY, Move, Moves
from urdyn.types import Array

CANDIDATES = 200  # poses at random
PACE = 0.3  # [-] of the limits of velocity and acceleration, at which the arm moves between poses
STILL = 1.0  # [s] before each move, and after the last
NEAR = 0.2  # [-] of the velocity limit at which a pose is passed: standing still, friction hides


def poses(
    arm: Arm,
    question: Question,
    safe: Safe,
    criterion: str,
    duration: float,
    rate: float,
    rng: np.random.Generator,
) -> tuple[Moves, Proof]:
    """Moves from pose to pose, and the proof that they are safe.

    Raises:
        InputError: there is not the time for two poses, or no way between any.
    """
    limits = safe.limits
    some = limits.middle + limits.room * rng.uniform(-0.99, 0.99, (CANDIDATES, arm.joints))
    some = some[(safe.collider.distances(some) >= safe.margin).all(axis=1)]
    told = [_told(question, pose, limits, rate) for pose in some]
    M, here, at, moves = question.known, -1, STILL, list[Move]()
    while True:
        found = _next(arm, question, safe, criterion, M, some, told, here, at, duration)
        if found is None:
            break
        here, move = found
        M = M + told[here]
        if move is not None:
            moves.append(move)
            at = move.end + STILL
    if not moves:
        raise InputError(f"no way between two poses in {duration:g} s; ask for more")
    path = Moves(tuple(moves), duration)
    return path, prove(arm, path, safe)


def _told(question: Question, pose: Array, limits: Limits, rate: float) -> Array:
    """What passing a pose slowly in both directions tells, (P, P)."""
    v = NEAR * limits.velocity * np.array([[1.0], [-1.0]])
    found = columns(question.point, np.array([pose, pose]), v, 0.0 * v)
    return question.information(found, STILL * rate) - question.known


def _next(
    arm: Arm,
    question: Question,
    safe: Safe,
    criterion: str,
    M: Array,
    some: Array,
    told: list[Array],
    here: int,
    at: float,
    duration: float,
) -> tuple[int, Move | None] | None:
    """The pose that adds most, and the move to it; None where time is up."""
    gain = [judge(criterion, M + one, question.asked)[0] for one in told]
    for k in np.argsort(gain)[::-1].tolist():
        if here < 0:
            return k, None
        if k == here:
            continue
        move = _slowly(safe.limits, at, some[here], some[k])
        if move.end + STILL <= duration and _is_safe(arm, safe, move):
            return k, move
    return None


def _slowly(limits: Limits, at: float, start: Array, goal: Array) -> Move:
    way = np.abs(goal - start)
    lasting = max(
        float((way * PEAK_VELOCITY / (PACE * limits.velocity)).max()),
        float(np.sqrt(way * PEAK_ACCELERATION / (PACE * limits.acceleration)).max()),
    )
    return Move(at, lasting, start, goal)


def _is_safe(arm: Arm, safe: Safe, move: Move) -> bool:
    try:
        prove(arm, Moves((Move(0.0, move.duration, move.start, move.goal),), move.duration), safe)
    except UnsafeMotionError:
        return False
    return True
