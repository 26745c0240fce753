"""A push on a link: a torque that comes and goes, in the pattern of a force at one place.

    tau_j = J_j(q)' F        for the joints below the link that is pushed; the others feel nothing

Residuals are followed in bins of 40 ms beside a baseline that quiet bins make. What does not go
away is no push but another payload or a fault, and left to those who judge such.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.event import Event
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.space import Space
from urdyn.types import Array, Mask

BIN = 0.04  # [s]
HELD = 0.005  # [rad/s] slower than this a joint is held by friction that does not change
QUIET = 30.0  # [-] sum of squares below which nothing happens
LOUD = 90.0  # [-] above which something does
CALM = 3  # quiet bins after which it is over
CLEAR = 8.0  # [-] of squares by which each of them says so: 12 nats together, as of any other load
FORGET = 0.08  # [-] of the baseline of a joint that moves, a bin
RELAX = 0.015  # [-] of one that stands: what holds it changes slowly, a hand may press as slowly
NOTHING = 8.0  # [-] sum of squares below which bins tell how far the baseline is to be believed
CORRELATED = 0.3  # [-] share of the noise that a bin's mean does not lose
MODEL = 0.05  # [-] of a torque that changes, which the model may have wrong
LATE = 0.4  # [-] of a bin by which a prediction may be early or late
FORCE = 100.0  # [N] sd of a push


@dataclass(frozen=True, eq=False)
class Quiet:
    """The baseline, and what happens beside it."""

    base: Array  # (J,) [N·m]; NaN: unknown
    held: Mask  # (J,) joints that stood
    aimed: Array  # (J,) [N·m] predicted when the baseline was made
    asked: Array  # (J,) [N·m] predicted in the last bin
    gripped: Array  # (J,) [N·m] of friction, predicted when the baseline was made
    spread: Array  # (J,) [(N·m)²] of quiet bins about it
    seen: int = 0  # quiet bins
    calm: int = 0  # quiet bins since the last loud one
    begin: float = np.nan  # [s] of what happens; NaN: nothing
    t: tuple[float, ...] = ()  # of its bins
    stood: tuple[bool, ...] = ()  # whether the arm did
    felt: tuple[Array, ...] = ()  # (J,) [N·m] of each
    sd: tuple[Array, ...] = ()
    q: tuple[Array, ...] = ()
    tool: tuple[Array, ...] = ()  # (J, 10) [N·m] per unit of payload
    carried: tuple[Array, ...] = ()  # (10,) what was taken to be carried


@dataclass(frozen=True, eq=False)
class Collision:
    """Settings."""

    space: Space
    rule: Mapping[str, float]  # least, warning, critical [N]; longest [s]

    def init(self) -> Quiet:
        """Nothing seen yet."""
        J = self.space.joints
        nothing = np.zeros(J)
        return Quiet(np.full(J, np.nan), np.zeros(J, dtype=bool), *4 * (nothing,))

    def step(
        self, state: Quiet, rows: Rows, carried: Array, ill: Mask
    ) -> tuple[Quiet, list[Event]]:
        """A beat on.

        Args:
            carried: inertials that may be at the tool, the likeliest first, (k, 10).
            ill: joints whose sensor is not to be believed, (J,).
        """
        found: list[Event] = []
        edges = np.flatnonzero(np.diff(np.floor(rows.t / BIN), prepend=-np.inf)).tolist()
        for start, stop in zip(edges, [*edges[1:], len(rows)], strict=True):
            state, event = self._bin(state, rows.part(start, stop), carried, ill)
            found += [event] if event else []
        return state, found

    def _bin(
        self, state: Quiet, rows: Rows, carried: Array, ill: Mask
    ) -> tuple[Quiet, Event | None]:
        ill = ill | ~np.isfinite(rows.residual).any(axis=0)
        if ill.all():
            return state, None
        K = self.space.reference.drive.gain
        tool = K[:, None] * rows.rigid[..., -10:].mean(axis=0)
        rho = K * np.where(ill, 0.0, _mean(rows.residual)) - tool @ carried[0]
        aimed, held = K * rows.predicted.mean(axis=0), np.abs(rows.v).max(axis=0) < HELD
        grip = K * (rows.drive[:, 0] + rows.drive[:, 2]).mean(axis=0)
        going, changed = np.isfinite(state.begin), np.isnan(state.base) | (held != state.held)
        if not going:
            state = replace(
                state,
                base=np.where(changed, rho, state.base),
                held=held,
                aimed=np.where(changed, aimed, state.aimed),
                gripped=np.where(changed, grip, state.gripped),
            )
        noise = (K * self.space.noise) ** 2 * (1.0 / len(rows) + CORRELATED)
        # Integrated, a velocity that is not quite zero lets a joint creep that stands.
        crept, slid = np.abs(grip - state.gripped), K * rows.doubt.max(axis=0)
        doubt = np.where(held, crept, slid) + MODEL * np.abs(aimed - state.aimed)
        late = LATE * np.abs(aimed - state.asked)
        doubt = doubt + late
        state = replace(_doubted(state, late), asked=aimed)
        var = np.maximum(noise, 2.0 * state.spread) + doubt**2
        # What a joint that begins to move was held by is unknown, up to its friction.
        most, plain = 2.0 * self.space.reference.drive.coulomb, np.where(ill, np.inf, var)
        var = np.where(changed, most**2 + var if going else np.inf, var)
        var = np.where(ill, np.inf, var)
        felt = rho - state.base
        size, least = (float(np.sum(felt**2 / x)) for x in (var, plain))
        moment = (float(rows.t[0]), bool(held.all()), felt, np.sqrt(var), rows.q[0], tool)
        return self._judge(state, (size, least), moment, (aimed, grip), carried, ill)

    def _judge(
        self,
        state: Quiet,
        size: tuple[float, float],
        moment: tuple[float, bool, Array, Array, Array, Array],
        predicted: tuple[Array, Array],
        carried: Array,
        ill: Mask,
    ) -> tuple[Quiet, Event | None]:
        t, stood, felt, sd, q, tool = moment
        going = np.isfinite(state.begin)
        if not going and size[0] < LOUD:
            return self._learn(state, felt, sd, *predicted), None
        over = going and size[1] < QUIET and _gone(state, felt, sd)
        state = replace(
            state,
            begin=state.begin if going else t,
            calm=state.calm + 1 if over else 0,
            t=(*state.t, t), stood=(*state.stood, stood),
            felt=(*state.felt, felt), sd=(*state.sd, sd), q=(*state.q, q),
            tool=(*state.tool, tool), carried=(*state.carried, carried[0]),
        )  # fmt: skip
        if state.calm >= CALM:
            event = self._event(state, carried, ill) if state.seen > CALM else None
            return self._over(state, state.base), event
        if t - state.begin > self.rule["longest"]:
            return self._over(state, state.base + felt), None
        return state, None

    def _learn(self, state: Quiet, felt: Array, sd: Array, aimed: Array, grip: Array) -> Quiet:
        clipped = np.minimum(felt**2, 9.0 * sd**2)
        fresh = np.isinf(sd)
        forget = np.where(state.held, RELAX, FORGET)
        rate = np.maximum(forget, 1.0 / (state.seen + 1.0))
        learn = fresh | (np.nansum((felt / sd) ** 2) > NOTHING)
        spread = np.where(learn, state.spread, state.spread + 0.02 * (clipped - state.spread))
        base = np.where(fresh, state.base, state.base + rate * felt)
        at = state.aimed + rate * (aimed - state.aimed)
        gripped = state.gripped + rate * (grip - state.gripped)
        return replace(
            state, base=base, aimed=at, gripped=gripped, spread=spread, seen=state.seen + 1
        )

    def _over(self, state: Quiet, base: Array) -> Quiet:
        return replace(
            state, base=base, calm=0, begin=np.nan, t=(), stood=(), felt=(), sd=(), q=(), tool=(),
            carried=(),
        )  # fmt: skip

    def _event(self, state: Quiet, carried: Array, ill: Mask) -> Event | None:
        """What the push was like, if it was one."""
        felt, sd = np.array(state.felt), np.array(state.sd)
        sd = np.where(ill, np.inf, sd)
        sizes = np.sum((felt / sd) ** 2, axis=1)
        if sizes.max() < LOUD:
            return None  # it was the sensor
        for other in carried:
            more = other - np.array(state.carried)
            left = felt - np.einsum("bjk,bk->bj", np.array(state.tool), more)
            if np.sum(np.minimum(sizes, np.sum((left / sd) ** 2, axis=1))) < 0.5 * sizes.sum():
                return None  # a piece was taken or put down
        if _left_with_it(np.array(state.stood), felt, sd):
            return None
        peak = int(np.argmax(sizes))
        strong = sizes > 0.5 * sizes[peak]
        mean, doubt = felt[strong].mean(axis=0), sd[peak] / np.sqrt(strong.sum())
        told = np.isfinite(doubt)
        link, share, force = self._place(state.q[peak], mean, doubt, told)
        strength = float(np.linalg.norm(force))
        if strength < self.rule["least"]:
            return None
        end = state.t[-1 - state.calm] + BIN if len(state.t) > state.calm else state.t[-1]
        evidence = {
            "link": self.space.reference.arm.link_names[link],
            "force_N": force.tolist(),
            "strength_N": strength,
            "duration_s": float(end - state.begin),
            "peak_s": state.t[peak],
            "torque_Nm": felt[peak].tolist(),
            "statistic": float(sizes[peak]),
            "threshold": LOUD,
        }
        return Event("collision", link, state.begin, state.t[-1] + BIN, share, strength, evidence)

    def _place(self, q: Array, felt: Array, sd: Array, told: Mask) -> tuple[int, float, Array]:
        """The link that explains the torques best, its share of the evidence, and the force [N]."""
        arm, weights, forces = self.space.reference.arm, [], []
        frames = [(k, name) for k, name in enumerate(arm.link_names) if k]
        frames.append((arm.joints - 1, arm.tool))
        V = np.diag(sd[told] ** 2 + (MODEL * felt[told]) ** 2)
        for link, frame in frames:
            J = arm.jacobian(q, frame)[:3, :]
            J = np.where(np.arange(arm.joints) <= link, J, 0.0)[:, told]
            # The drives hold against the push: what they give more is -J' F.
            S = V + FORCE**2 * J.T @ J
            gain = -(FORCE**2) * J @ np.linalg.inv(S)
            weights.append(
                -0.5 * np.linalg.slogdet(S)[1] - 0.5 * felt[told] @ np.linalg.solve(S, felt[told])
            )
            forces.append(gain @ felt[told])
        share = np.exp(np.array(weights) - max(weights))
        share /= share.sum()
        links = np.array([link for link, _ in frames])
        best = int(np.argmax(share))
        return int(links[best]), float(share[links == links[best]].sum()), forces[best]


def _mean(values: Array) -> Array:
    """Mean of what is finite, column by column; 0 where nothing is."""
    there = np.isfinite(values)
    return np.asarray(np.where(there, values, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1))


def _gone(state: Quiet, felt: Array, sd: Array) -> bool:
    """Whether a bin looks more like nothing than like any that was loud.

    A joint that has just begun to move tells little; a load that is still there is no end of one.
    """
    then, doubt = np.array(state.felt), np.array(state.sd)
    sizes = np.sum((then / doubt) ** 2, axis=1)
    loud = then[sizes >= min(LOUD, sizes.max())]
    still = np.sum(((felt - loud) / sd) ** 2, axis=1).min()
    return bool(np.sum((felt / sd) ** 2) + CLEAR < still)


def _left_with_it(stood: Mask, felt: Array, sd: Array) -> bool:
    """Whether an arm that stood went away with what it felt: a piece, as far as anybody can tell.

    What a joint felt that began to move is doubtful; if it were not, half of the force would be
    there still.

    Args:
        stood: in each bin, (B,).
        felt, sd: (B, J) [N·m].
    """
    sizes = np.sum((felt / sd.min(axis=0)) ** 2, axis=1)
    return bool(
        stood.any() and not stood.all() and sizes[-CALM:].mean() > 0.25 * sizes[stood].max()
    )


def _doubted(state: Quiet, late: Array) -> Quiet:
    """What was just felt may be a change that was predicted a little later, (J,) [N·m]."""
    if not state.sd:
        return state
    return replace(state, sd=(*state.sd[:-1], np.hypot(state.sd[-1], late)))
