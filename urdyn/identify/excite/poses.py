"""A slow set of poses, for gravity: each adds the most information to those before it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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

CANDIDATES = 100  # random poses
PACE = 0.3  # [-] share of the velocity and acceleration limits, for moves between poses
STILL = 1.0  # [s] before each move, and after the last
NEAR = 0.2  # [-] share of the velocity limit to pass a pose at: at rest, friction is undetermined


@dataclass(frozen=True, eq=False)
class Choice:
    """Poses to choose from, and the information of each."""

    arm: Arm  # with its load
    question: Question
    safe: Safe
    criterion: str
    poses: Array  # (N, J) [rad], free
    information: tuple[Array, ...]  # N of (P, P), one per pose

    def best(self, known: Array) -> list[int]:
        """The poses, sorted by how much they add to what is known, most first."""
        asked = self.question.asked
        gain = [judge(self.criterion, known + one, asked)[0] for one in self.information]
        return [int(k) for k in np.argsort(gain)[::-1]]


def poses(
    arm: Arm,
    question: Question,
    safe: Safe,
    criterion: str,
    duration: float,
    rng: np.random.Generator,
) -> tuple[Moves, Proof]:
    """Moves from pose to pose, and the proof that they are safe.

    Raises:
        InputError: there is no time for two poses, or no safe move between any.
    """
    limits = safe.limits
    some = limits.middle + limits.room * rng.uniform(-0.99, 0.99, (CANDIDATES, arm.joints))
    some = some[(safe.collider.distances(some) >= safe.margin).all(axis=1)]
    information = tuple(_information(question, pose, limits) for pose in some)
    choice = Choice(arm, question, safe, criterion, some, information)
    moves = tuple(_tour(choice, duration)) if information else ()
    if not moves:
        raise InputError(f"no way between two poses in {duration:g} s; ask for more")
    path = Moves(moves, duration)
    return path, prove(arm, path, safe)


def _tour(choice: Choice, duration: float) -> Iterator[Move]:
    """Moves to the pose that adds most, and from there to the next, until time is up."""
    known, at = choice.question.known, STILL
    here = choice.best(known)[0]
    while True:
        known = known + choice.information[here]
        for there in choice.best(known):
            move = _slowly(choice.safe.limits, at, choice.poses[here], choice.poses[there])
            if there != here and move.end + STILL <= duration and _is_safe(choice, move):
                break
        else:
            return
        yield move
        here, at = there, move.end + STILL


def _information(question: Question, pose: Array, limits: Limits) -> Array:
    """Information from passing a pose slowly in both directions, (P, P)."""
    v = NEAR * limits.velocity * np.array([[1.0], [-1.0]])
    found = columns(question.point, np.array([pose, pose]), v, 0.0 * v)
    return question.information(found, STILL * question.rate) - question.known


def _slowly(limits: Limits, at: float, start: Array, goal: Array) -> Move:
    way = np.abs(goal - start)
    lasting = max(
        float((way * PEAK_VELOCITY / (PACE * limits.velocity)).max()),
        float(np.sqrt(way * PEAK_ACCELERATION / (PACE * limits.acceleration)).max()),
    )
    return Move(at, lasting, start, goal)


def _is_safe(choice: Choice, move: Move) -> bool:
    alone = Moves((Move(0.0, move.duration, move.start, move.goal),), move.duration)
    try:
        prove(choice.arm, alone, choice.safe)
    except UnsafeMotionError:
        return False
    return True
