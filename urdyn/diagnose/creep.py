"""Joints that stand, and what creep may make of the friction that holds them.

Of a joint that crept one way friction may have grown that way, whatever it was before, and no other
way: a push takes the joint along, and the drive against it. [Dahl1968]_
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.rows import COULOMB, Rows
from urdyn.model.drive import Drive
from urdyn.model.friction import follow
from urdyn.types import Array, Mask

HELD = 0.005  # [rad/s] slower than this a joint is held by friction that does not change
LEFT = 1.5e-3  # [rad] from where it stood, within which a joint that is pushed stands still
STILL = 3e-5  # [rad] by which encoders jitter: two steps


@dataclass(frozen=True, eq=False)
class Creep:
    """How J joints stand."""

    held: Mask  # (J,) those that do
    place: Array  # (J,) [rad] where joints stood last
    s: Array  # (J,) [-] presliding states, of joints that stand those at which they came to
    ends: Array  # (2, 2, J) [-] what full friction, either way, has become since by creep
    q: Array  # (J,) [rad] up to which that goes

    def after(self, rows: Rows, drive: Drive) -> Creep:
        """Some rows on. Those that are pushed give way, and no program moves as little."""
        slow = np.abs(rows.v).max(axis=0) < HELD
        held = slow | (self.held & (np.abs(rows.q - self.place).max(axis=0) < LEFT))
        stood, moved = held & self.held, rows.q[-1] - self.q
        still = held & (np.abs(moved) < STILL)
        moved = np.where(held & ~still, np.nan_to_num(moved), 0.0)
        now = np.array([follow(of, moved, drive.presliding_distance) for of in self.ends])
        return Creep(
            held=held,
            place=np.where(slow, rows.q[-1], self.place),
            s=np.where(stood, self.s, _states(rows, drive)[-1]),
            ends=np.where(stood, now, _full(len(held))),
            q=np.where(still, self.q, rows.q[-1]),
        )

    def integrated(self, rows: Rows, drive: Drive) -> Array:
        """By how much standing joints' presliding states are predicted to have changed, (J,) [-].

        Velocities that are not quite zero let a joint creep; its encoder knows better.
        """
        return np.where(self.held, _states(rows, drive).mean(axis=0) - self.s, 0.0)

    def grown(self, drive: Drive) -> Array:
        """From where to where they may have changed, (2, J) [-]."""
        tail, (stiff, soft) = drive.presliding_tail, self.ends.swapaxes(0, 1)
        return np.asarray((1.0 - tail) * stiff + tail * soft - _full(len(self.q))[:, 0])

    def learnt(self, kept: Array) -> Creep:
        """After a baseline has taken up all but a share of that, (J,) [-]."""
        full = _full(len(kept))
        return replace(self, ends=full + kept * (self.ends - full))


def at_first(joints: int) -> Creep:
    """Nothing seen yet."""
    nan = np.full(joints, np.nan)
    return Creep(np.zeros(joints, dtype=bool), nan, np.zeros(joints), _full(joints), nan)


def _states(rows: Rows, drive: Drive) -> Array:
    """Presliding states as they are predicted, (N, J) [-]."""
    return np.asarray(drive.gain * rows.drive[:, COULOMB] / drive.coulomb)


def _full(joints: int) -> Array:
    """Presliding states of joints that friction holds with all it has, either way, (2, 2, J)."""
    return np.multiply.outer([1.0, -1.0], np.ones((2, joints)))
