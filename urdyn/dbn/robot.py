"""What the sensors see of an arm: the network's observation model, motor currents by Pinocchio.

    tau_load = Y(q, v, a) pi_0 + G k + D skew + Y S m + Y_last pi_payload / gain
    i        = (tau_load + rotor a + (f' + beta |tau_load| + g(v)) s + alpha' v + o) / (K z) + slow
    alpha'   = alpha exp(-kappa (w + lubricant)),    f' = f exp(-kappa_f (w + lubricant))

G = d tau / d q; D = d tau / d t, by the time that a current is told earlier than commissioning took
it to be: some milliseconds of it are, on heavy joints, as much torque by speed as damping is. S
spans the inertial directions that motion can show, in standard scores of the population, so that
what no motion shows stays with the prior and cannot grow overconfident. Friction, health,
rotors and gains are logarithms: always positive. `gain` is a drive's true gain over K, the
commissioned one: what is wrong there is in pi_0 and friction too, so that it shows in what is
carried besides alone. w is how much warmer than on the first day the lubricant is, as far as the
joints' temperatures tell, and `lubricant` what they do not. What moves no current, by the network's
edges, stands in all this as on the first day, and for sure.
"""

from __future__ import annotations

from dataclasses import dataclass
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
from urdyn.model.arm import Arm, with_inertials
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Contact, friction_torque, present
from urdyn.model.population import OPTIONAL
from urdyn.signal.sample import Instant
from urdyn.types import Array, Index, Mask, changed, frozen

BODIES = ("k", "skew", "m", "payload")  # what moves the rigid-body torque
GROUPS = (*BODIES, "o", "slow", *POSITIVE, *WARMTH)  # what combinations are made of first
SMEAR = 0.01  # [s] of its jerk, by which an acceleration that was differentiated may be off


@dataclass(frozen=True, eq=False)
class RobotCurrents:
    """Motor currents as an `Observation` of GROUPS."""

    reference: Dynamics  # the commissioned arm: where all offsets are zero
    shown: Array  # (10 J, r) inertials per unit of m
    noise: Array  # (J,) [A] sd
    held: Held | None = None  # states that move no current, by the network's edges; None: none

    def __post_init__(self) -> None:
        object.__setattr__(self, "shown", frozen(self.shown))
        object.__setattr__(self, "noise", frozen(self.noise))

    @cached_property
    def places(self) -> dict[str, slice]:
        """Where each group stands in the state."""
        J = self.reference.arm.joints
        sizes = dict.fromkeys(GROUPS, J)
        sizes |= {"skew": 1, "m": self.shown.shape[1], "payload": 10, "kappa_f": 1}
        return stacked(sizes)

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
    def _states(self) -> Index:
        """Which states are arguments of each joint's current, (J, s)."""
        J, at = self.reference.arm.joints, self.places
        each = [np.arange(at[name].start, at[name].stop) for name in STATES]
        return np.stack([np.broadcast_to(states, J) for states in each], axis=1)

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
            x: states that tell which way each gear is loaded; the reference where not given.
            lubricant: how warm it is, (J,) [°C]; NaN where nobody measures, and so by default.
            span: over which parameters move [s]; dt where not given.
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
        """What a unit of each of `packed` draws at states x (n,), (J, 2 c + 7) [A].

        The currents, but for slow noise, are the sums of their products: for one x, in half the
        time of `observe`, and of anything else that is packed.
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
        """What is packed by the instrument's accelerations, (J, 2 c + 7).

        Who multiplies what is left of a current by a regressor that has the same acceleration's
        noise in it learns of that noise: inertia that is too small, above all where currents are
        whitened. The regressor is taken where the noise is another one, and what is left stays
        what it was: the method of instrumental variables [Soderstrom2002]_. What a joint's zero
        and the skew do is told by the instrument in both.
        """
        if now.instrument is None:
            return u.packed
        A, load = self._bodies((u.A[:, : self.places["m"].start],), now, now.instrument)
        return packed(A, u.side, load, u.rest, u.s, u.v, now.instrument)

    def _felt(self, x: Array) -> Array:
        """States (..., n) as the currents have them."""
        return x if self.held is None else self.held.instead(x)

    def _later(self, G: Array, C: Array, M: Array, now: Instant) -> Array:
        """Torque's slope in time, while friction turns over when it does, (J,) [N·m/s].

        By the instrument: noise of jerk would pass for a motion that tells of the skew. Where there
        is none, nothing does. Structural damping rides on all of it, which is some per cent too
        much: not on what rotors and damping add.
        """
        if now.instrument is None or now.instrument_jerk is None:
            return np.zeros(len(now.v))
        drive, a, jerk = self.reference.drive, now.instrument, now.instrument_jerk
        damped = drive.viscous * a + drive.rotor_inertia * jerk
        return np.asarray(G @ now.v + C @ a + M @ jerk + damped)

    def _bodies(self, G: tuple[Array, ...], now: Instant, a: Array) -> tuple[Array, Array]:
        """A (J, c) and load (J,) of an arm that accelerates by a; G: columns of k and skew."""
        borne = self._arm.regressor(now.q, now.v, a) @ self._inertials
        return np.concatenate([*G, borne[:, :-1]], axis=1), borne[:, -1]

    @cached_property
    def _inertials(self) -> Array:
        """Per unit of m and of payload, and the reference's own, (10 J, c - J + 1)."""
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
        """Terms of friction that are no states: those that the reference has, (J,) [N·m]."""
        at = Contact(now.q, now.v, now.temperature, load, s)
        return friction_torque(at, self.reference.drive, self._terms)

    def observe(self, x: Array, u: RobotSlice) -> Array:
        """Currents, (..., n) -> (..., J) [A]."""
        return self.through(self.arguments(u).of(x), u)

    def observe_jacobian(self, x: Array, u: RobotSlice) -> Array:
        """Analytic derivative, (..., n) -> (..., J, n)."""
        return self.linearised(x, u)[1]

    def linearised(self, x: Array, u: RobotSlice) -> tuple[Array, Array]:
        """Currents and their derivative, which have most of their work in common."""
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
        """Currents by their arguments, (..., J, d) -> (..., J) [A]."""
        return self._draw(z, u).currents(z, u)

    def _draw(self, z: Array, u: RobotSlice) -> Draw:
        return Draw.of(z, u, self.reference.drive.gain)

    def near(self, u: RobotSlice, x: Array, payload: Array) -> RobotSlice:
        """The slice with currents linear in the payload around this one, (10,), by drives as in x.

        A payload times what its drive makes of it is a product of states. Linearised wherever the
        payload's estimate stands just then, the errors of that estimate would be in the regressors
        of health, gain and structural damping, and ever new payloads would tell of these what
        nobody measured: the inconsistency of [Huang2010]_, mended as there, by one point for all
        samples of a payload.
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
        """Torque that friction takes, (n,) -> (J,) [N·m]."""
        return np.asarray(self._draw(self.arguments(u).of(x), u).friction + u.rest)

    def observe_cov(self, u: RobotSlice) -> Array:
        """Noise of the currents, and what nobody knows of the motion, (J, J)."""
        return np.diag(u.variance)
