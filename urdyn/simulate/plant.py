"""The arm's dynamics: drives, gears and links under motor torque.

Rigid gears: explicit midpoint steps of

    (M(q) + I_r) a = tau - lost(v, s) - h(q, v) + tau_ext

with the bristles integrated exactly over the travel. Elastic gears: rotor and link are two bodies,

    I_r theta'' = tau - lost(theta', s) - w,     w = k (theta - q)* + d (theta' - q')
    M(q) q''    = w - h(q, v) + tau_ext

where (x)* has a dead zone of half width `gap`, the backlash; semi-implicit steps, fine enough for
the stiffest gear. Friction is on the motor side, and `|tau_load|` is that of the previous step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Contact, follow, friction_torque, present
from urdyn.types import Array

SETTLED = 4  # times that gears are wound anew by gravity where they now hold; each leaves some 1 %


@dataclass(frozen=True, eq=False)
class PlantState:
    """State of the arm; without elasticity, motor and link coincide."""

    q: Array  # (J,) [rad] of the links
    v: Array  # (J,) [rad/s]
    theta: Array  # (J,) [rad] of the motors, on the joint side
    omega: Array  # (J,) [rad/s]
    bristles: Array  # (2, J) [-]
    load: Array  # (J,) [N·m] transmitted by the gears
    lost: Array  # (J,) [N·m] lost to friction

    @classmethod
    def rest(cls, q: Array) -> PlantState:
        """At rest, with relaxed bristles."""
        zero = np.zeros_like(q)
        return cls(q, zero, q, zero, np.zeros((2, len(q))), zero, zero)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What acts on the arm in one step, apart from its motors."""

    torque: Array  # (J,) [N·m] of pushes, through the links
    coulomb: Array  # (J,) factor on Coulomb friction [-]
    viscous: Array  # (J,) factor on viscous friction [-]
    gap: Array  # (J,) [rad] half width of the gears' dead zone
    temperature: Array  # (J,) [°C] of the joints


@dataclass(frozen=True, eq=False)
class Gears:
    """Elasticity of the gears."""

    stiffness: Array  # (J,) [N·m/rad]
    damping: Array  # (J,) [N·m·s/rad]


@dataclass(frozen=True)
class Plant:
    """An arm ready to be stepped."""

    dynamics: Dynamics
    gears: Gears | None = None  # None: rigid
    accelerate: Callable[[Array, Array, Array], Array] = field(init=False, repr=False)
    terms: tuple[str, ...] = field(init=False, repr=False)  # friction terms of the drives

    def __post_init__(self) -> None:
        inertia = self.dynamics.drive.rotor_inertia
        armature = inertia if self.gears is None else np.zeros_like(inertia)
        built = self.dynamics.arm.accelerator(self.dynamics.loaded(), armature)
        object.__setattr__(self, "accelerate", built)
        object.__setattr__(self, "terms", present(self.dynamics.drive))

    def rest(self, theta: Array, gap: Array) -> PlantState:
        """At rest with motors at theta, (J,) [rad]: gears are wound by gravity.

        Args:
            gap: half width of the gears' dead zone, (J,) [rad].
        """
        x = PlantState.rest(theta)
        if self.gears is None:
            return x
        for _ in range(SETTLED):
            load = self.dynamics.arm.torque(x.q, x.v, x.v, self.dynamics.loaded())
            x = replace(x, q=theta - load / self.gears.stiffness - gap * np.sign(load), load=load)
        return x

    def step(self, x: PlantState, tau: Array, around: Surroundings, h: float) -> PlantState:
        """The state `h` seconds later under motor torque `tau`, (J,) [N·m]."""
        if self.gears is None:
            return self._rigid(x, tau, around, h)
        return self._elastic(x, tau, around, h, self.gears)

    def _rigid(self, x: PlantState, tau: Array, around: Surroundings, h: float) -> PlantState:
        half, net = 0.5 * h, tau + around.torque
        a = self.accelerate(x.q, x.v, net - self._lost(x.q, x.v, x.bristles, x.load, around))
        v = x.v + half * a
        middle = self._follow(x.bristles, half * (x.v + half * 0.5 * a), half * a)
        lost = self._lost(x.q, v, middle, x.load, around)
        a = self.accelerate(x.q + half * x.v, v, net - lost)
        q, end = x.q + h * v, x.v + h * a
        load = tau - lost - self.dynamics.drive.rotor_inertia * a
        bristles = self._follow(x.bristles, half * (x.v + end), h * a)
        return PlantState(q, end, q, end, bristles, load, lost)

    def _elastic(
        self, x: PlantState, tau: Array, around: Surroundings, h: float, gears: Gears
    ) -> PlantState:
        twist = x.theta - x.q
        beyond = twist - np.clip(twist, -around.gap, around.gap)
        load = gears.stiffness * beyond
        load = load + np.where(beyond != 0.0, gears.damping * (x.omega - x.v), 0.0)
        lost = self._lost(x.theta, x.omega, x.bristles, load, around)
        omega = x.omega + h * (tau - lost - load) / self.dynamics.drive.rotor_inertia
        v = x.v + h * self.accelerate(x.q, x.v, load + around.torque)
        bristles = self._follow(x.bristles, h * omega, omega - x.omega)
        return PlantState(x.q + h * v, v, x.theta + h * omega, omega, bristles, load, lost)

    def _follow(self, bristles: Array, travel: Array, faster: Array) -> Array:
        """The bristles (2, J) after some travel [rad] with a change in speed, `faster` [rad/s]."""
        drive = self.dynamics.drive
        return follow(bristles, travel + drive.friction_lead * faster, drive.presliding_distance)

    def _lost(
        self, q: Array, v: Array, bristles: Array, load: Array, around: Surroundings
    ) -> Array:
        """Friction torque, (J,) [N·m]."""
        drive = self.dynamics.drive
        s = bristles[0] + drive.presliding_tail * (bristles[1] - bristles[0])
        at = Contact(q, v, around.temperature, load, s)
        return friction_torque(
            at, drive, self.terms, {"coulomb": around.coulomb, "viscous": around.viscous}
        )
