"""Inputs of one slice of a robot's life: what the motion makes of the parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.types import Array

DOUBT = 0.03  # [-] sd of the presliding state of a joint that slides
CREEPING_DOUBT = 0.5  # [-] added where it stands
CREEP = 0.02  # [rad/s] over which that fades
SMEAR = 0.01  # [s] of its jerk, by which an acceleration that was differentiated may be off

ROWS = ("load", "hold", "rest", "s", "v", "a", "one")


@dataclass(frozen=True, eq=False)
class RobotSlice:
    """What multiplies each parameter, joint by joint.

    The current is linear in it, so that a filter in time of currents is the same filter of this:
    see `packed`.
    """

    dt: float  # [s] since the slice before
    widen: bool  # something else may be carried from here on
    A: Array  # (J, c) torque per unit of k, m, payload
    hold: Array  # (J,) [N·m] |load| s of the reference
    A_hold: Array  # (J, c) the same per unit of k, m, payload
    load: Array  # (J,) [N·m] rigid-body torque of the reference
    rest: Array  # (J,) [N·m] of ripple, warmth and friction that fades with speed
    s: Array  # (J,) presliding state [-]
    v: Array  # (J,) [rad/s]
    a: Array  # (J,) [rad/s²]
    one: Array  # (J,) [-] what multiplies what does not move
    smeared: Array  # (J,) [N·m] sd of the torque, for the acceleration was differentiated
    noise: Array  # (J,) [A] sd
    warm: Array  # (J,) [K] of the lubricant over that of the first day, by the model; 0 unknown
    felt: Array  # (J,) [-] 1 where the joint's temperature is measured, else 0: nothing is claimed
    blind: bool = True  # nobody measures how warm some joint is
    stray: Array | None = None  # (J,) [A] sd of slow noise; None: there is none
    jolted: Array | None = None  # (J,) [-] 1 where something befell a joint's drive; None: nowhere

    @property
    def doubt(self) -> Array:
        """Standard deviation of s, (J,) [-]: a joint that creeps is held by what nobody knows."""
        return np.asarray(DOUBT + CREEPING_DOUBT * np.exp(-np.abs(self.v) / CREEP))

    @property
    def packed(self) -> Array:
        """All that the current is linear in, (J, 2 c + 7)."""
        rows = np.stack([getattr(self, name) for name in ROWS], axis=1)
        return np.concatenate([self.A, self.A_hold, rows], axis=1)

    def filtered(self, packed: Array) -> RobotSlice:
        """The same slice after a filter in time of `packed`; speeds stay, for `doubt`'s sake."""
        c = self.A.shape[1]
        rows = dict(zip(ROWS, packed[:, 2 * c :].T, strict=True))
        return replace(self, A=packed[:, :c], A_hold=packed[:, c : 2 * c], **rows)
