"""What turns a joint away from the angle that its encoder reports.

    q_true = q + sum over h = 1..H of (s_h sin hq + c_h cos hq)  -  tau_gravity / k    [rad]

The sum is the error of encoder and gear over a turn; the other part is the joint's compliance.
Geometry alone, and so every file of other tools, has neither.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from urdyn.model.arm import Arm
from urdyn.types import Array, Index

HARMONICS = 40  # of a turn, down to 9 deg from peak to peak; real arms show them to 36
SMOOTH = 12.0  # order h at which a harmonic is half as likely to be large as the first [-]
LOADED = 0.05  # [-] of the largest gravity torque, below which a joint's own is negligible


@dataclass(frozen=True)
class Effects:
    """Which effects a model has: a column each, of one joint's angle."""

    arm: Arm = field(repr=False)
    compliant: tuple[int, ...] = ()  # joints that gravity twists
    harmonics: int = 0

    @property
    def owners(self) -> Index:
        """(F,) the joint that each column turns."""
        round_a_turn = np.repeat(np.arange(self.arm.joints), 2 * self.harmonics)
        return np.concatenate([np.array(self.compliant, dtype=np.intp), round_a_turn])

    @property
    def orders(self) -> Array:
        """(F,) the harmonic's order; 0: compliance."""
        one = np.repeat(np.arange(1.0, self.harmonics + 1.0), 2)
        return np.concatenate([np.zeros(len(self.compliant)), np.tile(one, self.arm.joints)])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        joints = self.arm.joint_names
        soft = [f"{joints[j]}.compliance" for j in self.compliant]
        orders = range(1, self.harmonics + 1)
        waves = [f"{joint}.{w}{h}" for joint in joints for h in orders for w in ("sin", "cos")]
        return (*soft, *waves)

    def columns(self, q: Array) -> Array:
        """(N, F) what a unit of each coefficient adds to its joint's angle at q (N, J) [rad]."""
        soft = np.empty((len(q), 0))
        if self.compliant:
            still = np.zeros_like(q)
            soft = -self.arm.torque(q, still, still)[:, list(self.compliant)]
        if not self.harmonics:
            return soft
        turns = np.cumprod(np.repeat(np.exp(1j * q)[:, :, None], self.harmonics, axis=2), axis=2)
        waves = np.stack([turns.imag, turns.real], axis=-1)
        return np.concatenate([soft, waves.reshape(len(q), -1)], axis=1)

    def shift(self, coefficients: Array, q: Array) -> Array:
        """(N, J) what all effects add to the joints' angles [rad]."""
        if not len(coefficients):
            return np.zeros_like(q)
        moved = self.columns(q) * coefficients
        owner = np.arange(self.arm.joints) == self.owners[:, None]
        return np.asarray(moved @ owner.astype(np.float64))


def no_effects(arm: Arm) -> Effects:
    """Geometry alone."""
    return Effects(arm)


def compliance(arm: Arm, q: Array) -> Effects:
    """Joints that carry gravity somewhere in q (N, J)."""
    still = np.zeros_like(q)
    load = np.abs(arm.torque(q, still, still)).max(axis=0)
    loaded = np.flatnonzero(load > LOADED * max(float(load.max()), 1e-9))
    return Effects(arm, tuple(int(j) for j in loaded))


def transmission(effects: Effects, harmonics: int = HARMONICS) -> Effects:
    """`effects` and errors over a turn."""
    return replace(effects, harmonics=harmonics)


def smoothness(orders: Array) -> Array:
    """(F,) share of the first harmonics' variance that one of this order has a priori."""
    return np.asarray(1.0 / (1.0 + (orders / SMOOTH) ** 2))
