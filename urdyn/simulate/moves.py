"""Point-to-point motion, as at work; it shows stiction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.simulate.limits import Limits, comfortable
from urdyn.simulate.trajectory import Trajectory, blocks, grid
from urdyn.types import Array

RAMP = 1.0 / 3.0  # [-] share of a move's time that each of its two ramps takes, usually
PACES = (1.0, 1.25, 1.6, 2.0, 3.0)  # [-] of a move's time, tried until its torque is allowed
TRIES = 100  # goals drawn before giving up
FINE = np.linspace(0.0, 1.0, 61)[:, None]  # [-] of its time, where a move's limits are verified

ENDS = ("start", "goal")
Each = TypeVar("Each", float, Array)


def unit_peaks(ramp: Each) -> tuple[Each, Each, Each]:
    """Largest velocity, acceleration and jerk of the unit move [-], each in the shape of ramp."""
    velocity = 1.0 / (1.0 - ramp)
    return velocity, 1.5 * velocity / ramp, 6.0 * velocity / ramp**2


PEAK_VELOCITY, PEAK_ACCELERATION, _ = unit_peaks(RAMP)


@dataclass(frozen=True, eq=False)
class Move:
    """All joints from rest to rest at the same time."""

    begin: float  # [s]
    duration: float  # [s]
    start: Array  # (J,) [rad]
    goal: Array  # (J,) [rad]
    ramp: float = RAMP  # [-] up to 1/2, with which its velocity is never constant

    @property
    def end(self) -> float:
        """Time at which it is at rest again [s]."""
        return self.begin + self.duration


def point_to_point(
    arm: Arm, duration: float, rate: float, rng: np.random.Generator, dwell: float = 0.5
) -> Trajectory:
    """Random goals within `comfortable` limits, at rest for `dwell` [s] before each move."""
    t = grid(duration, rate)
    moves = list(_moves(arm, float(t[-1]), rng, dwell))
    if not moves:
        raise InputError(f"no move fits into {duration:g} s with {dwell:g} s of rest; ask for more")
    return one_after_the_other(moves, t)


@dataclass(frozen=True)
class Moves:
    """A sequence of moves, at rest between them."""

    moves: tuple[Move, ...]
    lasting: float  # [s]

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """q, v, a at times (N,) [s], each (N, J)."""
        when = np.array([(m.begin, m.duration, m.ramp) for m in self.moves])
        begin, lasting, ramp = when.T[:, :, None]
        start, goal = (np.array([getattr(m, name) for m in self.moves]) for name in ENDS)
        i = np.maximum(np.searchsorted(begin[:, 0], t, side="right") - 1, 0)
        u = np.clip((t[:, None] - begin[i]) / lasting[i], 0.0, 1.0)
        q, v, a = along(u, lasting[i], start[i], goal[i], ramp[i])
        return q, v, a

    def peaks(self) -> tuple[Array, Array, Array]:
        """Upper bounds of |v|, |a| and |jerk|, (J,) each."""
        way = np.array([np.abs(m.goal - m.start) for m in self.moves])
        lasting, ramp = np.array([(m.duration, m.ramp) for m in self.moves]).T[:, :, None]
        unit = unit_peaks(ramp)
        v, a, jerk = ((peak * way / lasting**n).max(axis=0) for n, peak in enumerate(unit, 1))
        return v, a, jerk


def one_after_the_other(moves: Sequence[Move], t: Array) -> Trajectory:
    """Moves as a trajectory on the grid t (N,) [s], at rest between them."""
    path, motion = Moves(tuple(moves), float(t[-1])), np.empty((3, len(t), len(moves[0].start)))
    for rows in blocks(len(t)):
        motion[:, rows] = path.at(t[rows])
    return Trajectory(t, *motion)


def along(
    u: Array, duration: Array | float, start: Array, goal: Array, ramp: Array | float = RAMP
) -> tuple[Array, ...]:
    """q, v, a of a move at the shares `u` (N, 1) [-] of its duration [s], each (N, J)."""
    s, ds, dds = unit_move(u, ramp)
    way = goal - start
    return start + way * s, way * ds / duration, way * dds / duration**2


def unit_move(u: Array, ramp: Array | float) -> tuple[Array, Array, Array]:
    """From 0 to 1 in unit time: a trapezoid of velocity whose ramps are 3 x² - 2 x³.

    Returns position, velocity and (continuous) acceleration, in the shape of u in [0, 1].
    """
    mirrored = np.minimum(u, 1.0 - u)
    x = np.minimum(mirrored / ramp, 1.0)
    way = ramp * (x**3 - 0.5 * x**4) + np.maximum(mirrored - ramp, 0.0)
    peak = 1.0 / (1.0 - ramp)
    place = peak * np.where(u == mirrored, way, 1.0 - ramp - way)
    slope = peak * x * x * (3.0 - 2.0 * x)
    bend = peak * 6.0 * x * (1.0 - x) / ramp
    return place, slope, np.where(u == mirrored, bend, -bend)


def _moves(arm: Arm, end: float, rng: np.random.Generator, dwell: float) -> Iterator[Move]:
    """Successive moves, each after a rest, as many as end in time."""
    limits = comfortable(arm)
    move = _draw(arm, limits, dwell, limits.middle, rng)
    while move.end + dwell <= end:
        yield move
        move = _draw(arm, limits, move.end + dwell, move.goal, rng)


def _draw(arm: Arm, limits: Limits, begin: float, start: Array, rng: np.random.Generator) -> Move:
    """A move to a random goal, as fast as the limits allow."""
    for _ in range(TRIES):
        goal = rng.uniform(limits.lower, limits.upper)
        if lasting := fastest(arm, limits, start, goal):
            return Move(begin, lasting, start, goal)
    raise InputError(f"{arm.name} finds no move within its limits; take a lighter payload")


def fastest(arm: Arm, limits: Limits, start: Array, goal: Array) -> float:
    """Time that a move takes within the limits [s]; 0 where its torques are beyond them."""
    way = np.abs(goal - start)
    least = max(
        np.max(way * PEAK_VELOCITY / limits.velocity),
        np.sqrt(np.max(way * PEAK_ACCELERATION / limits.acceleration)),
    )
    for pace in PACES:
        if limits.hold(arm, *along(FINE, pace * least, start, goal)):
            return float(pace * least)
    return 0.0
