"""What the sensors see of an arm: the network's observation model, motor currents by Pinocchio.

    tau_load = Y(q, v, a) pi_0 + G k + Y S m + Y_last pi_payload / gain
    i        = (tau_load + rotor a + (f' + beta |tau_load| + g(v)) s + alpha' v + o) / (K z) + slow
    alpha'   = alpha exp(-kappa (w + lubricant)),    f' = f exp(-kappa_f (w + lubricant))

G = d tau / d q; S spans the inertial directions that motion can show, in standard scores of the
population, so that what no motion shows stays with the prior and cannot grow overconfident.
Friction, health, rotors and gains are logarithms: always positive. `gain` is a drive's true gain
over K, the commissioned one: what is wrong there is in pi_0 and friction too, so that it shows in
what is carried besides alone. w is how much warmer than on the first day the lubricant is, as far
as the joints' temperatures tell, and `lubricant` what they do not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.dbn.robot_slice import Carried, RobotSlice, packed
from urdyn.model.arm import Arm, with_inertials
from urdyn.model.consistency import log_cholesky, log_cholesky_jacobian
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import RIPPLE_ORDER
from urdyn.model.population import Population
from urdyn.signal.sample import Instant
from urdyn.types import Array, Index, Mask, frozen

BODIES = ("k", "m", "payload")  # what moves the rigid-body torque
POSITIVE = ("f", "alpha", "beta", "rotor", "z", "gain")
WARMTH = ("kappa", "kappa_f", "lubricant")
GROUPS = (*BODIES, *POSITIVE, "o", *WARMTH, "slow")
OWN = (*POSITIVE, "o", "kappa", "lubricant", "slow")  # groups with one state a joint: its current's
SMEAR = 0.01  # [s] of its jerk, by which an acceleration that was differentiated may be off
SHOWN = 1e-6  # of the largest singular value: what a direction must do to torque to be tracked


@dataclass(frozen=True, eq=False)
class _Parts:
    """What a drive's torque is made of, (..., J) each [N·m] but where said."""

    torque: Array  # of rigid bodies, and what is constant
    held: Array  # that structural damping rides on
    gain: Array  # [-]
    warm: Array  # [K]
    f: Array
    alpha: Array
    beta: Array  # [-]
    rotor: Array
    per: Array  # [A/(N·m)]


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
        sizes = dict.fromkeys(GROUPS, J)
        sizes |= {"m": self.shown.shape[1], "payload": 10, "kappa_f": 1}
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
        mask[self.places["o"]] = mask[self.places["slow"]] = True
        return mask

    @cached_property
    def _own(self) -> tuple[Index, Index]:
        """Each joint's current, and where OWN groups have that joint's state, (groups, J) each."""
        J = self.reference.arm.joints
        first = np.array([[self.places[name].start] for name in OWN])
        return np.broadcast_to(np.arange(J), (len(OWN), J)), first + np.arange(J)

    @cached_property
    def _arm(self) -> Arm:
        return with_inertials(self.reference.arm, self.reference.loaded())

    @cached_property
    def rigid(self) -> slice:
        """States of BODIES, the payload's last."""
        return slice(0, self.places["payload"].stop)

    @cached_property
    def _positive(self) -> slice:
        """States of POSITIVE, group by group."""
        return slice(self.places[POSITIVE[0]].start, self.places[POSITIVE[-1]].stop)

    def slice(
        self,
        now: Instant,
        s: Array,
        dt: float,
        x: Array | None = None,
        lubricant: Array | None = None,
        span: float | None = None,
    ) -> RobotSlice:
        """Inputs at one instant of a motion, with the presliding state s (J,) there.

        Args:
            x: states that tell which way each gear is loaded; the reference where not given.
            lubricant: how warm it is, (J,) [°C]; NaN where nobody measures, and so by default.
            span: over which parameters move [s]; dt where not given.
        """
        q, v, a = now.q, now.v, now.a
        warm = np.full(len(v), np.nan) if lubricant is None else lubricant
        drive = self.reference.drive
        warm = warm - drive.temperature
        unknown = np.isnan(warm)
        Y = self._arm.regressor(q, v, a)
        G, _, M = self._arm.torque_derivatives(q, v, a)
        load = Y @ self._pi
        A = np.concatenate([G, Y @ self.shown, Y[:, -10:]], axis=1)
        side = s * np.sign(load if x is None else load + A @ x[self.rigid])
        return RobotSlice(
            dt=dt,
            span=dt if span is None else span,
            packed=packed(A, side, load, self._rest(now, s), s, v, a),
            side=side,
            gripped=self._gripped,
            smeared=(SMEAR / drive.gain * (M @ now.jerk + drive.rotor_inertia * now.jerk)) ** 2,
            noise=self.noise,
            warm=np.where(unknown, 0.0, warm),
            felt=1.0 - unknown,
            blind=bool(unknown.any()),
        )

    def instrumental(self, u: RobotSlice, now: Instant, x: Array) -> tuple[Array, Array]:
        """What is packed by the instrument's accelerations, and what these add to the current.

        Who multiplies what is left of a current by a regressor that has the same acceleration's
        noise in it learns of that noise: inertia that is too small, above all where currents are
        whitened. The regressor is taken where the noise is another one, and what is left stays
        what it was: the method of instrumental variables [Soderstrom2002]_. What a joint's zero
        does is left out.

        Args:
            x: states (n,) at which the current is moved.
        """
        if now.instrument is None:
            return u.packed, np.zeros_like(now.a)
        more = now.instrument - now.a
        Y = self._arm.inertia_regressor(now.q, more)
        load, still = Y @ self._pi, np.zeros_like(more)
        A = np.concatenate([np.zeros((len(Y),) * 2), Y @ self.shown, Y[:, -10:]], axis=1)
        by = packed(A, u.side, load, still, still, still, more, one=0.0)
        # What `observe` makes of that, in half its time: there is no friction in it, and no warmth.
        _, _, beta, rotor, z, gain = np.exp(x[self._positive]).reshape(len(POSITIVE), -1)
        held = (1.0 + beta * u.side) * (load + self._borne(x, u, A, gain))
        added = (held + rotor * more) / (self.reference.drive.gain * z)
        return u.packed + by, added

    @cached_property
    def _pi(self) -> Array:
        return self._arm.inertials.ravel()

    @cached_property
    def _gripped(self) -> Array:
        return np.asarray(self.reference.drive.coulomb / self.reference.drive.gain)

    @cached_property
    def _ripples(self) -> bool:
        drive = self.reference.drive
        return bool(drive.ripple_cos.any() or drive.ripple_sin.any())

    def _rest(self, now: Instant, s: Array) -> Array:
        """Terms of friction that are no states: those that the reference has, (J,) [N·m]."""
        drive = self.reference.drive
        warmer = now.temperature - drive.temperature
        rest = drive.stribeck * np.exp(-np.abs(now.v) / drive.stribeck_velocity) * s
        rest += drive.thermal * np.where(np.isnan(warmer), 0.0, warmer) * now.v
        if self._ripples:
            turn = RIPPLE_ORDER * now.q
            rest += drive.ripple_cos * np.cos(turn) + drive.ripple_sin * np.sin(turn)
        return np.asarray(rest)

    def observe(self, x: Array, u: RobotSlice) -> Array:
        """Currents, (..., n) -> (..., J) [A]."""
        return self._currents(x, u, self._parts(x, u))

    def observe_jacobian(self, x: Array, u: RobotSlice) -> Array:
        """Analytic derivative, (..., n) -> (..., J, n)."""
        return self._slopes(x, u, self._parts(x, u))

    def linearised(self, x: Array, u: RobotSlice) -> tuple[Array, Array]:
        """Currents and their derivative, which have most of their work in common."""
        part = self._parts(x, u)
        return self._currents(x, u, part), self._slopes(x, u, part)

    def _currents(self, x: Array, u: RobotSlice, part: _Parts) -> Array:
        driven = part.torque + part.f + part.alpha + part.beta * part.held + part.rotor
        current = driven * part.per + x[..., self.places["slow"]] * u.one
        if u.carried is not None:
            besides = x[..., self.places["payload"]] - u.carried.payload
            current += besides @ u.carried.slope.T
        return np.asarray(current)

    def near(self, u: RobotSlice, x: Array, payload: Array) -> RobotSlice:
        """The slice with currents linear in the payload around this one, (10,), by drives as in x.

        A payload times what its drive makes of it is a product of states. Linearised wherever the
        payload's estimate stands just then, the errors of that estimate would be in the regressors
        of health, gain and structural damping, and ever new payloads would tell of these what
        nobody measured: the inconsistency of [Huang2010]_, mended as there, by one point for all
        samples of a payload.
        """
        at, K = self.places, self.reference.drive.gain
        beta, z, gain = (np.exp(x[at[name]]) for name in ("beta", "z", "gain"))
        torque = u.A[:, at["payload"]] + beta[:, None] * u.A_hold[:, at["payload"]]
        return replace(u, carried=Carried(payload, torque / (K * z * gain)[:, None]))

    def _parts(self, x: Array, u: RobotSlice) -> _Parts:
        at, drive, J = self.places, self.reference.drive, len(u.noise)
        positive = np.exp(x[..., self._positive])
        f, alpha, beta, rotor, z, gain = (positive[..., k * J : (k + 1) * J] for k in range(6))
        warm = u.felt * (u.warm + x[..., at["lubricant"]])
        return _Parts(
            torque=u.load + u.rest + self._borne(x, u, u.A, gain) + x[..., at["o"]] * u.one,
            held=u.hold + self._borne(x, u, u.A_hold, gain),
            gain=gain,
            warm=warm,
            f=f * np.exp(-x[..., at["kappa_f"]] * warm) * u.s,
            alpha=alpha * np.exp(-x[..., at["kappa"]] * warm) * u.v,
            beta=beta,
            rotor=rotor * u.a,
            per=1.0 / (drive.gain * z),
        )

    def _borne(self, x: Array, u: RobotSlice, A: Array, gain: Array) -> Array:
        """What k, m and payload add through A (J, c), by drives of these gains (..., J)."""
        at = self.places["payload"]
        payload, own = self._payload(x, u), slice(0, at.start)
        # In the order in memory of sigma points, like all that it meets.
        by_own = np.matmul(x[..., own], A[:, own].T, order="F")
        return np.asarray(by_own + payload @ A[:, at].T / gain)

    def _payload(self, x: Array, u: RobotSlice) -> Array:
        """What is carried, (..., 10), as far as it is multiplied by other states."""
        return x[..., self.places["payload"]] if u.carried is None else u.carried.payload

    def load(self, x: Array, u: RobotSlice) -> Array:
        """Rigid-body torque that the gears transmit, (..., n) -> (..., J) [N·m]."""
        return np.asarray(u.load + self._borne(x, u, u.A, np.exp(x[..., self.places["gain"]])))

    def friction(self, x: Array, u: RobotSlice) -> Array:
        """Torque that friction takes, (n,) -> (J,) [N·m]."""
        part = self._parts(x, u)
        return np.asarray(part.f + part.alpha + part.beta * part.held + u.rest)

    def _slopes(self, x: Array, u: RobotSlice, part: _Parts) -> Array:
        at = self.places
        friction = part.f + part.alpha + part.beta * part.held
        H = np.zeros((*part.per.shape, len(self.names)))
        H[..., self.rigid] = part.per[..., None] * (u.A + part.beta[..., None] * u.A_hold)
        H[..., at["payload"]] /= part.gain[..., None]
        carried = (H[..., at["payload"]] @ self._payload(x, u)[..., None])[..., 0]  # [A]
        H[..., at["kappa_f"].start] = -part.warm * part.f * part.per
        softer = x[..., at["kappa"]] * part.alpha + x[..., at["kappa_f"]] * part.f
        columns = {
            "f": part.f,
            "alpha": part.alpha,
            "beta": part.beta * part.held,
            "rotor": part.rotor,
            "z": -(part.torque + friction + part.rotor),
            "gain": -carried / part.per,
            "o": u.one,
            "kappa": -part.warm * part.alpha,
            "lubricant": -u.felt * softer,
            "slow": u.one / part.per,
        }
        own = np.empty((*H.shape[:-2], len(OWN), H.shape[-2]))
        for k, name in enumerate(OWN):
            own[..., k, :] = columns[name]
        H[..., *self._own] = own * part.per[..., None, :]
        if u.carried is not None:
            H[..., at["payload"]] = u.carried.slope
        return H

    def observe_cov(self, u: RobotSlice) -> Array:
        """Noise of the currents, and what nobody knows of the motion, (J, J)."""
        return np.diag(u.noise**2 + u.unknown)


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
    J = log_cholesky_jacobian(log_cholesky(reference.inertials))  # where the fit's belief is
    S = np.zeros((10 * arm.joints, 10 * arm.joints))
    for j in range(arm.joints):
        rows = slice(10 * j, 10 * j + 10)
        S[rows, rows] = J[j] * population.link_sd[j]
    Y = arm.regressor(q, v, a).reshape(-1, 10 * arm.joints) @ S
    _, singular, Vt = np.linalg.svd(Y, full_matrices=False)
    V = Vt[singular > SHOWN * singular[0]].T
    return V, S @ V
