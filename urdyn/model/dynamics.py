"""The one equation, with numbers: an arm's parameters, and the current that a motion takes."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from urdyn.model.arm import Arm, with_inertials
from urdyn.model.drive import Drive
from urdyn.model.friction import Bristles, Contact, bristles, friction_torque, present
from urdyn.types import Array, Mask, Motion, shaped

OVERLOAD = 3.0  # [-] of the current at rated torque: no motor draws more


@dataclass(frozen=True, eq=False)
class Dynamics:
    """An arm with its masses, drives and payload.

    tau = Y(q, v, a) pi + I_r a + tau_f(motion, tau_load),    i = tau / (K z)
    """

    arm: Arm  # as described: its own inertials are the published ones
    inertials: Array  # (J, 10) of the links, Pinocchio's order
    drive: Drive
    payload: Array = field(default_factory=lambda: np.zeros(10))  # in the last joint's frame

    def __post_init__(self) -> None:
        shape = (self.arm.joints, 10)
        object.__setattr__(self, "inertials", shaped("inertials", self.inertials, shape))
        object.__setattr__(self, "payload", shaped("payload", self.payload, shape[1:]))

    def undrawn(self, current: Array) -> Mask:
        """Which of these currents (..., J) [A] no motor can draw: the sensor is wrong."""
        return np.asarray(np.abs(current) > self._most)

    def unlike(self, current: Array) -> str:
        """Why currents (N, J') [A] cannot be this arm's; nothing where they can."""
        if current.shape[1] != self.arm.joints:
            told = f"the log has {current.shape[1]} joints, {self.arm.name} has {self.arm.joints}"
            return f"{told}; give the robot that was recorded, or a log of this one"
        beyond = self.undrawn(current).mean(axis=0) > 0.5
        if np.count_nonzero(beyond) < 2:  # one may be a faulty sensor's
            return ""
        which = ", ".join(map(str, np.flatnonzero(beyond)))
        return f"no motor draws as much as joints {which} do; currents are to be in A: is it mA?"

    @cached_property
    def _most(self) -> Array:
        return np.asarray(OVERLOAD * self.arm.effort_limit / self.drive.gain)

    def loaded(self) -> Array:
        """Link inertials with the payload on the last link, (J, 10)."""
        inertials = self.inertials.copy()
        inertials[-1] += self.payload
        return inertials

    @property
    def rigid(self) -> Arm:
        """The arm with these inertials and the payload: `rigid.torque(q, v, a)` [N·m]."""
        return with_inertials(self.arm, self.loaded())

    def load(self, motion: Motion) -> Array:
        """Rigid-body torque that the gears transmit, (N, J) [N·m]."""
        return self.arm.torque(motion.q, motion.v, motion.a, self.loaded())

    def bristles(self, motion: Motion, start: Bristles | None = None) -> Bristles:
        """How the gears' bristles follow a motion, from `start` or from rest."""
        drive = self.drive
        return bristles(motion, drive.presliding_distance, start, drive.friction_lead)

    def presliding(self, motion: Motion) -> Array:
        """Presliding state along a motion, (N, J) [-]; zero where nothing has moved yet."""
        return self.bristles(motion).together(self.drive.presliding_tail)

    def torque(self, motion: Motion, s: Array | None = None) -> Array:
        """Torque that the drives give along a motion, (N, J) [N·m].

        Args:
            s: presliding state if the caller has computed it, (N, J) [-].
        """
        load, drive = self.load(motion), self.drive
        s = self.presliding(motion) if s is None else s
        at = Contact(motion.q, motion.v, motion.temperature, load, s)
        friction = friction_torque(at, drive, present(drive))
        return np.asarray(load + drive.rotor_inertia * motion.a + friction)

    def current(self, motion: Motion) -> Array:
        """Motor current that is recorded with the motion, (N, J) [A]."""
        torque = self.torque(motion.ahead(self.drive.time_offset))
        return np.asarray(torque / (self.drive.gain * self.drive.health))
