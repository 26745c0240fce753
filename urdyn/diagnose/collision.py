"""A push on a link: a torque that comes and goes.

Residuals are followed in bins of 40 ms beside a baseline that quiet bins make. What does not go
away is no push but another payload or a fault, and left to those who judge such.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.diagnose.event import Event
from urdyn.diagnose.pushed import BIN, LOUD, MODEL, QUIET, Bin, Pushed, beyond, sizes
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.space import Space
from urdyn.model.friction import follow
from urdyn.signal.channels import mean_measured
from urdyn.types import Array, Mask

HELD = 0.005  # [rad/s] slower than this a joint is held by friction that does not change
LEFT = 1.5e-3  # [rad] from where it stood, within which a joint that is pushed stands still
CALM = 3  # quiet bins after which it is over
CLEAR = 8.0  # [-] of squares by which each of them says so: 12 nats together, as of any other load
FORGET = 0.08  # [-] of the baseline of a joint that moves, a bin
RELAX = 0.015  # [-] of one that stands: what holds it changes slowly, a hand may press as slowly
SPREAD = 0.02  # [-] of what is known of its spread
NOTHING = 8.0  # [-] sum of squares below which bins tell how far the baseline is to be believed
CORRELATED = 0.3  # [-] share of the noise that a bin's mean does not lose
# [s] that a joint goes on being slow before it stands, and until then it may be held by less and
# less; as long before it begins to move, it may be held by more. One that moves turns as it does.
SETTLES, TURNS = 0.4, 0.12
STILL = 3e-5  # [rad] by which encoders jitter: two steps
LATE = 0.4  # [-] of a bin by which a prediction may be early or late


@dataclass(frozen=True, eq=False)
class Quiet:
    """The baseline, and what happens beside it."""

    base: Array  # (J,) [N·m] beside what is carried; NaN: unknown
    bare: Array  # (J,) [N·m] the same if nothing is
    slack: Array  # (2, J) [N·m] from where to where friction may have taken it since
    loose: Mask  # (J,) joints that begin to move, or to stand
    held: Mask  # (J,) joints that stood
    since: Array  # (J,) [s] when they began to, or to move
    aimed: Array  # (J,) [N·m] predicted when the baseline was made
    asked: Array  # (J,) [N·m] predicted in the last bin
    s: Array  # (J,) [-] presliding states, of joints that stand those at which they came to
    ends: Array  # (2, 2, J) [-] what full friction, either way, has become since by creep
    q: Array  # (J,) [rad] up to which that goes
    place: Array  # (J,) [rad] where joints stood last
    spread: Array  # (J,) [(N·m)²] of quiet bins about it
    carried: Array  # (10,) what was taken to be at the tool
    unheard: Mask  # (J,) joints whose current nobody knew in the last bin
    seen: int = 0  # quiet bins
    calm: int = 0  # quiet bins since the last loud one
    bins: tuple[Bin, ...] = ()  # of what happens

    @property
    def going(self) -> bool:
        """Whether something happens."""
        return bool(self.bins)


@dataclass(frozen=True, eq=False)
class Collision:
    """Settings."""

    space: Space
    rule: Mapping[str, float]  # least, warning, critical [N]; longest [s]

    @cached_property
    def pushed(self) -> Pushed:
        """What a push was like."""
        return Pushed(self.space, self.rule["least"])

    def init(self) -> Quiet:
        """Nothing seen yet."""
        J = self.space.joints
        nothing, nan = np.zeros(J), np.full(J, np.nan)
        no = np.zeros(J, dtype=bool)
        return Quiet(
            nan, nan, np.zeros((2, J)), no, no, np.full(J, -np.inf), nothing, nothing,
            nothing, _full(J), nan, nan, nothing, np.zeros(10), no,
        )  # fmt: skip

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
        tool = K[:, None] * rows.tool.mean(axis=0)
        rho = K * np.where(ill, np.nan, mean_measured(rows.residual))
        aimed = K * rows.predicted.mean(axis=0)
        state, held = _stands(state, rows)
        state, freed, crept = self._crept(state, rows, held)
        rho, aimed = rho + freed, aimed - freed
        if not state.going:
            # Whoever changes their mind about what is carried has not felt anything. A joint that
            # was not heard may not have learnt of it.
            more = tool @ (carried[0] - state.carried)
            missed = state.unheard & (more != 0.0)
            base = np.where(missed, np.nan, state.base - more)
            state = replace(state, base=base, carried=carried[0])
        borne = tool @ state.carried
        state = self._loosened(state, rows, rho, borne, aimed, held)
        late = LATE * np.abs(aimed - state.asked)
        usual = self._usual(state, rows, held, aimed, late)
        sd = np.where(ill, np.inf, np.sqrt(usual))
        since = state.bins[-1].t if state.going else np.inf
        state = replace(_doubted(state, since, sd=late), asked=aimed, unheard=ill)
        felt, bare = np.nan_to_num([rho - borne - state.base, rho - state.bare])
        seen = Bin(
            float(rows.t[0]), bool(held.all()), felt, bare, sd, state.slack + crept, rows.q[0],
            tool, state.carried,
        )  # fmt: skip
        if not state.going and sizes((seen,))[0] < LOUD:
            return self._learn(state, seen, usual, aimed), None
        return self._judge(state, seen, carried, ill)

    def _loosened(
        self, state: Quiet, rows: Rows, rho: Array, borne: Array, aimed: Array, held: Mask
    ) -> Quiet:
        """With joints that begin to move or to stand, which friction may hold otherwise.

        Once they have settled, the baseline is what it is then, as far as friction may have changed
        it; or what it was, for something may have begun just then. While it lasts, nobody knows.
        """
        most, t = 2.0 * self._grip(rows), float(rows.t[0])
        turned = held != state.held
        since = np.where(turned, t, state.since)
        loose = t - since < np.where(held, SETTLES, TURNS)
        loose |= state.loose & np.isnan(rho)
        if state.going:
            state, loose = _doubted(state, t - SETTLES, slack=turned * most), loose | state.loose
        ready, unknown = state.loose & ~loose, np.isnan(state.base)
        settled = ready & ~unknown
        moved = np.where(settled, np.clip(rho - borne - state.base, *state.slack), 0.0)
        base = np.where(unknown, rho - borne, state.base + moved)
        slack = np.where(ready, _up_to(-moved), state.slack)
        slack = np.where(loose, np.array([-most, most]), slack)
        return replace(
            state,
            base=base,
            bare=np.where(ready | unknown, base + borne, state.bare),
            aimed=np.where(ready | unknown, aimed, state.aimed),
            slack=slack,
            loose=loose,
            held=held,
            since=since,
        )

    def _crept(self, state: Quiet, rows: Rows, held: Mask) -> tuple[Quiet, Array, Array]:
        """Friction of standing joints: what is predicted of it (J,), what creep may make (2, J).

        Integrated, velocities that are not quite zero let a joint creep; its encoder knows better.
        Of a joint that crept one way friction may have grown that way, whatever it was before, and
        no other way: a push takes the joint along, and the drive against it.
        """
        drive = self.space.reference.drive
        s = drive.gain * rows.drive[:, 0] / drive.coulomb
        moved = rows.q[-1] - state.q
        still = held & (np.abs(moved) < STILL)
        moved = np.where(held & ~still, np.nan_to_num(moved), 0.0)
        stood = held & state.held
        rest = np.where(stood, state.s, s[-1])
        now = np.array([follow(of, moved, drive.presliding_distance) for of in state.ends])
        ends = np.where(stood, now, _full(len(held)))
        state = replace(state, s=rest, ends=ends, q=np.where(still, state.q, rows.q[-1]))
        tail, grip = drive.presliding_tail, self._grip(rows)
        grown = (1.0 - tail) * ends[:, 0] + tail * ends[:, 1] - _full(1)[:, 0]
        return state, grip * np.where(held, s.mean(axis=0) - rest, 0.0), grip * grown

    def _grip(self, rows: Rows) -> Array:
        """Friction of joints that turn slowly, as they are loaded in the last row, (J,) [N·m]."""
        drive = self.space.reference.drive
        return np.asarray(drive.coulomb + drive.structural * np.abs(rows.load[-1]))

    def _usual(self, state: Quiet, rows: Rows, held: Mask, aimed: Array, late: Array) -> Array:
        """Variance of what joints are felt to do for no push at all, (J,) [(N·m)²]."""
        K = self.space.reference.drive.gain
        noise = (K * self.space.noise) ** 2 * (1.0 / len(rows) + CORRELATED)
        doubt = np.where(held, 0.0, K * rows.doubt.max(axis=0))
        doubt = doubt + MODEL * np.abs(aimed - state.aimed)
        return np.asarray(np.maximum(noise, 2.0 * state.spread) + (doubt + late) ** 2)

    def _judge(
        self, state: Quiet, seen: Bin, carried: Array, ill: Mask
    ) -> tuple[Quiet, Event | None]:
        calm = _calm(state.bins, seen, carried) if state.going else None
        seen = calm or seen
        state = replace(state, calm=state.calm + 1 if calm else 0, bins=(*state.bins, seen))
        if state.calm >= CALM:
            event = None
            if state.seen > CALM:
                event = self.pushed.event(state.bins, state.calm, carried, ill)
            state = replace(state, bare=state.base + seen.tool @ seen.carried)
            return replace(state, carried=seen.carried, calm=0, bins=()), event
        if seen.t - state.bins[0].t > self.rule["longest"]:
            base, bare = state.base + seen.felt, state.bare + seen.bare
            return replace(state, base=base, bare=bare, calm=0, bins=()), None
        return state, None

    def _learn(self, state: Quiet, seen: Bin, usual: Array, aimed: Array) -> Quiet:
        fresh = np.isinf(seen.sd) | state.loose
        forget = np.where(state.held, RELAX, FORGET)
        rate = np.maximum(forget, 1.0 / (state.seen + 1.0))
        square = seen.felt**2
        wide = fresh | (np.sum(np.where(fresh, 0.0, square / usual)) > NOTHING)
        clipped = np.minimum(square, 9.0 * usual)
        spread = state.spread + np.where(wide, 0.0, SPREAD * (clipped - state.spread))
        base, bare = (
            of + np.where(fresh, 0.0, rate * felt)
            for of, felt in ((state.base, seen.felt), (state.bare, seen.bare))
        )
        at = state.aimed + np.where(fresh, 0.0, rate * (aimed - state.aimed))
        kept, full = np.where(fresh, 1.0, 1.0 - rate), _full(len(fresh))
        slack, ends = kept * state.slack, full + kept * (state.ends - full)
        known = replace(
            state, base=base, bare=bare, aimed=at, slack=slack, ends=ends, spread=spread
        )
        return replace(known, seen=state.seen + 1)


def _full(joints: int) -> Array:
    """Presliding states of joints that friction holds with all it has, either way, (2, 2, J)."""
    return np.multiply.outer([1.0, -1.0], np.ones((2, joints)))


def _stands(state: Quiet, rows: Rows) -> tuple[Quiet, Mask]:
    """Joints that stand, (J,): those that are pushed give way, and no program moves as little."""
    slow = np.abs(rows.v).max(axis=0) < HELD
    near = np.abs(rows.q - state.place).max(axis=0) < LEFT
    place = np.where(slow, rows.q[-1], state.place)
    return replace(state, place=place), slow | (state.held & near)


def _calm(then: tuple[Bin, ...], seen: Bin, carried: Array) -> Bin | None:
    """A bin in which it is over, beside whichever load is carried then; None: it is not."""
    for load in (seen.carried, *carried):
        felt = seen.felt - seen.tool @ (load - seen.carried)
        now = replace(seen, felt=felt, carried=load)
        if sizes((now,))[0] < QUIET and _gone(then, now):
            return now
    return None


def _gone(then: tuple[Bin, ...], seen: Bin) -> bool:
    """Whether a bin looks more like nothing than like those that were loud.

    A joint that has just begun to move tells little; a load that is still there is no end of one.
    """
    size = sizes(then)
    loud = np.array([each.felt for each in then])[size >= min(LOUD, size.max())]
    apart = beyond(seen.felt - loud, seen.slack)
    still = np.median(np.sum((apart / seen.sd) ** 2, axis=1))
    return bool(sizes((seen,))[0] + CLEAR < still)


def _doubted(
    state: Quiet, since: float, sd: Array | float = 0.0, slack: Array | float = 0.0
) -> Quiet:
    """What was felt since then [s] may be what is known only now: no push.

    Args:
        sd: that is the least, (J,) [N·m].
        slack: that there is either way, (J,) [N·m].
    """

    def more(b: Bin) -> Bin:
        wide = _wider(b.slack, np.array([-slack, slack]))
        return replace(b, sd=np.maximum(b.sd, sd), slack=wide)

    return replace(state, bins=tuple(b if b.t < since else more(b) for b in state.bins))


def _up_to(torque: Array) -> Array:
    """From nothing to this much, (J,) -> (2, J) [N·m]."""
    return np.array([np.minimum(torque, 0.0), np.maximum(torque, 0.0)])


def _wider(slack: Array, other: Array) -> Array:
    """From the lower of two to the higher, (2, J) [N·m]."""
    return np.array([np.minimum(slack[0], other[0]), np.maximum(slack[1], other[1])])
