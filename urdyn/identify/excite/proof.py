"""A proof that a motion is safe at every moment, not only at sampled ones.

A quantity with the value c at the middle of an interval h and a rate of change of at most L stays
above c - L h / 2 throughout. Intervals where that is not enough are halved until it is, or until
the quantity itself is too small. A bound far below all sampled values is not enough either, since
the least bound is reported as the motion's own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from urdyn.errors import UnsafeMotionError
from urdyn.model.arm import Arm
from urdyn.model.collision import Collider
from urdyn.model.torque_rate import torque_rate
from urdyn.simulate.limits import Limits
from urdyn.types import Array

FIRST = 0.02  # [s] initial width of intervals
FINEST = 1e-6  # [s] width at which a proof is given up
BLOCK = 4096  # intervals at a time
SHARE, DISTANCE = 0.01, 1e-3  # [-], [m] largest error of a reported share and distance

QVA = tuple[Array, Array, Array]  # angles, velocities, accelerations, (N, J) each
Peaks = tuple[Array, Array, Array]  # upper bounds of |v|, |a| and |jerk|, (J,) each


class Path(Protocol):
    """A motion that can be evaluated at any time."""

    @property
    def lasting(self) -> float:
        """Time [s] after which it ends, or repeats."""

    def at(self, t: Array) -> QVA:
        """q, v, a at times (N,) [s], each (N, J)."""

    def peaks(self) -> Peaks:
        """Upper bounds of |v|, |a| and |jerk|, (J,) each."""


@dataclass(frozen=True)
class Safe:
    """What a motion must satisfy."""

    limits: Limits
    collider: Collider
    margin: float  # [m]


@dataclass(frozen=True)
class Proof:
    """What was proven for every moment of a motion."""

    clearance: float  # [m] least distance of any two things that could touch
    closest: tuple[str, str]  # those two
    shares: dict[str, float]  # [-] most of the limits of angle, velocity, acceleration, torque
    looked: int  # number of moments evaluated


@dataclass(frozen=True, eq=False)
class _Margin:
    """How far a quantity is from its limit in the middle of intervals, [m] or [-] of the limit."""

    left: Array  # (N, K) that distance
    lost: Array  # (N, K) most by which it may shrink within an interval
    slack: float  # by which its least bound may be too small


def prove(arm: Arm, path: Path, safe: Safe) -> Proof:
    """Prove that `arm`, with its load, keeps its limits and clearances along the whole path.

    Raises:
        UnsafeMotionError: it does not, or this cannot be proven.
    """
    peaks = path.peaks()

    def joints(t: Array, width: float) -> dict[str, _Margin]:
        return _joint_margins(arm, safe.limits, path.at(t), peaks, width)

    def around(t: Array, width: float) -> dict[str, _Margin]:
        return _clearances(safe, path.at(t), peaks, width)

    # Each on its own: torque needs finer steps than distance, and costs less.
    least, _, few = _covered(arm, safe, path.lasting, joints)
    near, seen, many = _covered(arm, safe, path.lasting, around)
    shares = {kind: 1.0 - left for kind, left in least.items()}
    closest = safe.collider.pairs[int(seen["distance"].argmin())]
    return Proof(near["distance"] + safe.margin, closest, shares, few + many)


def _covered(
    arm: Arm, safe: Safe, lasting: float, look: Callable[[Array, float], dict[str, _Margin]]
) -> tuple[dict[str, float], dict[str, Array], int]:
    """Least margins over a motion, least ones at its sampled moments (K,), and their number.

    The first are proven, and at most a margin's slack below the second.
    """
    count = int(np.ceil(lasting / FIRST))
    width = lasting / count
    middles = np.linspace(0.5 * width, lasting - 0.5 * width, count)
    least: dict[str, float] = {}
    seen: dict[str, Array] = {}
    looked = 0
    while len(middles):
        if width < FINEST:
            raise UnsafeMotionError("what lies between two moments", "time", float(middles[0]))
        halves = []
        for first in range(0, len(middles), BLOCK):
            t = middles[first : first + BLOCK]
            margins = look(t, width)
            _refuse(arm, safe, margins, t)
            sure = np.ones(len(t), dtype=bool)
            for kind, margin in margins.items():
                seen[kind] = np.minimum(margin.left.min(axis=0), seen.get(kind, np.inf))
                enough = max(seen[kind].min() - margin.slack, 0.0)
                sure &= (margin.left - margin.lost >= enough).all(axis=1)
            halves.append(t[~sure])
            for kind, margin in margins.items():
                here = (margin.left - margin.lost)[sure].min(initial=np.inf)
                least[kind] = min(float(here), least.get(kind, np.inf))
        looked += len(middles)
        open_ = np.concatenate(halves)
        middles = np.sort(np.concatenate([open_ - width / 4.0, open_ + width / 4.0]))
        width /= 2.0
    return least, seen, looked


def _refuse(arm: Arm, safe: Safe, margins: dict[str, _Margin], t: Array) -> None:
    """UnsafeMotionError where a quantity is beyond its limit at one of the moments."""
    for kind, margin in margins.items():
        if (margin.left < 0.0).any():
            row, k = map(int, np.unravel_index(margin.left.argmin(), margin.left.shape))
            raise UnsafeMotionError(_message(arm, safe, kind, margin, row, k), kind, float(t[row]))


def _joint_margins(
    arm: Arm, limits: Limits, motion: QVA, peaks: Peaks, width: float
) -> dict[str, _Margin]:
    """Margins of angles, velocities, accelerations and torques in intervals of a width [s]."""
    (q, v, a), half = motion, 0.5 * width
    V, A = _faster(v, a, peaks, half)
    jerk = np.broadcast_to(peaks[2], v.shape)
    # At a speed scaled by s, torque is static torque plus s² of the rest: between the two.
    still = np.zeros_like(q)
    torque = np.maximum(np.abs(arm.torque(q, v, a)), np.abs(arm.torque(q, still, still)))
    rate = torque_rate(arm, V, A, jerk)
    used = {
        "angle": (np.abs(q - limits.middle), V, limits.room),
        "velocity": (np.abs(v), A, limits.velocity),
        "acceleration": (np.abs(a), jerk, limits.acceleration),
        "torque": (torque, rate, limits.torque),
    }
    return {
        kind: _Margin(1.0 - size / limit, half * faster / limit, SHARE)
        for kind, (size, faster, limit) in used.items()
    }


def _clearances(safe: Safe, motion: QVA, peaks: Peaks, width: float) -> dict[str, _Margin]:
    """Margins of distances."""
    q, v, a = motion
    near = safe.collider.distances(q) - safe.margin
    V, _ = _faster(v, a, peaks, 0.5 * width)
    lost = 0.5 * width * (V @ safe.collider.reach.T)
    return {"distance": _Margin(near, lost, DISTANCE)}


def _faster(v: Array, a: Array, peaks: Peaks, half: float) -> tuple[Array, Array]:
    """Upper bounds of |v| and |a| within `half` [s] to either side, (N, J) each."""
    return (
        np.minimum(np.abs(v) + half * peaks[1], peaks[0]),
        np.minimum(np.abs(a) + half * peaks[2], peaks[1]),
    )


def _message(arm: Arm, safe: Safe, kind: str, margin: _Margin, row: int, k: int) -> str:
    """The violated limit, in words."""
    if kind == "distance":
        one, other = safe.collider.pairs[k]
        there = 1e3 * (margin.left[row, k] + safe.margin)
        if there < 0.0:
            return f"{other} and {one} run into each other"
        return f"{other} comes within {there:.0f} mm of {one}, margin {1e3 * safe.margin:.0f} mm,"
    share = 1.0 - margin.left[row, k]
    return f"{arm.joint_names[k]} is at {100.0 * share:.1f} % of its {kind} limit"
