"""Work: programs that pick and place, and shifts of such programs with pauses between them.

A program is a loop of waypoints; at two of them the gripper closes and opens. What the tool carries
is an event, `Handling`, that both fidelities and the truth read like any fault.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import takewhile

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm, with_inertials
from urdyn.model.population import rated_torque
from urdyn.simulate.limits import Limits, comfortable
from urdyn.simulate.moves import TRIES, Move, fastest, one_after_the_other
from urdyn.simulate.payload import Payload
from urdyn.simulate.schedule import Handling
from urdyn.simulate.trajectory import Trajectory, grid
from urdyn.types import Array

LIFT = 0.1  # [m] above the place where a piece is picked or placed
GRIP = 0.6  # [s] to close or open a gripper
HEAVIEST, LIGHTEST = 0.03, 0.005  # [kg/N·m] over the strongest joint: up to 4.5 kg for a UR5e
AHEAD = 0.08  # [m] of the piece's centre, in front of the flange
PROGRAM = (300.0, 1200.0)  # [s] for which a shift runs one program
PAUSE = (30.0, 300.0)  # [s] between two programs


@dataclass(frozen=True, eq=False)
class Work:
    """A motion, and what is carried during it."""

    trajectory: Trajectory
    handling: tuple[Handling, ...] = ()  # none, or one


@dataclass(frozen=True, eq=False)
class Step:
    """A move, and what is in the gripper from just before it; None: no change."""

    move: Move
    carried: Array | None = None  # (10,) inertials in the last joint's frame


@dataclass(frozen=True, eq=False)
class Program:
    """A loop of moves; with the piece in the gripper from `taken` until `put`."""

    waypoints: Array  # (W, J) [rad]; the last leads to the first
    lasting: Array  # (W,) [s] of the move to the next waypoint
    taken: int  # waypoint at which the gripper closes
    put: int  # waypoint at which it opens
    piece: Array  # (10,) inertials in the last joint's frame

    def loop(self, begin: float) -> Iterator[Step]:
        """One round from `begin` [s]."""
        for k, start in enumerate(self.waypoints):
            grips = k in (self.taken, self.put)
            begin += GRIP * grips
            goal = self.waypoints[(k + 1) % len(self.waypoints)]
            move = Move(begin, float(self.lasting[k]), start, goal)
            yield Step(move, self.piece * (k == self.taken) if grips else None)
            begin = move.end


def pick_and_place(
    arm: Arm, duration: float, rate: float, rng: np.random.Generator, piece: Payload | None = None
) -> Work:
    """One program again and again, within `comfortable` limits.

    Args:
        piece: to be picked and placed; by default a random one.
    """
    return _work(_rounds(draw_program(arm, rng, piece), 0.0), grid(duration, rate))


def shift(arm: Arm, duration: float, rate: float, rng: np.random.Generator) -> Work:
    """Changing programs with pauses between them, as on a working day."""
    return _work(_programs(arm, rng), grid(duration, rate))


def draw_program(arm: Arm, rng: np.random.Generator, piece: Payload | None = None) -> Program:
    """Two random places, each approached from above; limits hold with the piece in the gripper."""
    carried = piece or draw_piece(arm, rng)
    inertials = arm.inertials.copy()
    inertials[-1] += carried.inertials()
    loaded, limits = with_inertials(arm, inertials), comfortable(arm)
    for _ in range(TRIES):
        here, there = rng.uniform(limits.lower, limits.upper, (2, arm.joints))
        waypoints = np.array([above(arm, here), here, above(arm, here), above(arm, there), there])
        waypoints = np.vstack([waypoints, above(arm, there)])
        lasting = _lasting(loaded, limits, waypoints)
        if lasting.all():
            return Program(waypoints, lasting, taken=1, put=4, piece=carried.inertials())
    raise InputError(f"{arm.name} finds no two places for a piece; take a lighter one")


def draw_piece(arm: Arm, rng: np.random.Generator) -> Payload:
    """A random piece as an arm of this size handles."""
    mass = rng.uniform(LIGHTEST, HEAVIEST) * rated_torque(arm).max()
    return Payload(mass, np.array([0.0, 0.0, AHEAD]))


def above(arm: Arm, q: Array) -> Array:
    """The pose with the tool about LIFT higher, same orientation: a damped step, (J,) [rad]."""
    J = arm.jacobian(q)
    up = np.array([0.0, 0.0, LIFT, 0.0, 0.0, 0.0])
    return np.asarray(q + J.T @ np.linalg.solve(J @ J.T + 1e-3 * np.eye(6), up))


def _lasting(arm: Arm, limits: Limits, waypoints: Array) -> Array:
    """Time of the move from each waypoint to the next, (W,) [s]; 0 where the limits forbid it."""
    goals = np.roll(waypoints, -1, axis=0)
    return np.array([fastest(arm, limits, a, b) for a, b in zip(waypoints, goals, strict=True)])


def _rounds(program: Program, begin: float, stop: float = np.inf) -> Iterator[Step]:
    """The program repeated, until a round ends after `stop` [s]."""
    while begin < stop:
        for step in program.loop(begin):
            yield step
        begin = step.move.end


def _programs(arm: Arm, rng: np.random.Generator) -> Iterator[Step]:
    """Successive programs, with a pause after each."""
    begin, program = 0.0, draw_program(arm, rng)
    while True:
        for step in _rounds(program, begin, begin + rng.uniform(*PROGRAM)):
            yield step
        place, begin = step.move.goal, step.move.end + rng.uniform(*PAUSE)
        program = draw_program(arm, rng)
        while not (lasting := fastest(arm, comfortable(arm), place, program.waypoints[0])):
            program = draw_program(arm, rng)
        yield Step(Move(begin, lasting, place, program.waypoints[0]))
        begin += lasting


def _work(steps: Iterator[Step], t: Array) -> Work:
    """The work of as many steps as end in time."""
    done = list(takewhile(lambda step: step.move.end <= t[-1], steps))
    if not done:
        raise InputError(f"no move fits into {t[-1]:g} s; ask for more")
    grips = [step for step in done if step.carried is not None]
    handling = Handling(
        np.array([step.move.begin - GRIP / 2.0 for step in grips]),
        np.array([step.carried for step in grips]),
    )
    trajectory = one_after_the_other([step.move for step in done], t)
    return Work(trajectory, (handling,) if grips else ())
