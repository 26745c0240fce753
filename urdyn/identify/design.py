"""The linear problem at a point: each unknown's contribution to each joint's torque.

Around a `Dynamics` the torque is linear in link inertials and drive coefficients, and nearly so in
the shape of friction (presliding distance and tail, Stribeck velocity):

    tau_j = Phi_j w_j,    w_j = [pi of links j.., coefficients, steps in the shape and in time]

The load of structural damping and the presliding state are taken at the point.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from urdyn.model.drive import LINEAR, STEPS
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Bristles, Contact, fading, features
from urdyn.types import STANDSTILL, Array, Mask, Motion

TERMS = (*LINEAR, *STEPS)
TICK = 1e-5  # [s] step of the torque's time derivative
SETTLED = 50.0  # presliding distances of travel after which the initial state is forgotten
BLOCK = 8192  # rows of a regressor in memory at a time
RESTING = 0.25 * STANDSTILL  # [rad/s] a joint that creeps faster slides
AROUND = 0.05  # [s] to either side of a reversal, in which friction may be mispredicted


@dataclass(frozen=True, eq=False)
class Block:
    """Some rows of uninterrupted motion, with the presliding state integrated through them."""

    motion: Motion  # kinematics at the time of the current
    bristles: Bristles
    # (N, J) measured, the joint does not stand, and its presliding state has forgotten its start
    known: Mask
    turning: Mask  # (N, J) near a reversal or a rest of the joint, or in a rest

    @property
    def instrumental(self) -> Block:
        """The same with the instrument's accelerations; itself where there is no instrument."""
        if np.isnan(self.motion.instrument).all():
            return self
        return replace(self, motion=replace(self.motion, a=self.motion.instrumental))


def blocks(point: Dynamics, motion: Motion) -> Iterator[Block]:
    """A motion block by block, with the presliding state of an arm like `point`."""
    ahead = motion.ahead(point.drive.time_offset)
    edges = [0, *motion.breaks, len(motion)]
    stands = np.concatenate([standing(ahead.slice(*rows)) for rows in pairwise(edges)])
    turns = turning(ahead, stands)
    distance = point.drive.presliding_distance
    for start, stop in pairwise(edges):
        memory: Bristles | None = None
        for row in range(start, stop, BLOCK):
            # A block begins one row early, so that the travel into its first row counts.
            lead = min(row - start, 1)
            part = ahead.slice(row - lead, min(row + BLOCK, stop))
            follow = point.bristles(part, memory)
            known = _measured(point, part) & (follow.travelled > SETTLED * distance)
            rows = slice(row, row + len(part) - lead)
            slides = known[lead:] & ~stands[rows]
            yield Block(part.slice(lead), follow.since(lead), slides, turns[rows])
            memory = follow.end


def standing(motion: Motion) -> Mask:
    """Where a joint is at rest for longer than it takes to reverse, (N, J).

    Stiction sets its current, and its measured motion does not tell how much of it: errors of some
    microradians as it stops bend the bristles, and what remains of them lasts for the whole rest.
    Taken as known, rests are explained by friction that fades at next to no speed.
    """
    return np.stack([_standing(motion.t, np.abs(v) <= RESTING) for v in motion.v.T], axis=1)


def _standing(t: Array, slow: Mask) -> Mask:
    """The same for one joint, from where it is slow, (N,)."""
    stands, reversal = np.zeros_like(slow), 2.0 * AROUND * (1.0 + 1e-6)  # not but for rounding
    for run in runs(slow):
        stands[run] = t[run][-1] - t[run][0] > reversal
    return stands


def turning(motion: Motion, stands: Mask) -> Mask:
    """Where a joint is about to reverse or stand, has just done so, or stands, (N, J).

    A joint that sticks is held by whatever friction it takes, and its acceleration jumps: no law
    that computes friction from the measured motion is exact there.
    """
    each = zip(motion.v.T, stands.T, strict=True)
    return np.stack([_turning(motion.t, np.sign(v) * ~rests) for v, rests in each], axis=1)


def _turning(t: Array, way: Array) -> Mask:
    """The same for one joint's direction, (N,): an hour of all joints would fill memory."""
    turns = (np.diff(way, prepend=way[:1]) != 0.0) | (way == 0.0)
    last = np.maximum.accumulate(np.where(turns, t, -np.inf))
    next_ = np.minimum.accumulate(np.where(turns, t, np.inf)[::-1])[::-1]
    return np.asarray(np.minimum(t - last, next_ - t) <= AROUND)


def _measured(point: Dynamics, motion: Motion) -> Mask:
    moving = np.isfinite(motion.q + motion.v + motion.a).all(axis=1, keepdims=True)
    measured = np.isfinite(motion.current) & ~point.undrawn(motion.current)
    return np.asarray(measured & moving)


@dataclass(frozen=True, eq=False)
class Design:
    """A block as the linear problem."""

    rigid: Array  # (N, J, 10 J), the regressor
    terms: Array  # (len(TERMS), N, J)
    known: Mask  # (N, J)
    turning: Mask  # (N, J)

    def columns(self, joint: int) -> Array:
        """Phi_j without the links that the joint does not carry, (N, 10 (J - j) + len(TERMS))."""
        return np.hstack([self.rigid[:, joint, 10 * joint :], self.terms[:, :, joint].T])


def design(point: Dynamics, block: Block) -> Design:
    """The linear problem of a block at `point`."""
    motion, drive = block.motion, point.drive
    rigid = point.arm.regressor(motion.q, motion.v, motion.a)
    load = rigid @ point.loaded().ravel()
    s = block.bristles.together(drive.presliding_tail)
    friction = features(Contact(motion.q, motion.v, motion.temperature, load, s), drive)
    linear = {"rotor_inertia": motion.a, **friction}
    torque = load + sum(linear[name] * getattr(drive, name) for name in LINEAR)
    after = point.torque(motion.ahead(TICK), s)  # with friction's reversals unchanged
    columns = {
        **linear,
        **_slopes(point, block, load, s),
        "time_offset": (after - torque) / TICK,
    }
    terms = np.array([columns[name] for name in TERMS])
    return Design(rigid, terms, block.known, block.turning)


def _slopes(point: Dynamics, block: Block, load: Array, s: Array) -> dict[str, Array]:
    """Derivatives of torque in the logarithms of distance and Stribeck velocity, and in tail."""
    drive, follow = point.drive, block.bristles
    speed = np.abs(block.motion.v) / drive.stribeck_velocity
    fades = drive.stribeck * fading(block.motion.v, drive)
    grip = drive.coulomb + drive.structural * np.abs(load) + fades
    tail = drive.presliding_tail
    slope = (1.0 - tail) * follow.slope[0] + tail * follow.slope[1]
    return {
        "presliding_distance": grip * slope,
        "presliding_tail": grip * (follow.state[1] - follow.state[0]),
        "stribeck_velocity": fades * speed * s,
    }


def coefficients_at(point: Dynamics) -> list[Array]:
    """w_j / K_j of every joint at the point, (columns,) each [A per column]."""
    drive, inertials = point.drive, point.loaded()
    linear = drive.coefficients()
    still = np.zeros(len(STEPS))
    return [
        np.concatenate([inertials[j:].ravel(), linear[:, j], still]) / drive.gain[j]
        for j in range(len(inertials))
    ]


def runs(known: Mask) -> Iterator[slice]:
    """Uninterrupted runs of True in an (N,) mask."""
    edges = np.flatnonzero(np.diff(known, prepend=False, append=False))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        yield slice(int(start), int(stop))
