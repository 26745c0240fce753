"""A probe: one joint moves to and fro, to show its friction, presliding and backlash.

Strokes from creeping to faster and then from long to short show friction. In the last part the
joint turns without a pause, as fast as allowed, about a pose where its load then changes sign
quickly: a gear whose load keeps its sign, or changes it slowly, does not show its backlash.
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
from urdyn.simulate.moves import (
    PEAK_ACCELERATION,
    PEAK_VELOCITY,
    RAMP,
    Move,
    Moves,
    along,
    unit_peaks,
)
from urdyn.types import Array

SWING = 0.5  # [rad] to either side, at most
SPEEDS = (0.02, 0.05, 0.12, 0.95)  # [-] shares of the velocity limit, one cycle each
STROKES = 3.0 * 0.85 ** np.arange(15)  # [s] per stroke: the longest with which all fit
SHORT = (0.016, 0.008, 0.004, 0.002, 0.001)  # [rad] strokes that show presliding
TURNING = 0.3  # [-] share of the time that the last part takes
TURN = 0.5  # [s] of its strokes: half of it, up to the next rest, is what judging a reversal takes
STEADY = 0.5  # [-] ramp of its strokes: their acceleration changes sign quickly, at full speed
FAST = np.linspace(0.25, 0.75, 21)[:, None]  # [-] of their time: half their speed or more
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
    for pose in _turning_over(arm, safe, joint, rng)[:TRIES]:
        moves = (Move(t, T, pose + a * side, pose + b * side, r) for t, T, a, b, r in strokes)
        path = Moves(tuple(moves), duration)
        try:
            return path, prove(arm, path, safe)
        except UnsafeMotionError as short:
            error = short
    raise error


def _turning_over(arm: Arm, safe: Safe, joint: int, rng: np.random.Generator) -> Array:
    """Poses that seem free, sorted by how fast the load changes sign while the joint turns.

    The current that lacks in a gap grows from the reversal on with the slope of the load.
    """
    limits, swing = safe.limits, np.zeros((9, arm.joints))
    swing[:, joint] = np.linspace(-1.0, 1.0, len(swing)) * min(SWING, limits.room[joint])
    room = limits.room - swing.max(axis=0)
    poses = limits.middle + room * rng.uniform(-1.0, 1.0, (CANDIDATES, arm.joints))
    clear = (safe.collider.distances(poses[:, None] + swing) >= safe.margin).all(axis=(1, 2))
    across = _turn(limits, joint) * np.eye(arm.joints)[joint]
    q, v, a = along(FAST, TURN, -across, across, STEADY)
    q = poses[clear, None] + q
    load = arm.torque(q, v + 0.0 * q, a + 0.0 * q)[:, :, joint]
    slope = np.abs(np.diff(load)) * (load[:, 1:] * load[:, :-1] < 0.0)
    return np.asarray(poses[clear][np.argsort(-slope.max(axis=1), kind="stable")])


def _strokes(
    limits: Limits, joint: int, duration: float
) -> Iterator[tuple[float, float, float, float, float]]:
    """Start [s] and duration [s] of each stroke, its ends relative to the pose [rad], its ramp [-].

    Three strokes per rung, always complete: out from the middle, across, and back. Then as many
    across as there is time for.
    """
    ladders = (_ladder(limits, joint, stroke) for stroke in STROKES)
    time = (1.0 - TURNING) * (duration - 2.0 * STILL)
    ladder = next((one for one in ladders if 3.0 * sum(t for _, t in one) <= time), [])
    if not ladder:
        return
    at, place = STILL, 0.0
    for half, lasting in cycle(ladder):
        if at + 3.0 * lasting > STILL + time:
            break
        for goal in (half, -half, 0.0):
            yield at, lasting, place, goal, RAMP
            at, place = at + lasting, goal
    half, pairs = _turn(limits, joint), int((duration - STILL - at) / TURN - 1.0) // 2
    for goal in (*(half, -half) * pairs, 0.0):
        yield at, TURN, place, goal, STEADY
        at, place = at + TURN, goal


def _ladder(limits: Limits, joint: int, stroke: float) -> list[tuple[float, float]]:
    """Half a stroke's length [rad] and its duration [s], slow to fast, then long to short."""
    most, rungs = min(SWING, 0.99 * float(limits.room[joint])), []
    for speed in np.array(SPEEDS) * limits.velocity[joint]:
        half = min(most, 0.5 * speed * stroke / PEAK_VELOCITY)
        fastest = np.sqrt(2.0 * half * PEAK_ACCELERATION / (0.99 * limits.acceleration[joint]))
        rungs.append((half, max(2.0 * half * PEAK_VELOCITY / speed, float(fastest))))
    return rungs + [(0.5 * way, stroke) for way in SHORT]


def _turn(limits: Limits, joint: int) -> float:
    """Half a stroke's length in the last part [rad]: as far as is allowed in its time."""
    velocity, acceleration, _ = unit_peaks(STEADY)
    fast = 0.95 * float(limits.velocity[joint]) * TURN / velocity
    hard = 0.99 * float(limits.acceleration[joint]) * TURN**2 / acceleration
    return min(0.99 * float(limits.room[joint]), 0.5 * fast, 0.5 * hard)
