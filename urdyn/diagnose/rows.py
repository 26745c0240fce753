"""What a stretch of work says against the commissioned model, row by row.

    r = i - i_commissioned(q, v, a, T)  =  H x + noise        x: how far the arm strayed

H are the derivatives of the observation model at the commissioned arm, so that a joint's friction,
health, sensor and zero, the links' inertials and the payload are directions of one space. The model
is held: nothing here learns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.dbn.robot import CREEP, CREEPING_DOUBT, DOUBT, RobotCurrents, RobotSlice
from urdyn.model.arm import with_inertials
from urdyn.model.friction import features, travel
from urdyn.types import Array, Mask, Motion

STANDING = 0.02  # [rad/s] slower than this, friction is whatever holds the joint
SETTLED = 50.0  # presliding distances of travel after which the bristles are known
BLOCK = 4096  # rows that are held at once


@dataclass(frozen=True, eq=False)
class Rows:
    """Moments of work, beside what the commissioned arm would have taken."""

    t: Array  # (N,) [s]
    q: Array  # (N, J) [rad]
    v: Array  # (N, J) [rad/s]
    load: Array  # (N, J) [N·m] rigid-body torque of the commissioned arm
    current: Array  # (N, J) [A] as measured
    predicted: Array  # (N, J) [A] of the commissioned arm
    H: Array  # (N, J, n) [A] per unit of each state
    doubt: Array  # (N, J) [A] sd of what nobody knows of the bristles
    settled: Mask  # (N, J) slides on bristles that are known

    def __len__(self) -> int:
        return len(self.t)

    @property
    def residual(self) -> Array:
        """Measured minus predicted, (N, J) [A]."""
        return self.current - self.predicted


@dataclass(frozen=True, eq=False)
class Stretch:
    """Inputs of many slices, time first."""

    t: Array  # (N,)
    q: Array  # (N, J)
    current: Array  # (N, J) [A]
    settled: Mask  # (N, J)
    A: Array  # (N, J, c)
    load: Array  # (N, J)
    rest: Array  # (N, J)
    s: Array  # (N, J)
    v: Array  # (N, J)
    a: Array  # (N, J)


def stacked(
    t: Sequence[float],
    q: Sequence[Array],
    current: Sequence[Array],
    settled: Sequence[Mask],
    slices: Sequence[RobotSlice],
) -> Stretch:
    """Moments that came one by one, as a stretch."""
    fields = ("A", "load", "rest", "s", "v", "a")
    inputs = {name: np.array([getattr(u, name) for u in slices]) for name in fields}
    return Stretch(np.array(t), np.array(q), np.array(current), np.array(settled), **inputs)


def stretch(currents: RobotCurrents, motion: Motion, s: Array) -> Stretch:
    """The same of a motion at once, with its presliding state s (N, J)."""
    reference, drive = currents.reference, currents.reference.drive
    arm = with_inertials(reference.arm, reference.loaded())
    Y = arm.regressor(motion.q, motion.v, motion.a)
    G = arm.torque_derivatives(motion.q, motion.v, motion.a)[0]
    load = Y @ arm.inertials.ravel()
    terms = features(motion, load, s, drive)
    faded = ("stribeck", "ripple_cos", "ripple_sin", "thermal")
    rest = sum(getattr(drive, name) * terms[name] for name in faded)
    A = np.concatenate([G, Y @ currents.shown, Y[..., -10:]], axis=2)
    way = np.cumsum(np.abs(travel(motion)), axis=0)
    settled = way > SETTLED * drive.presliding_distance
    return Stretch(
        motion.t, motion.q, motion.current, settled, A, load, np.asarray(rest), s, motion.v, motion.a
    )


def rows(currents: RobotCurrents, of: Stretch) -> Rows:
    """What a stretch says against the commissioned arm."""
    at, drive = currents.places, currents.reference.drive
    J, N = of.q.shape[1], len(of.t)
    grip = drive.coulomb + drive.structural * np.abs(of.load)
    torque = of.load + drive.rotor_inertia * of.a + of.rest
    torque = torque + grip * of.s + drive.viscous * of.v + drive.offset
    predicted = torque / drive.gain
    H = np.zeros((N, J, len(currents.names)))
    through = (1.0 + drive.structural * np.sign(of.load) * of.s) / drive.gain
    rigid = [place for group in ("k", "m", "payload") for place in range(*_ends(at[group]))]
    H[:, :, rigid] = through[..., None] * of.A
    columns = {
        "f": drive.coulomb * of.s / drive.gain,
        "alpha": drive.viscous * of.v / drive.gain,
        "beta": drive.structural * np.abs(of.load) * of.s / drive.gain,
        "z": -predicted,
        "o": np.broadcast_to(1.0 / drive.gain, (N, J)),
        "rotor": drive.rotor_inertia * of.a / drive.gain,
    }
    for group, values in columns.items():
        H[:, range(J), range(*_ends(at[group]))] = values
    doubt = DOUBT + CREEPING_DOUBT * np.exp(-np.abs(of.v) / CREEP)
    doubt = doubt * grip / drive.gain
    return Rows(of.t, of.q, of.v, of.load, of.current, predicted, H, doubt, of.settled)


def _ends(place: slice) -> tuple[int, int]:
    return place.start, place.stop
