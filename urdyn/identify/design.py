"""The linear problem at a point: what each unknown adds to each joint's torque.

Around a `Dynamics` the torque is linear in link inertials and drive coefficients, and nearly so in
the shape of friction (presliding distance and tail, Stribeck velocity):

    tau_j = Phi_j w_j,    w_j = [pi of links j.., coefficients, steps in the shape]

The load that structural damping rides on and the presliding state are taken at the point.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from urdyn.model.drive import LINEAR, SHAPE
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Bristles, bristles, features, travel
from urdyn.types import Array, Motion

TERMS = (*LINEAR, *SHAPE)
SETTLED = 50.0  # presliding distances of travel after which the state before is forgotten
BLOCK = 8192  # rows of a regressor in memory at a time


@dataclass(frozen=True)
class Design:
    """One block of uninterrupted motion as the linear problem."""

    rigid: Array  # (N, J, 10 J), the regressor
    terms: Array  # (len(TERMS), N, J)
    current: Array  # (N, J) [A]
    known: Array  # (N, J) 1 where the row says something: measured, the presliding state settled

    def columns(self, joint: int) -> Array:
        """Phi_j without the links that the joint does not carry, (N, 10 (J - j) + len(TERMS))."""
        return np.hstack([self.rigid[:, joint, 10 * joint :], self.terms[:, :, joint].T])

    def stretches(self, joint: int) -> Iterator[tuple[Array, Array]]:
        """Columns and current of every run of rows that say something of the joint."""
        columns, known = self.columns(joint), self.known[:, joint] > 0
        edges = np.flatnonzero(np.diff(known, prepend=False, append=False))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            yield columns[start:stop], self.current[start:stop, joint]


def designs(point: Dynamics, motion: Motion) -> Iterator[Design]:
    """The linear problem of a motion at `point`, block by block."""
    ahead = motion.ahead(point.drive.time_offset)
    edges = [0, *motion.breaks, len(motion)]
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        memory: Array | None = None
        travelled = np.zeros(motion.joints)
        for row in range(start, stop, BLOCK):
            # A block starts one row early, so that the travel into its first row counts.
            lead = min(row - start, 1)
            block = ahead.slice(row - lead, min(row + BLOCK, stop))
            moved = np.abs(travel(block)).cumsum(axis=0) + travelled
            follow = bristles(block, point.drive.presliding_distance, memory)
            yield _design(point, block, follow, moved, lead)
            memory, travelled = follow.end, moved[-1]


def _design(point: Dynamics, motion: Motion, follow: Bristles, moved: Array, lead: int) -> Design:
    drive = point.drive
    rigid = point.arm.regressor(motion.q, motion.v, motion.a)
    load = rigid @ point.loaded().ravel()
    linear = features(motion, load, follow.together(drive.presliding_tail), drive)
    shape = _shape(point, motion, follow, load)
    terms = np.array([*(linear[n] for n in LINEAR), *(shape[n] for n in SHAPE)])
    measured = np.isfinite(motion.current) & np.isfinite(load).all(axis=1, keepdims=True)
    known = measured & (moved > SETTLED * drive.presliding_distance)
    return Design(
        np.nan_to_num(rigid)[lead:],
        np.nan_to_num(terms)[:, lead:],
        motion.current[lead:],
        known[lead:].astype(float),
    )


def _shape(point: Dynamics, motion: Motion, follow: Bristles, load: Array) -> dict[str, Array]:
    """Derivatives of torque in log distance, in the tail's share, in log Stribeck velocity."""
    drive = point.drive
    speed = np.abs(motion.v) / drive.stribeck_velocity
    fading = drive.stribeck * np.exp(-speed)
    grip = drive.coulomb + drive.structural * np.abs(load) + fading
    tail, s = drive.presliding_tail, follow.together(drive.presliding_tail)
    return {
        "presliding_distance": grip
        * ((1.0 - tail) * follow.slope[0] + tail * follow.slope[1]),
        "presliding_tail": grip * (follow.state[1] - follow.state[0]),
        "stribeck_velocity": fading * speed * s,
    }


def coefficients_at(point: Dynamics) -> list[Array]:
    """w_j / K_j of every joint at the point itself, (columns,) each [A per column]."""
    drive, inertials = point.drive, point.loaded()
    linear = drive.coefficients()
    steps = np.zeros(len(SHAPE))
    return [
        np.concatenate([inertials[j:].ravel(), linear[:, j], steps]) / drive.gain[j]
        for j in range(len(inertials))
    ]
