"""A probe: one joint moves to and fro, to show its friction, presliding and backlash.

The strokes go from creeping to fast and then from long to short. They are made about a pose where
gravity torque changes sign, if there is one: in a gear that gravity preloads, backlash does not
show.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle

import numpy as np

from urdyn.errors import InputError, UnsafeMotionError
from urdyn.given import given_count
from urdyn.identify.excite.proof import Proof, Safe, prove
from urdyn.model.arm import Arm
from urdyn.simulate.limits import Limits
from urdyn.simulate.moves import PEAK_ACCELERATION, PEAK_VELOCITY, Move, Moves
from urdyn.types import Array

SWING = 0.5  # [rad] to either side, at most
SPEEDS = (0.02, 0.05, 0.12, 0.3, 0.6, 0.95)  # [-] shares of the velocity limit, one cycle each
STROKES = 3.0 * 0.85 ** np.arange(20)  # [s] per stroke: the longest with which all fit
SHORT = (0.016, 0.008, 0.004, 0.002, 0.001)  # [rad] strokes that show presliding
LEAST = 20.0  # [s] enough to probe any joint of all arms
STILL = 0.5  # [s] before the first and after the last
CANDIDATES, TRIES = 300, 20  # random poses, and how many of the best are tried for a proof


def probe(
    arm: Arm, safe: Safe, joint: int, duration: float, rng: np.random.Generator
) -> tuple[Moves, Proof]:
    """The probe of a joint of an arm with its load, and the proof that it is safe.

    Raises:
        InputError: there is no such joint, or no time for its strokes.
        UnsafeMotionError: no pose leaves the joint room.
    """
    joint = given_count(joint, "joint", 0, arm.joints - 1)
    strokes = list(_strokes(safe.limits, joint, duration))
    if not strokes:
        raise InputError(f"{duration:g} s are too short for a probe; ask for {LEAST:g} s or more")
    error = UnsafeMotionError(f"{arm.joint_names[joint]} finds no room to swing", "distance", 0.0)
    side = np.eye(arm.joints)[joint]
    for pose in _leaning(arm, safe, joint, rng)[:TRIES]:
        moves = (Move(at, last, pose + a * side, pose + b * side) for at, last, a, b in strokes)
        path = Moves(tuple(moves), duration)
        try:
            return path, prove(arm, path, safe)
        except UnsafeMotionError as short:
            error = short
    raise error


def _leaning(arm: Arm, safe: Safe, joint: int, rng: np.random.Generator) -> Array:
    """Poses that seem free, sorted by how far gravity torque takes both signs within the swing."""
    limits, swing = safe.limits, np.zeros((9, arm.joints))
    swing[:, joint] = np.linspace(-1.0, 1.0, len(swing)) * min(SWING, limits.room[joint])
    room = limits.room - swing.max(axis=0)
    poses = limits.middle + room * rng.uniform(-1.0, 1.0, (CANDIDATES, arm.joints))
    along = poses[:, None] + swing
    clear = (safe.collider.distances(along) >= safe.margin).all(axis=(1, 2))
    gravity = arm.torque(along, 0.0 * along, 0.0 * along)[:, :, joint]
    both_sides = np.minimum(gravity.max(axis=1), -gravity.min(axis=1))
    return np.asarray(poses[clear][np.argsort(-both_sides[clear], kind="stable")])


def _strokes(
    limits: Limits, joint: int, duration: float
) -> Iterator[tuple[float, float, float, float]]:
    """Start [s] and duration [s] of each stroke, and its ends relative to the pose [rad].

    Three strokes per rung, always complete: out from the middle, across, and back.
    """
    ladders = (_ladder(limits, joint, stroke) for stroke in STROKES)
    time = duration - 2.0 * STILL
    ladder = next((one for one in ladders if 3.0 * sum(t for _, t in one) <= time), [])
    at, place = STILL, 0.0
    for half, lasting in cycle(ladder):
        if at + 3.0 * lasting + STILL > duration:
            return
        for goal in (half, -half, 0.0):
            yield at, lasting, place, goal
            at, place = at + lasting, goal


def _ladder(limits: Limits, joint: int, stroke: float) -> list[tuple[float, float]]:
    """Half a stroke's length [rad] and its duration [s], slow to fast, then long to short."""
    most, rungs = min(SWING, 0.99 * float(limits.room[joint])), []
    for speed in np.array(SPEEDS) * limits.velocity[joint]:
        half = min(most, 0.5 * speed * stroke / PEAK_VELOCITY)
        fastest = np.sqrt(2.0 * half * PEAK_ACCELERATION / (0.99 * limits.acceleration[joint]))
        rungs.append((half, max(2.0 * half * PEAK_VELOCITY / speed, float(fastest))))
    return rungs + [(0.5 * way, stroke) for way in SHORT]
