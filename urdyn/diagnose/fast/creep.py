"""Standing joints, and how creep may change the friction that holds them.

If a joint crept one way, friction may have grown that way, whatever it was before, and not the
other: a push takes the joint along, and the drive acts against it. [Dahl1968]_
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.residual.rows import COULOMB, Rows
from urdyn.model.drive import Drive
from urdyn.model.friction import follow
from urdyn.types import Array, Mask

HELD = 0.005  # [rad/s] slower than this a joint is held by friction that does not change
LEFT = 1.5e-3  # [rad] from where it stood, within which a pushed joint still stands
STILL = 3e-5  # [rad] by which encoders jitter: two steps


@dataclass(frozen=True, eq=False)
class Creep:
    """The standing of J joints."""

    held: Mask  # (J,) those that stand
    place: Array  # (J,) [rad] where joints stood last
    s: Array  # (J,) [-] presliding states; of standing joints those in which they stopped
    ends: Array  # (2, 2, J) [-] full friction, either way, as changed since by creep
    q: Array  # (J,) [rad] angle up to which creep is counted

    def after(self, rows: Rows, drive: Drive) -> Creep:
        """State after some rows. Pushed joints give way a little; no program moves so little."""
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
        """Predicted change of standing joints' presliding states, (J,) [-].

        Velocities not quite zero let a predicted joint creep; its encoder shows it does not.
        """
        return np.where(self.held, _states(rows, drive).mean(axis=0) - self.s, 0.0)

    def grown(self, drive: Drive) -> Array:
        """Range of their possible change, (2, J) [-]."""
        tail, (stiff, soft) = drive.presliding_tail, self.ends.swapaxes(0, 1)
        return np.asarray((1.0 - tail) * stiff + tail * soft - _full(len(self.q))[:, 0])

    def learnt(self, kept: Array) -> Creep:
        """After a baseline has absorbed all but the share `kept`, (J,) [-]."""
        full = _full(len(kept))
        return replace(self, ends=full + kept * (self.ends - full))


def at_first(joints: int) -> Creep:
    """Nothing seen yet."""
    nan = np.full(joints, np.nan)
    return Creep(np.zeros(joints, dtype=bool), nan, np.zeros(joints), _full(joints), nan)


def _states(rows: Rows, drive: Drive) -> Array:
    """Predicted presliding states, (N, J) [-]."""
    return np.asarray(drive.gain * rows.drive[:, COULOMB] / drive.coulomb)


def _full(joints: int) -> Array:
    """Presliding states of joints held by full friction, either way, (2, 2, J)."""
    return np.multiply.outer([1.0, -1.0], np.ones((2, joints)))
