"""The current of each joint's drive, as a function of a few arguments.

    i = (torque + (f' + beta |held|) s + alpha' v + rotor a) / (K z) + current

as in `urdyn.dbn.robot`. The first arguments are combinations of its states: torque of the arm's
bodies and constant torque, the same for the load of structural damping [N·m], and additions to the
current itself [A]; then the first two for the payload, where it is not linearised. Single states
follow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.dbn.robot_slice import RobotSlice
from urdyn.types import Array

POSITIVE = ("f", "alpha", "beta", "rotor", "z", "gain")
WARMTH = ("kappa", "kappa_f", "lubricant")
TORQUE, HELD, CURRENT, CARRIED, CARRIED_HELD = range(5)
STATES = (*POSITIVE, *WARMTH)
LOGARITHMS, WARM = slice(-len(STATES), -len(WARMTH)), slice(-len(WARMTH), None)


@dataclass(frozen=True, eq=False)
class Draw:
    """Parts of a drive's torque, (..., J) each [N·m] unless stated."""

    held: Array  # load of structural damping
    carried: Array  # payload's part of the rigid-body torque
    carried_held: Array  # payload's part of `held`
    f: Array
    alpha: Array
    beta: Array  # [-]
    rotor: Array
    gain: Array  # [-]
    warm: Array  # [K]
    per: Array  # [A/(N·m)]
    friction: Array  # the part that depends on states
    driven: Array  # total torque

    @classmethod
    def of(cls, z: Array, u: RobotSlice, K: Array) -> Draw:
        """From arguments z (..., J, d) and the first day's gains K (J,) [N·m/A]."""
        positive, warmth = np.array(z[..., LOGARITHMS]), z[..., WARM]
        kappa, kappa_f, lubricant = (warmth[..., k] for k in range(len(WARMTH)))
        warm = u.felt * (u.warm + lubricant)
        positive[..., 0] -= kappa_f * warm  # f
        positive[..., 1] -= kappa * warm  # alpha
        np.exp(positive, out=positive)
        f, alpha, beta, rotor, health, gain = (positive[..., k] for k in range(len(POSITIVE)))
        if u.carried is None:
            carried, carried_held = z[..., CARRIED] / gain, z[..., CARRIED_HELD] / gain
        else:
            carried, carried_held = u.carried.torque / gain, u.carried.held / gain
        f, alpha, rotor = f * u.s, alpha * u.v, rotor * u.a
        torque = (u.load + u.rest) + z[..., TORQUE] + carried
        held = u.hold + z[..., HELD] + carried_held
        friction = f + alpha + beta * held
        return cls(
            held=held,
            carried=carried,
            carried_held=carried_held,
            f=f,
            alpha=alpha,
            beta=beta,
            rotor=rotor,
            gain=gain,
            warm=warm,
            per=1.0 / (K * health),
            friction=friction,
            driven=torque + friction + rotor,
        )

    def currents(self, z: Array, u: RobotSlice) -> Array:
        """Currents, (..., J) [A]."""
        current = self.driven * self.per + z[..., CURRENT]
        return np.asarray(current if u.carried is None else current - u.carried.current)

    def slopes(self, z: Array, u: RobotSlice) -> Array:
        """Derivatives of currents in the arguments, (..., J, d): combinations, then STATES."""
        one, exact = np.ones_like(self.per), u.carried is None
        warmth = z[..., WARM]
        kappa, kappa_f = warmth[..., 0], warmth[..., 1]
        slopes = [
            one,  # TORQUE
            self.beta,  # HELD
            one / self.per,  # CURRENT
            *([one / self.gain, self.beta / self.gain] if exact else []),  # CARRIED, CARRIED_HELD
            self.f,
            self.alpha,
            self.beta * self.held,
            self.rotor,
            -self.driven,  # z
            -(self.carried + self.beta * self.carried_held),  # gain
            -self.warm * self.alpha,  # kappa
            -self.warm * self.f,  # kappa_f
            -u.felt * (kappa * self.alpha + kappa_f * self.f),  # lubricant
        ]
        return np.stack(slopes, axis=-1) * self.per[..., None]
