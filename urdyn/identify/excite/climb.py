"""One climb: from a random Fourier series to the most informative one within its bounds.

max criterion(M(x))  subject to  b(x) <= 0,    by the augmented Lagrangian [Nocedal2006]_:
min -criterion + sum (max(0, mu + rho b)² - mu²) / (2 rho),    mu <- max(0, mu + rho b)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from urdyn.identify.excite.basis import Basis, basis
from urdyn.identify.excite.bounds import clearances, holding, kinematic, torques
from urdyn.identify.excite.columns import columns
from urdyn.identify.excite.criterion import judge
from urdyn.identify.excite.proof import Safe
from urdyn.identify.excite.question import Question
from urdyn.simulate.fourier import Series
from urdyn.types import Array

MOMENTS = 8  # per period of the highest harmonic, at which information is summed
FINE = 32  # the same, at which angles, velocities and accelerations are bounded
STIFF, STIFFER = 10.0, 2.0  # rho of the first round, and its factor from round to round
STEPS, MEMORY = 35, 20  # of L-BFGS per round: iterations, and those that it remembers
POSES = 512  # random ones, to find how far apart things can be

Multipliers = tuple[Array, Array, Array, Array]


@dataclass(frozen=True, eq=False)
class Climb:
    """The problem as the optimiser sees it."""

    question: Question
    safe: Safe
    criterion: str
    rows: float  # of the future log
    coarse: Basis
    fine: Basis
    apart: Array  # (P,) [m] required distance of pairs, at the sampled moments

    def value(self, series: Series) -> float:
        """The criterion of a series."""
        found = columns(self.question.point, *self.coarse.motion(self.coarse.vector(series)))
        return judge(
            self.criterion, self.question.information(found, self.rows), self.question.asked
        )[0]

    def bounds(self, x: Array) -> Multipliers:
        """Values of all bounds: kinematics, torque, static torque, distance."""
        motion = self.coarse.motion(x)
        found, safe = columns(self.question.point, *motion), self.safe
        return (
            kinematic(safe.limits, self.fine.motion(x))[0],
            torques(safe.limits, found)[0],
            holding(safe.collider.arm, safe.limits, motion[0])[0],
            clearances(safe.collider, motion[0], self.apart)[0],
        )

    def lagrangian(self, x: Array, mu: Multipliers, rho: float) -> tuple[float, Array]:
        """The augmented Lagrangian and its gradient."""
        asked, safe, motion = self.question, self.safe, self.coarse.motion(x)
        found = columns(asked.point, *motion)
        value, S = judge(self.criterion, asked.information(found, self.rows), asked.asked)
        held, to_motion = kinematic(safe.limits, self.fine.motion(x))
        strained, to_load = torques(safe.limits, found)
        hung, to_pose = holding(safe.collider.arm, safe.limits, motion[0])
        near, to_angles = clearances(safe.collider, motion[0], self.apart)
        pushed = push(mu, (held, strained, hung, near), rho)
        cost = sum(_square(p) for p in pushed) - sum(_square(m) for m in mu)
        dq, dv, da = found.slopes(-asked.slope(found, self.rows, S), to_load(pushed[1]))
        gradient = self.coarse.gradient(dq + to_pose(pushed[2]) + to_angles(pushed[3]), dv, da)
        gradient += self.fine.gradient(*to_motion(pushed[0]))
        return -value + cost / (2.0 * rho), gradient


def _square(x: Array) -> float:
    return float(x.ravel() @ x.ravel())


def push(mu: Multipliers, bounds: Multipliers, rho: float) -> Multipliers:
    """max(0, mu + rho b)."""
    held, strained, hung, near = (
        np.maximum(0.0, m + rho * b) for m, b in zip(mu, bounds, strict=True)
    )
    return held, strained, hung, near


def climb_from(
    question: Question, safe: Safe, criterion: str, rows: float, harmonics: int, period: float
) -> Climb:
    """The problem for series of `harmonics` over `period` [s]."""
    joints = question.point.arm.joints
    coarse, fine = (basis(joints, harmonics, period, n * harmonics) for n in (MOMENTS, FINE))
    # A peak between two moments exceeds both by 1 / cos(pi / FINE) at most. [Ehlich1964]_
    limits, seen = safe.limits, np.cos(np.pi / FINE)
    tighter = replace(
        limits,
        lower=limits.middle - seen * limits.room,
        upper=limits.middle + seen * limits.room,
        velocity=seen * limits.velocity,
        acceleration=seen * limits.acceleration,
    )
    apart = np.full(len(safe.collider.pairs), safe.margin)
    return Climb(question, replace(safe, limits=tighter), criterion, rows, coarse, fine, apart)


def with_slack(climb: Climb, slack: float, torque: Array) -> Climb:
    """The same with `slack` [m] added to the margin, but at most half of each pair's room.

    Args:
        torque: limit at the sampled moments, (J,) [N·m].
    """
    safe, arm = climb.safe, climb.question.point.arm
    climb = replace(climb, safe=replace(safe, limits=replace(safe.limits, torque=torque)))
    q = np.random.default_rng(0).uniform(safe.limits.lower, safe.limits.upper, (POSES, arm.joints))
    most = safe.collider.distances(q).max(axis=0) - safe.margin
    return replace(climb, apart=safe.margin + np.minimum(slack, np.maximum(most, 0.0) / 2.0))


@dataclass(frozen=True, eq=False)
class State:
    """State of a climb."""

    x: Array
    mu: Multipliers
    rho: float = STIFF


def begin(climb: Climb, x: Array) -> State:
    """The state at x, with all multipliers 0."""
    held, strained, hung, near = (np.zeros_like(b) for b in climb.bounds(x))
    return State(x, (held, strained, hung, near))


def step(climb: Climb, state: State) -> State:
    """One round of the method of multipliers."""
    found = minimize(
        climb.lagrangian,
        state.x,
        args=(state.mu, state.rho),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": STEPS, "maxcor": MEMORY, "maxfun": STEPS + STEPS // 3},
    )
    x = np.asarray(found.x)
    return State(x, push(state.mu, climb.bounds(x), state.rho), STIFFER * state.rho)
