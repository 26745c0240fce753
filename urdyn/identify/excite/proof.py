"""A proof that a motion is safe at every moment, not only at those that are looked at.

A quantity that is c at the middle of an interval h and changes at most at the rate L stays above
c - L h / 2 in all of it. Intervals where that is not enough are halved until it is, or until the
quantity itself is too small.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.model.collision import Collider
from urdyn.model.torque_rate import torque_rate
from urdyn.simulate.limits import Limits
from urdyn.types import Array, Mask

FIRST = 0.02  # [s] of an interval to begin with
FINEST = 1e-6  # [s] below which nothing is proven any more
BLOCK = 4096  # intervals at a time

Motion = tuple[Array, Array, Array]


class UnsafeMotionError(InputError):
    """A motion cannot be proven safe: carries what is short, when, and how much of it there is."""

    def __init__(self, what: str, kind: str, when: float) -> None:
        super().__init__(f"not proven safe: {what} at {when:.3f} s")
        self.what, self.kind, self.when = what, kind, when


class Path(Protocol):
    """A motion that is known at every moment."""

    @property
    def lasting(self) -> float:
        """[s] after which it ends, or begins again."""

    def at(self, t: Array) -> Motion:
        """q, v, a at times (N,) [s], each (N, J)."""

    def peaks(self) -> Motion:
        """What |v|, |a| and |jerk| never exceed, (J,) each."""


@dataclass(frozen=True)
class Safe:
    """What is asked of a motion."""

    limits: Limits
    collider: Collider
    margin: float  # [m]


@dataclass(frozen=True)
class Proof:
    """What was proven, of every moment of a motion."""

    clearance: float  # [m] at least, between any two things that could touch
    closest: tuple[str, str]  # which those were
    shares: dict[str, float]  # [-] of the limits of angle, velocity, acceleration, torque, at most
    looked: int  # moments that were looked at for it


@dataclass(frozen=True)
class _Room:
    """How far a quantity is from its limit in the middle of intervals, and may come nearer."""

    left: Array  # (N, K)
    lost: Array  # (N, K)
    limit: Array  # (K,) or a number: what `left` is where nothing is asked


def prove(arm: Arm, path: Path, safe: Safe) -> Proof:
    """That `arm`, with what it carries, keeps its limits and its distance all along the path.

    Raises:
        UnsafeMotionError: it does not, or it cannot be told.
    """
    count = int(np.ceil(path.lasting / FIRST))
    width = path.lasting / count
    middles = np.linspace(0.5 * width, path.lasting - 0.5 * width, count)
    proofs, looked = [], 0
    while len(middles):
        if width < FINEST:
            raise UnsafeMotionError("what lies between two moments", "time", float(middles[0]))
        left = []
        for rows in range(0, len(middles), BLOCK):
            t = middles[rows : rows + BLOCK]
            found, open_ = _look(arm, path, safe, t, width)
            proofs.append(found)
            left.append(t[open_])
        looked += len(middles)
        halves = np.concatenate(left)
        middles = np.sort(np.concatenate([halves - width / 4.0, halves + width / 4.0]))
        width /= 2.0
    return _together(proofs, safe, looked)


def _look(
    arm: Arm, path: Path, safe: Safe, t: Array, width: float
) -> tuple[dict[str, Array], Mask]:
    """Least room, by quantity (K,), of the intervals that are proven, and which are not."""
    q, v, a = path.at(t)
    rooms = _rooms(arm, safe, (q, v, a), path.peaks(), width)
    for kind, room in rooms.items():
        if (room.left < 0.0).any():
            row, k = map(int, np.unravel_index(room.left.argmin(), room.left.shape))
            raise UnsafeMotionError(_told(arm, safe, kind, room, row, k), kind, float(t[row]))
    sure = np.all([(r.left >= r.lost).all(axis=1) for r in rooms.values()], axis=0)
    least = {kind: (r.left - r.lost)[sure].min(axis=0, initial=np.inf) for kind, r in rooms.items()}
    return least, ~sure


def _rooms(arm: Arm, safe: Safe, motion: Motion, peaks: Motion, width: float) -> dict[str, _Room]:
    """How far every quantity is from its limit, and by how much it may come nearer."""
    (q, v, a), half, limits = motion, 0.5 * width, safe.limits
    V = np.minimum(np.abs(v) + half * peaks[1], peaks[0])
    A = np.minimum(np.abs(a) + half * peaks[2], peaks[1])
    jerk = np.broadcast_to(peaks[2], v.shape)
    # Run slower by s, the torque is that of holding still and s² of the rest: between the two.
    still = np.zeros_like(q)
    torque = np.maximum(np.abs(arm.torque(q, v, a)), np.abs(arm.torque(q, still, still)))
    rate = torque_rate(arm, V, A, jerk)
    near = safe.collider.distances(q) - safe.margin
    return {
        "angle": _Room(limits.room - np.abs(q - limits.middle), half * V, limits.room),
        "velocity": _Room(limits.velocity - np.abs(v), half * A, limits.velocity),
        "acceleration": _Room(limits.acceleration - np.abs(a), half * jerk, limits.acceleration),
        "torque": _Room(limits.torque - torque, half * rate, limits.torque),
        "distance": _Room(near, half * (V @ safe.collider.reach.T), np.zeros(near.shape[1])),
    }


def _told(arm: Arm, safe: Safe, kind: str, room: _Room, row: int, k: int) -> str:
    """What is short, in words."""
    if kind == "distance":
        one, other = safe.collider.pairs[k]
        there = 1e3 * (room.left[row, k] + safe.margin)
        if there < 0.0:
            return f"{other} and {one} run into each other"
        return f"{other} comes within {there:.0f} mm of {one}, margin {1e3 * safe.margin:.0f} mm,"
    share = 1.0 - room.left[row, k] / room.limit[k]
    return f"{arm.joint_names[k]} is at {100.0 * share:.1f} % of its {kind} limit"


def _together(proofs: list[dict[str, Array]], safe: Safe, looked: int) -> Proof:
    least = {kind: np.min([one[kind] for one in proofs], axis=0) for kind in proofs[0]}
    limits = {
        "angle": safe.limits.room,
        "velocity": safe.limits.velocity,
        "acceleration": safe.limits.acceleration,
        "torque": safe.limits.torque,
    }
    near = least["distance"]
    k = int(near.argmin())
    shares = {kind: float((1.0 - least[kind] / whole).max()) for kind, whole in limits.items()}
    return Proof(float(near[k] + safe.margin), safe.collider.pairs[k], shares, looked)
