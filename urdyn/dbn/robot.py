"""The network's observation model: an arm's motor currents, by Pinocchio.

    tau_load = Y(q, v, a) pi_0 + G k + D skew + Y S m + Y_last pi_payload / gain
    i        = (tau_load + rotor a + (f' + beta |tau_load| + g(v)) s + alpha' v + o) / (K z) + slow
    alpha'   = alpha exp(-kappa (w + lubricant)),    f' = f exp(-kappa_f (w + lubricant))

G = d tau / d q; D = d tau / d t, where skew is how much earlier a current is stamped than
commissioning assumed: on heavy joints, a few milliseconds give a speed-dependent torque as large as
damping. S spans the inertial directions that motion can show, in standard scores of the population,
so that what no motion shows stays with the prior and cannot become overconfident. Friction, health,
rotors and gains are logarithms: always positive. `gain` is a drive's true gain over K, the
commissioned one: an error in K is in pi_0 and friction too, so that it shows only in the payload. w
is how much warmer than on the first day the lubricant is, as inferred from the joints'
temperatures, and `lubricant` the error of that. States without an edge to the current are held
exactly at their first day's values.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.dbn.arguments import Arguments, Held
from urdyn.dbn.robot_drive import (
    CARRIED,
    CARRIED_HELD,
    CURRENT,
    HELD,
    POSITIVE,
    STATES,
    TORQUE,
    WARMTH,
    Draw,
)
from urdyn.dbn.robot_slice import Carried, RobotSlice, laid_out, packed, presliding_doubt
from urdyn.dbn.stacking import stacked
from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Contact, friction_torque, present
from urdyn.model.population import OPTIONAL
from urdyn.signal.sample import Instant
from urdyn.types import Array, Index, Mask, changed, freeze

BODIES = ("k", "skew", "m", "payload")  # groups that affect the rigid-body torque
GROUPS = (*BODIES, "o", "slow", *POSITIVE, *WARMTH)  # those in combinations first
SMEAR = 0.01  # [s] error of a differentiated acceleration, per jerk


@dataclass(frozen=True, eq=False)
class RobotCurrents:
    """Motor currents as an `Observation` of GROUPS."""

    reference: Dynamics  # the commissioned arm: where all offsets are zero
    shown: Array  # (10 J, r) inertials per unit of m
    noise: Array  # (J,) [A] sd
    held: Held | None = None  # states that affect no current, by the network's edges; None: none

    def __post_init__(self) -> None:
        freeze(self, "shown", "noise")

    @cached_property
    def places(self) -> dict[str, slice]:
        """Place of each group in the state."""
        J = self.reference.arm.joints
        sizes = dict.fromkeys(GROUPS, J)
        sizes |= {"skew": 1, "m": self.shown.shape[1], "payload": 10, "kappa_f": 1}
        return stacked(sizes)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """One name per state."""
        return tuple(
            f"{group}_{i}" for group, at in self.places.items() for i in range(at.stop - at.start)
        )

    @cached_property
    def linear(self) -> Mask:
        """Offsets and slow noise add to the current; everything else multiplies something, (n,)."""
        mask = np.zeros(len(self.names), dtype=bool)
        mask[self.places["o"]] = mask[self.places["slow"]] = True
        return mask

    @cached_property
    def _states(self) -> Index:
        """Which states are arguments of each joint's current, (J, s)."""
        J, at = self.reference.arm.joints, self.places
        each = [np.arange(at[name].start, at[name].stop) for name in STATES]
        return np.stack([np.broadcast_to(states, J) for states in each], axis=1)

    @cached_property
    def _arm(self) -> Arm:
        return self.reference.rigid

    @cached_property
    def rigid(self) -> slice:
        """States of BODIES, the payload's last."""
        return slice(0, self.places["payload"].stop)

    @cached_property
    def _positive(self) -> slice:
        """States of POSITIVE, group by group."""
        return slice(self.places[POSITIVE[0]].start, self.places[POSITIVE[-1]].stop)

    def inputs(
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
            x: states to determine which way each gear is loaded; by default the reference.
            lubricant: its temperature, (J,) [°C]; NaN, the default, where it is not measured.
            span: time over which parameters move [s]; by default dt.
        """
        q, v, a = now.q, now.v, now.a
        warm = np.full(len(v), np.nan) if lubricant is None else lubricant
        drive = self.reference.drive
        warm = warm - drive.temperature
        unknown = np.isnan(warm)
        G, C, M = self._arm.torque_derivatives(q, v, now.instrumental)
        later = self._later(G, C, M, now)
        A, load = self._bodies((G, later[:, None]), now, a)
        side = s * np.sign(load if x is None else load + A @ self._felt(x)[self.rigid])
        return RobotSlice(
            dt=dt,
            span=dt if span is None else span,
            packed=packed(A, side, load, self._rest(now, load, s), s, v, a),
            side=side,
            gripped=(presliding_doubt(v) * self._gripped) ** 2,
            smeared=(self._smear * (M @ now.jerk + drive.rotor_inertia * now.jerk)) ** 2,
            noise=self.noise,
            warm=np.where(unknown, 0.0, warm),
            felt=1.0 - unknown,
            blind=bool(np.count_nonzero(unknown)),
        )

    def per_unit(self, x: Array, u: RobotSlice) -> Array:
        """Current per unit of each of `packed` at states x (n,), (J, 2 c + 7) [A].

        The sums of products give the currents without slow noise: for one x, in half the time of
        `observe`, and for any other packed inputs.
        """
        x = self._felt(x)
        f, alpha, beta, rotor, z, gain = np.exp(x[self._positive]).reshape(len(POSITIVE), -1)
        kappa, kappa_f, lubricant = (x[self.places[name]] for name in WARMTH)
        warm = u.felt * (u.warm + lubricant)
        f, alpha = f * np.exp(-kappa_f * warm), alpha * np.exp(-kappa * warm)
        bodies = np.empty((len(z), self.rigid.stop))
        bodies[:] = x[self.rigid]
        bodies[:, self.places["payload"]] /= gain[:, None]
        torque = laid_out(bodies, beta, (beta, 1.0, f, alpha, 1.0, rotor, x[self.places["o"]]))
        torque /= (self.reference.drive.gain * z)[:, None]
        return torque

    def instrumental(self, u: RobotSlice, now: Instant) -> Array:
        """The packed inputs with the instrument's accelerations, (J, 2 c + 7).

        If residual and regressor contain the same noise of acceleration, estimates are biased:
        inertia comes out too small, above all with whitened currents. So the regressor takes an
        acceleration with independent noise, and the residual stays as it was: the method of
        instrumental variables [Soderstrom2002]_. The columns of zeros and skew use the instrument
        in both.
        """
        if now.instrument is None:
            return u.packed
        A, load = self._bodies((u.A[:, : self.places["m"].start],), now, now.instrument)
        return packed(A, u.side, load, u.rest, u.s, u.v, now.instrument)

    def weight(self, u: RobotSlice, now: Instant) -> Array:
        """The packed inputs of an arm that stands there without friction, (J, 2 c + 7)."""
        nothing = np.zeros_like(now.v)
        still = replace(now, v=nothing)
        A, load = self._bodies((u.A[:, : self.places["k"].stop], nothing[:, None]), still, nothing)
        return packed(A, nothing, load, nothing, nothing, nothing, nothing)

    def _felt(self, x: Array) -> Array:
        """States (..., n), with held ones replaced."""
        return x if self.held is None else self.held.instead(x)

    def _later(self, G: Array, C: Array, M: Array, now: Instant) -> Array:
        """Time derivative of torque, without reversals of friction, (J,) [N·m/s].

        By the instrument, since noise of jerk would pass for motion that shows the skew; 0 without
        one. Structural damping acts on all of it, which is a few per cent too much: it should
        exclude the part of rotors and damping.
        """
        if now.instrument is None or now.instrument_jerk is None:
            return np.zeros(len(now.v))
        drive, a, jerk = self.reference.drive, now.instrument, now.instrument_jerk
        damped = drive.viscous * a + drive.rotor_inertia * jerk
        return np.asarray(G @ now.v + C @ a + M @ jerk + damped)

    def _bodies(self, G: tuple[Array, ...], now: Instant, a: Array) -> tuple[Array, Array]:
        """A (J, c) and load (J,) of an arm with acceleration a; G: columns of k and skew."""
        borne = self._arm.regressor(now.q, now.v, a) @ self._inertials
        return np.concatenate([*G, borne[:, :-1]], axis=1), borne[:, -1]

    @cached_property
    def _inertials(self) -> Array:
        """Inertials per unit of m and of payload, and the reference's own, (10 J, c - J + 1)."""
        pi, payload = self._arm.inertials.ravel(), np.eye(self.shown.shape[0])[:, -10:]
        return np.column_stack([self.shown, payload, pi])

    @cached_property
    def _gripped(self) -> Array:
        return np.asarray(self.reference.drive.coulomb / self.reference.drive.gain)

    @cached_property
    def _smear(self) -> Array:
        return np.asarray(SMEAR / self.reference.drive.gain)

    @cached_property
    def _terms(self) -> tuple[str, ...]:
        return present(self.reference.drive, sorted(OPTIONAL))

    def _rest(self, now: Instant, load: Array, s: Array) -> Array:
        """Friction terms that are not states, as the reference has them, (J,) [N·m]."""
        at = Contact(now.q, now.v, now.temperature, load, s)
        return friction_torque(at, self.reference.drive, self._terms)

    def observe(self, x: Array, u: RobotSlice) -> Array:
        """Currents, (..., n) -> (..., J) [A]."""
        return self.through(self.arguments(u).of(x), u)

    def observe_jacobian(self, x: Array, u: RobotSlice) -> Array:
        """Analytic derivative, (..., n) -> (..., J, n)."""
        return self.linearised(x, u)[1]

    def linearised(self, x: Array, u: RobotSlice) -> tuple[Array, Array]:
        """Currents and their derivative, which share most of the work."""
        arguments = self.arguments(u)
        z = arguments.of(x)
        draw = self._draw(z, u)
        return draw.currents(z, u), arguments.back(draw.slopes(z, u))

    def arguments(self, u: RobotSlice) -> Arguments:
        """TORQUE, HELD, CURRENT, CARRIED, CARRIED_HELD, and STATES of each joint."""
        at, exact, J = self.places, u.carried is None, self.reference.arm.joints
        own, payload = slice(0, at["payload"].start), at["payload"]
        W = np.zeros((J, 5 if exact else 3, at["slow"].stop))
        W[:, TORQUE, own], W[:, HELD, own] = u.A[:, own], u.A_hold[:, own]
        for kind, of in (TORQUE, "o"), (CURRENT, "slow"):
            W[:, kind, at[of]].flat[:: J + 1] = u.one
        if u.carried is not None:
            W[:, CURRENT, payload] = u.carried.slope
        else:
            W[:, CARRIED, payload] = u.A[:, payload]
            W[:, CARRIED_HELD, payload] = u.A_hold[:, payload]
        return Arguments(W, self._states, len(self.names), self.held)

    def through(self, z: Array, u: RobotSlice) -> Array:
        """Currents from their arguments, (..., J, d) -> (..., J) [A]."""
        return self._draw(z, u).currents(z, u)

    def _draw(self, z: Array, u: RobotSlice) -> Draw:
        return Draw.of(z, u, self.reference.drive.gain)

    def near(self, u: RobotSlice, x: Array, payload: Array) -> RobotSlice:
        """The slice with currents linear in the payload about this one, (10,), for drives as in x.

        Payload and drive parameters multiply. If linearised at the current estimate of the payload,
        its errors would enter the regressors of health, gain and structural damping, and ever new
        payloads would seem to give information on these: the inconsistency of [Huang2010]_, cured
        as there, by one linearisation point for all samples of a payload.
        """
        at, K = self.places["payload"], self.reference.drive.gain
        _, _, beta, _, z, gain = np.exp(self._felt(x)[self._positive]).reshape(len(POSITIVE), -1)
        A, A_hold = u.A[:, at], u.A_hold[:, at]
        slope = (A + beta[:, None] * A_hold) / (K * z * gain)[:, None]
        near = Carried(payload, slope, A @ payload, A_hold @ payload, slope @ payload)
        return changed(u, carried=near)

    def load(self, x: Array, u: RobotSlice) -> Array:
        """Rigid-body torque that the gears transmit, (n,) -> (J,) [N·m]."""
        at, x = self.places["payload"], self._felt(x)
        payload = x[at] if u.carried is None else u.carried.payload
        borne = u.A[:, at] @ payload / np.exp(x[self.places["gain"]])
        return np.asarray(u.load + u.A[:, : at.start] @ x[: at.start] + borne)

    def friction(self, x: Array, u: RobotSlice) -> Array:
        """Friction torque, (n,) -> (J,) [N·m]."""
        return np.asarray(self._draw(self.arguments(u).of(x), u).friction + u.rest)

    def observe_cov(self, u: RobotSlice) -> Array:
        """Covariance of the currents' noise, and of the motion's uncertainty, (J, J)."""
        return np.diag(u.variance)
