"""A joint's friction: presliding hysteresis and the terms that build on it.

The torque that a joint loses, beside what moves its links and its rotor, is a sum of terms, each
linear in one coefficient:

    tau_f = (f + g exp(-|v|/v_s) + beta |tau_load|) s + alpha v + o + ...

`s` in [-1, 1] is the presliding state: the bristles of the contact follow the joint over a distance
delta before it slides [Dahl1968]_; a second, softer family with a tenfold distance carries the
share `tail` [AlBender2005]_.

Where a joint reverses, friction in the current reverses some milliseconds before it: controllers
compensate the friction of the motion that they command. So the bristles follow q + lead v, the
motion to come.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise, starmap
from types import MappingProxyType

import numpy as np

from urdyn.model.drive import FRICTION, Drive
from urdyn.types import Array, Motion

WORKING_SPEED = 0.5  # [rad/s] of a joint, mean at work
TAIL_DISTANCE = 10.0  # [-] distance of the softer bristles over that of the stiffer ones
FAMILIES = np.array([[1.0], [TAIL_DISTANCE]])
GEAR_RATIO = 101.0  # [-] motor turns per joint turn of UR's strain-wave gears
RIPPLE_ORDER = 2.0 * GEAR_RATIO  # the wave generator meets a tooth twice a motor turn


@dataclass(frozen=True, eq=False)
class Bristles:
    """Presliding state of the stiff and the soft family, with its slope in the log of distance."""

    state: Array  # (2, N, J) [-]
    slope: Array  # (2, N, J) [-]
    travelled: Array  # (N, J) [rad] by the joint since the state was unknown

    @property
    def end(self) -> Bristles:
        """The last row: where the next one begins."""
        return self.since(-1)

    def since(self, row: int) -> Bristles:
        """Without the rows before `row`."""
        return Bristles(self.state[:, row:], self.slope[:, row:], self.travelled[row:])

    def together(self, tail: Array) -> Array:
        """Presliding state s with the share `tail` (J,) in the soft family, (N, J)."""
        return np.asarray((1.0 - tail) * self.state[0] + tail * self.state[1])


def bristles(
    motion: Motion, distance: Array, start: Bristles | None = None, lead: float = 0.0
) -> Bristles:
    """How the bristles of every joint follow a motion.

    Where they are unknown, at the beginning and after a gap, friction at rest is taken as zero.

    Args:
        distance: of the stiff family, (J,) [rad].
        start: `end` of the motion before, which this one continues.
        lead: by which they precede the motion [s].
    """
    moved, way = travel(motion, lead), np.abs(travel(motion))
    state, slope = np.empty((2, *moved.shape)), np.empty((2, *moved.shape))
    travelled = np.empty_like(way)
    none = np.zeros((2, 1, motion.joints))
    unknown = Bristles(none, none, none[0])
    before = start or unknown
    for rows in starmap(slice, pairwise((0, *motion.breaks, len(motion)))):
        first = np.concatenate([before.state, before.slope], axis=1)  # (2, 2, J)
        for family, of in enumerate(FAMILIES * distance):
            for j in range(motion.joints):
                state[family, rows, j], slope[family, rows, j] = hysteresis(
                    moved[rows, j], of[j], first[family, :, j]
                )
        travelled[rows] = way[rows].cumsum(axis=0) + before.travelled
        before = unknown
    return Bristles(state, slope, travelled)


def follow(state: Array, travel: Array, distance: Array) -> Array:
    """State (2, J) of all bristles after one more stretch of travel (J,): `hysteresis`, live."""
    side = np.sign(travel)
    keep = np.exp(-np.abs(travel) / (FAMILIES * distance))
    return np.asarray(side + keep * (state - side))


def travel(motion: Motion, lead: float = 0.0) -> Array:
    """Displacement since the row before by the trapezoidal rule, (N, J) [rad]; 0 after a gap.

    Args:
        lead: of q + lead v [s].
    """
    v = np.nan_to_num(motion.v)
    before = np.vstack([v[:1], v[:-1]])
    dt = motion.step[:, None]
    return np.asarray(0.5 * (v + before) * dt + lead * (v - before) * (dt > 0.0))


def hysteresis(travel: Array, distance: float, start: Array) -> tuple[Array, Array]:
    """Dahl state of one joint and its derivative in log distance, after each stretch of travel.

    ds/dq = (1 - s sign(dq)) / distance, solved exactly: with r the way since the last reversal
    over the distance, s = side + (s_0 - side) exp(-r). The result does not depend on the sampling
    rate, and only reversals are a loop.

    Args:
        travel: joint displacement since the row before, (N,) [rad].
        distance: characteristic displacement of the state, > 0 [rad].
        start: state and derivative before the first row, (2,) [-].
    """
    ratio, side = np.abs(travel) / distance, np.sign(travel)
    moving = np.flatnonzero(side)
    begins = moving[np.diff(side[moving], prepend=0.0) != 0.0]  # rows of reversals
    leg = np.searchsorted(begins, np.arange(len(travel)), side="right")  # 0: before the first
    total = np.cumsum(ratio)
    before = np.concatenate([[0.0], total[begins] - ratio[begins]])
    r = total - before[leg]
    sides = np.concatenate([[0.0], side[begins]])
    s, d = _legs(side[begins[:-1]], r[begins[1:] - 1], start)
    keep = np.where(leg > 0, np.exp(-r), 1.0)
    pull = s[leg] - sides[leg]
    state = np.where(leg > 0, sides[leg] + keep * pull, s[0])
    return state, np.where(leg > 0, keep * (d[leg] + r * pull), d[0])


def _legs(sides: Array, lengths: Array, start: Array) -> tuple[Array, Array]:
    """State and derivative before anything moves, and at the beginning of every leg.

    Args:
        sides: sign of motion in each leg but the last.
        lengths: travel of each over the distance.
    """
    state, slope = float(start[0]), float(start[1])
    states, slopes = [state, state], [slope, slope]
    for side, r in zip(sides.tolist(), lengths.tolist(), strict=True):
        keep = math.exp(-r)
        slope = keep * (slope + r * (state - side))
        state = side + keep * (state - side)
        states.append(state)
        slopes.append(slope)
    return np.array(states), np.array(slopes)


@dataclass(frozen=True, eq=False)
class Contact:
    """What friction depends on: at one moment, where shapes are (J,), or at many, (N, J)."""

    q: Array  # [rad] of the motors, seen at the joint; v likewise
    v: Array  # [rad/s]
    temperature: Array  # [°C]; NaN where not measured
    load: Array  # [N·m] rigid-body torque that the gear transmits
    s: Array  # [-] presliding state


def feature(name: str, at: Contact, drive: Drive) -> Array:
    """The factor of the coefficient of this name in FRICTION, in the shape of `at.s`.

    The law of friction: every term of it is taken from here.

    Args:
        drive: gives the Stribeck velocity and the reference temperature.
    """
    match name:
        case "coulomb":
            return at.s
        case "viscous":
            return at.v
        case "structural":
            return np.asarray(np.abs(at.load) * at.s)
        case "offset":
            return np.ones_like(at.s)
        case "stribeck":
            return np.asarray(fading(at.v, drive) * at.s)
        case "ripple_cos":
            return np.asarray(np.cos(RIPPLE_ORDER * at.q))
        case "ripple_sin":
            return np.asarray(np.sin(RIPPLE_ORDER * at.q))
        case "thermal":
            # Where not measured, the joint is taken to be at the reference temperature.
            warmer = at.temperature - drive.temperature
            return np.asarray(np.where(np.isnan(warmer), 0.0, warmer) * at.v)
    raise AssertionError(f"no term of friction is called {name}")


def features(at: Contact, drive: Drive) -> dict[str, Array]:
    """`feature` of all FRICTION."""
    return {name: feature(name, at, drive) for name in FRICTION}


def fading(v: Array, drive: Drive) -> Array:
    """The share left at a velocity, of friction that fades with speed, (..., J) [-]."""
    return np.asarray(np.exp(-np.abs(v) / drive.stribeck_velocity))


def present(drive: Drive, names: Iterable[str] = FRICTION) -> tuple[str, ...]:
    """The terms among `names` that an arm's drives have."""
    return tuple(name for name in names if getattr(drive, name).any())


def friction_torque(
    at: Contact,
    drive: Drive,
    names: Iterable[str] = FRICTION,
    factors: Mapping[str, Array] = MappingProxyType({}),
) -> Array:
    """Torque that friction takes, in the shape of `at.s` [N·m].

    Args:
        names: of the terms that are summed up.
        factors: on coefficients, by their names [-]; 1 by default.
    """
    torque = np.zeros(at.s.shape)
    for name in names:
        term = getattr(drive, name) * feature(name, at, drive)
        torque += term * factors[name] if name in factors else term
    return torque
