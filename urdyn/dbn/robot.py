"""What the sensors see of an arm: the network's observation model, motor currents by Pinocchio.

    tau_load = Y(q, v, a) pi_0 + G k + Y S m + Y_last pi_payload
    i        = (tau_load + rotor a + (f + beta |tau_load| + g(v)) s + alpha v + o) / (K z)

G = d tau / d q; S spans the inertial directions that motion can show, in standard scores of the
population, so that what no motion shows stays with the prior and cannot grow overconfident.
Friction, health and rotors are logarithms: always positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.model.arm import Arm, with_inertials
from urdyn.model.consistency import log_cholesky_jacobian
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import features
from urdyn.model.population import Population
from urdyn.types import Array, Index, Mask, Motion, frozen

GROUPS = ("k", "m", "f", "alpha", "beta", "z", "o", "rotor", "payload")
SHOWN = 1e-6  # of the largest singular value: what a direction must do to torque to be tracked

DOUBT = 0.03  # [-] sd of the presliding state of a joint that slides
CREEPING_DOUBT = 0.5  # [-] added where it stands
CREEP = 0.02  # [rad/s] over which that fades


@dataclass(frozen=True, eq=False)
class RobotSlice:
    """Inputs of one slice: what the motion makes of the parameters."""

    dt: float  # [s] since the slice before
    widen: bool  # something else may be carried from here on
    A: Array  # (J, c) torque per unit of k, m, payload
    load: Array  # (J,) [N·m] rigid-body torque of the reference
    rest: Array  # (J,) [N·m] of ripple, warmth and friction that fades with speed
    s: Array  # (J,) presliding state [-]
    v: Array  # (J,) [rad/s]
    a: Array  # (J,) [rad/s²]

    @property
    def doubt(self) -> Array:
        """Standard deviation of s, (J,) [-]: a joint that creeps is held by what nobody knows."""
        return np.asarray(DOUBT + CREEPING_DOUBT * np.exp(-np.abs(self.v) / CREEP))


@dataclass(frozen=True, eq=False)
class RobotCurrents:
    """Motor currents as an `Observation` of GROUPS."""

    reference: Dynamics  # the commissioned arm: where all offsets are zero
    shown: Array  # (10 J, r) inertials per unit of m
    noise: Array  # (J,) [A] sd

    def __post_init__(self) -> None:
        object.__setattr__(self, "shown", frozen(self.shown))
        object.__setattr__(self, "noise", frozen(self.noise))

    @cached_property
    def places(self) -> dict[str, slice]:
        """Where each group stands in the state."""
        J = self.reference.arm.joints
        sizes = dict.fromkeys(GROUPS, J) | {"m": self.shown.shape[1], "payload": 10}
        ends = np.cumsum([0, *(sizes[name] for name in GROUPS)]).tolist()
        return {n: slice(a, b) for n, a, b in zip(GROUPS, ends[:-1], ends[1:], strict=True)}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """One name a state."""
        return tuple(
            f"{group}_{i}" for group, at in self.places.items() for i in range(at.stop - at.start)
        )

    @cached_property
    def linear(self) -> Mask:
        """Offsets add to the current; everything else multiplies something, (n,)."""
        mask = np.zeros(len(self.names), dtype=bool)
        mask[self.places["o"]] = True
        return mask

    @cached_property
    def _arm(self) -> Arm:
        return with_inertials(self.reference.arm, self.reference.loaded())

    def slice(self, motion: Motion, s: Array, dt: float, widen: bool = False) -> RobotSlice:
        """Inputs at one row of a motion, with the presliding state s (1, J) there."""
        drive = self.reference.drive
        Y = self._arm.regressor(motion.q, motion.v, motion.a)[0]
        G = self._arm.torque_derivatives(motion.q, motion.v, motion.a)[0][0]
        load = Y @ self._arm.inertials.ravel()
        terms = features(motion, load[None], s, drive)
        rest = sum(
            getattr(drive, name) * terms[name][0]
            for name in ("stribeck", "ripple_cos", "ripple_sin", "thermal")
        )
        A = np.hstack([G, Y @ self.shown, Y[:, -10:]])
        return RobotSlice(dt, widen, A, load, np.asarray(rest), s[0], motion.v[0], motion.a[0])

    @cached_property
    def _rigid(self) -> Index:
        at = self.places
        return np.concatenate([np.arange(at[g].start, at[g].stop) for g in ("k", "m", "payload")])

    def observe(self, x: Array, u: RobotSlice) -> Array:
        """Currents, (..., n) -> (..., J) [A]."""
        return np.asarray(self._terms(x, u)[0])

    def _terms(self, x: Array, u: RobotSlice) -> tuple[Array, ...]:
        """Current, load, f, alpha, beta, rotor, and amperes per newton metre, (..., J) each."""
        at, drive = self.places, self.reference.drive
        load = self.load(x, u)
        positive = ("f", "alpha", "beta", "rotor", "z")
        f, alpha, beta, rotor, z = (np.exp(x[..., at[name]]) for name in positive)
        per = 1.0 / (drive.gain * z)
        friction = (f + beta * np.abs(load)) * u.s + alpha * u.v + x[..., at["o"]]
        return (load + rotor * u.a + u.rest + friction) * per, load, f, alpha, beta, rotor, per

    def load(self, x: Array, u: RobotSlice) -> Array:
        """Rigid-body torque that the gears transmit, (..., n) -> (..., J) [N·m]."""
        return np.asarray(u.load + x[..., self._rigid] @ u.A.T)

    def friction(self, x: Array, u: RobotSlice) -> Array:
        """Torque that friction takes, (n,) -> (J,) [N·m]."""
        _, load, f, alpha, beta, *_ = self._terms(x, u)
        return np.asarray((f + beta * np.abs(load)) * u.s + alpha * u.v + u.rest)

    def observe_jacobian(self, x: Array, u: RobotSlice) -> Array:
        """Analytic derivative, (..., n) -> (..., J, n)."""
        at, J = self.places, self.reference.arm.joints
        current, load, f, alpha, beta, rotor, per = self._terms(x, u)
        H = np.zeros((*current.shape, len(self.names)))
        through = (1.0 + beta * np.sign(load) * u.s) * per
        H[..., self._rigid] = through[..., None] * u.A
        diagonal = range(J)
        columns = {
            "f": f * u.s * per,
            "alpha": alpha * u.v * per,
            "beta": beta * np.abs(load) * u.s * per,
            "z": -current,
            "rotor": rotor * u.a * per,
            "o": per,
        }
        for name, values in columns.items():
            H[..., diagonal, range(at[name].start, at[name].stop)] = values
        return H

    def observe_cov(self, u: RobotSlice) -> Array:
        """White noise of the currents, and doubt about presliding, (J, J)."""
        drive = self.reference.drive
        return np.diag(self.noise**2 + (u.doubt * drive.coulomb / drive.gain) ** 2)


def shown_directions(
    population: Population, reference: Dynamics, rng: np.random.Generator, samples: int = 400
) -> tuple[Array, Array]:
    """What motion can show of a population's inertials.

    Returns:
        V, (10 J, r): orthonormal directions among the links' standard scores; and S V, (10 J, r):
        the inertials that a unit of each stands for.
    """
    arm = reference.arm
    q = rng.uniform(arm.lower, arm.upper, (samples, arm.joints))
    v, a = rng.standard_normal((2, samples, arm.joints))
    J = log_cholesky_jacobian(population.link_mean)
    S = np.zeros((10 * arm.joints, 10 * arm.joints))
    for j in range(arm.joints):
        rows = slice(10 * j, 10 * j + 10)
        S[rows, rows] = J[j] * population.link_sd[j]
    Y = arm.regressor(q, v, a).reshape(-1, 10 * arm.joints) @ S
    _, singular, Vt = np.linalg.svd(Y, full_matrices=False)
    V = Vt[singular > SHOWN * singular[0]].T
    return V, S @ V
