"""One restart: a random start, the climb, and the proof that its result is safe."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from urdyn.errors import UnsafeMotionError
from urdyn.identify.excite.climb import Climb, State, begin, climb_from, step, with_slack
from urdyn.identify.excite.proof import Proof, Safe, prove
from urdyn.identify.excite.question import Question
from urdyn.model.arm import Arm
from urdyn.model.cell import Cell
from urdyn.model.collision import collider
from urdyn.simulate.fourier import Series, draw
from urdyn.simulate.limits import Limits
from urdyn.types import Array

DRAWS = 24  # random starts, of which the best is taken
FIRM = 100.0  # rho with which starts that violate bounds are judged
ROUNDS, MORE = 6, 2  # of the method of multipliers, and per repair after a failed proof
# Allowance for what happens between moments: [m] added to the margin, and share of the torque.
SLACKS = ((0.01, 0.98), (0.02, 0.95), (0.04, 0.9), (0.08, 0.8))
KEPT = 0.999  # [-] share of a limit to use, so that a proof terminates

Report = Callable[[float, float], None]  # share of the restart done, the value reached


@dataclass(frozen=True)
class Task:
    """All that a restart needs, in any process."""

    question: Question
    cell: Cell
    limits: Limits
    margin: float  # [m]
    criterion: str
    rows: float  # of the future log
    harmonics: int
    period: float  # [s]
    seed: tuple[int, ...]


@dataclass(frozen=True)
class Found:
    """A series that is proven safe."""

    series: Series
    value: float  # of the criterion
    proof: Proof


def restart(task: Task, report: Report) -> Found | UnsafeMotionError:
    """The best found from one start; the error where it cannot be proven safe."""
    arm = loaded(task.question)
    safe = Safe(task.limits, collider(arm, task.cell, task.margin), task.margin)
    climb = climb_from(task.question, safe, task.criterion, task.rows, task.harmonics, task.period)
    climb = _slack(climb, safe, *SLACKS[0])
    state = begin(climb, _beginning(climb, task))
    for behind in range(ROUNDS):
        state = step(climb, state)
        report((behind + 1) / ROUNDS, climb.value(climb.coarse.series(state.x)))
    return _proven(climb, state, arm, safe)


def _proven(climb: Climb, state: State, arm: Arm, safe: Safe) -> Found | UnsafeMotionError:
    """The climb's result, repaired with more slack until it is proven safe."""
    error = UnsafeMotionError("nothing", "", 0.0)
    for slack in (*SLACKS[1:], SLACKS[-1]):
        series = fitted(climb.coarse.series(state.x), safe.limits)
        try:
            return Found(series, climb.value(series), prove(arm, series, safe))
        except UnsafeMotionError as short:
            error = short
        climb = _slack(climb, safe, *slack)
        for _ in range(MORE):
            state = step(climb, state)
    return error


def _slack(climb: Climb, safe: Safe, distance: float, torque: float) -> Climb:
    return with_slack(climb, distance, torque * safe.limits.torque)


def loaded(question: Question) -> Arm:
    """The arm with its load, as far as that is known."""
    return question.point.rigid


def fitted(series: Series, limits: Limits) -> Series:
    """The same, with every joint's excursion reduced as far as its limits require."""
    q = series.one_period()[0]
    top, low = q.max(axis=0), q.min(axis=0)
    v, a, _ = series.peaks()
    room = np.minimum(
        (KEPT * limits.room + limits.middle - series.middle) / (top - series.middle),
        (KEPT * limits.room - limits.middle + series.middle) / (series.middle - low),
    )
    share = np.minimum.reduce(
        [room, KEPT * limits.velocity / v, KEPT * limits.acceleration / a, np.ones_like(v)]
    )
    return series.scaled(share)


def _beginning(climb: Climb, task: Task) -> Array:
    """The best draw, with violated bounds penalised."""
    rng = np.random.default_rng(task.seed)
    joints = task.question.point.arm.joints
    best, x = np.inf, np.zeros(climb.coarse.size)
    for _ in range(DRAWS):
        shape = draw(joints, task.period, rng, task.harmonics)
        middle = task.limits.middle + 0.3 * task.limits.room * rng.uniform(-1.0, 1.0, joints)
        series = fitted(replace(shape, middle=middle).scaled(10.0), task.limits)
        y = climb.coarse.vector(series)
        cost = climb.lagrangian(y, begin(climb, y).mu, FIRM)[0]
        if cost < best:
            best, x = cost, y
    return x
