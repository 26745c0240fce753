"""A push on a link: a torque that comes and goes.

Residuals are compared, in bins of 40 ms, with a baseline from quiet bins. What does not go away is
no push but another payload or a fault, and left to the tests of those.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.diagnose.fast.creep import Creep, at_first
from urdyn.diagnose.fast.pushed_link import (
    BIN,
    LOUD,
    MODEL,
    QUIET,
    Bin,
    Pushed,
    beyond,
    laden_sizes,
    sizes,
)
from urdyn.diagnose.fast.quiet import NOTHING, Quiet
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.fast_rules import CollisionRule
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.space import Space
from urdyn.signal.channels import mean_measured
from urdyn.types import Array, Mask, changed

CALM = 3  # quiet bins after which it is over
CLEAR = 8.0  # [-] of squares by which each of them shows it: 12 nats together, as for any load
CORRELATED = 0.3  # [-] share of the noise that a bin's mean does not average out
# [s] for which a slowing joint may still creep to a stop, held by less and less friction; before it
# begins to move, for as long, it may be held by more. A moving joint changes within TURNS.
SETTLES, TURNS = 0.4, 0.12
SLOWLY = 0.5  # [s] most that a push may take to be loud
LATE = 0.4  # [-] of a bin by which a prediction may be early or late


@dataclass(frozen=True, eq=False)
class Collision:
    """Finds pushes: torques that rise above a quiet baseline, and vanish again."""

    space: Space
    rule: CollisionRule

    @cached_property
    def pushed(self) -> Pushed:
        """Describes a push."""
        return Pushed(self.space, self.rule.least)

    def init(self) -> Quiet:
        """Nothing seen yet."""
        J = self.space.joints
        nothing, nan = np.zeros(J), np.full(J, np.nan)
        no = np.zeros(J, dtype=bool)
        return Quiet(
            base=nan,
            bare=nan,
            slack=np.zeros((2, J)),
            loose=no,
            creep=at_first(J),
            since=np.full(J, -np.inf),
            aimed=nothing,
            asked=nothing,
            spread=nothing,
            carried=np.zeros(10),
            changed=-np.inf,
            unheard=no,
        )

    def step(
        self, state: Quiet, rows: Rows, carried: Array, ill: Mask
    ) -> tuple[Quiet, list[Event]]:
        """One beat on.

        Args:
            carried: possible inertials at the tool, the likeliest first, (k, 10).
            ill: joints whose sensor is not trusted, (J,).
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
        """One bin of rows on; an event when a push is over."""
        ill = ill | ~np.isfinite(rows.residual).any(axis=0)
        if ill.all():
            return state, None
        drive = self.space.reference.drive
        tool = drive.gain[:, None] * rows.tool.mean(axis=0)
        creep, grip = state.creep.after(rows, drive), self._grip(rows)
        rho, aimed = self._torques(rows, ill, grip * creep.integrated(rows, drive))
        if not state.going:
            state = state.beside(tool, state.load_at(float(rows.t[0]), carried))
        borne = tool @ state.carried
        state = self._loosened(state, rows, rho=rho, borne=borne, aimed=aimed, creep=creep)
        late = LATE * np.abs(aimed - state.asked)
        usual, doubt = self._usual(state, rows), self._doubt(state, rows, aimed) + late
        noise = np.where(ill, np.inf, np.sqrt(usual))
        since = state.bins[-1].t if state.going else np.inf
        state = state.doubted(since, late=late).disproved()
        state = changed(state, asked=aimed, unheard=ill)
        slack = state.slack + grip * creep.grown(drive)
        felt, bare = np.nan_to_num([rho - borne - state.base, rho - state.bare])
        seen = Bin(
            t=float(rows.t[0]),
            stood=bool(creep.held.all()),
            felt=felt,
            bare=bare,
            noise=noise,
            doubt=doubt,
            slack=slack,
            q=rows.q[0],
            tool=tool,
            carried=state.carried,
        )
        size = sizes((seen,))[0]
        if not state.going and size < LOUD:
            state = changed(state, still=seen.t + BIN) if size < NOTHING else state
            return state.learnt(seen, usual + doubt**2, aimed), None
        return self._judge(state, seen, carried, ill)

    def _torques(self, rows: Rows, ill: Mask, crept: Array) -> tuple[Array, Array]:
        """The model's residual in a bin, NaN: unknown, and its prediction, (J,) [N·m].

        Args:
            crept: part of the predicted friction of standing joints that comes from speeds not
                quite zero, (J,) [N·m]: they do not move.
        """
        K = self.space.reference.drive.gain
        left = K * np.where(ill, np.nan, mean_measured(rows.residual))
        return left + crept, K * rows.predicted.mean(axis=0) - crept

    def _loosened(
        self, state: Quiet, rows: Rows, rho: Array, borne: Array, aimed: Array, creep: Creep
    ) -> Quiet:
        """With joints that begin to move or to stand, whose friction may differ from then on.

        Once they have settled, the baseline is the present residual, as far as friction may have
        changed it; or the former one, for a push may have begun just then. Until then it is
        unknown.
        """
        most, t = 2.0 * self._grip(rows), float(rows.t[0])
        turned = creep.held != state.creep.held
        since = np.where(turned, t, state.since)
        loose = t - since < np.where(creep.held, SETTLES, TURNS)
        loose |= state.loose & np.isnan(rho)
        if state.going:
            state, loose = state.doubted(t - SETTLES, slack=turned * most), loose | state.loose
        ready, unknown = state.loose & ~loose, np.isnan(state.base)
        moved = np.where(ready & ~unknown, np.clip(rho - borne - state.base, *state.slack), 0.0)
        base = np.where(unknown, rho - borne, state.base + moved)
        was = np.array([np.minimum(-moved, 0.0), np.maximum(-moved, 0.0)])
        slack = np.where(loose, np.array([-most, most]), np.where(ready, was, state.slack))
        return changed(
            state,
            base=base,
            bare=np.where(ready | unknown, base + borne, state.bare),
            aimed=np.where(ready | unknown, aimed, state.aimed),
            slack=slack,
            loose=loose,
            creep=creep,
            since=since,
        )

    def _grip(self, rows: Rows) -> Array:
        """Friction of slowly turning joints under the last row's load, (J,) [N·m]."""
        drive = self.space.reference.drive
        return np.asarray(drive.coulomb + drive.structural * np.abs(rows.load[-1]))

    def _usual(self, state: Quiet, rows: Rows) -> Array:
        """Variance of residuals without a push, (J,) [(N·m)²]."""
        noise = (self.space.reference.drive.gain * self.space.noise) ** 2
        return np.maximum(noise * (1.0 / len(rows) + CORRELATED), 2.0 * state.spread)

    def _doubt(self, state: Quiet, rows: Rows, aimed: Array) -> Array:
        """Further error of the prediction from bristles and the model, (J,) [N·m]."""
        bristles = self.space.reference.drive.gain * rows.doubt.max(axis=0)
        changed = np.abs(aimed - state.aimed)
        return np.where(state.creep.held, 0.0, bristles) + MODEL * changed

    def _judge(
        self, state: Quiet, seen: Bin, carried: Array, ill: Mask
    ) -> tuple[Quiet, Event | None]:
        """One more bin of a possible push; an event where it was one, and is over."""
        calm = _calm(state.bins, seen, carried) if state.going else None
        seen = calm or seen
        if not state.going:
            state = changed(state, loads=carried)
        state = changed(state, calm=state.calm + 1 if calm else 0, bins=(*state.bins, seen))
        if state.calm >= CALM:
            event = None
            if state.seen > CALM:
                event = self.pushed.event(state.bins, state.calm, state.loads, ill)
                event = event and _begun(event, state.still)
            if not np.array_equal(seen.carried, state.carried):
                state = changed(state, carried=seen.carried, changed=seen.t)
            bare = state.base + seen.tool @ seen.carried
            return changed(state, bare=bare).over(seen.t + BIN), event
        if seen.t - state.bins[0].t > self.rule.longest:
            base, bare = state.base + seen.felt, state.bare + seen.bare
            return changed(state, base=base, bare=bare).over(seen.t + BIN), None
        return state, None


def _calm(then: tuple[Bin, ...], seen: Bin, carried: Array) -> Bin | None:
    """The bin, if the push is over in it, with the load carried then; None: it is not over.

    Where friction alone may explain the residual, no other load is considered.
    """
    others = carried if laden_sizes((seen,))[0] >= QUIET else ()
    for load in (seen.carried, *others):
        felt = seen.felt - seen.tool @ (load - seen.carried)
        now = changed(seen, felt=felt, carried=load)
        if sizes((now,))[0] < QUIET and _gone(then, now):
            return now
    return None


def _gone(then: tuple[Bin, ...], seen: Bin) -> bool:
    """Whether a bin looks more like no push than like the loud ones.

    A joint that has just begun to move shows little; a load still there is not over.
    """
    size = sizes(then)
    loud = np.array([each.felt for each in then])[size >= min(LOUD, size.max())]
    apart = beyond(seen.felt - loud, seen.slack)
    still = np.median(np.sum((apart / seen.sd) ** 2, axis=1))
    return bool(sizes((seen,))[0] + CLEAR < still)


def _begun(event: Event, still: float) -> Event:
    """A push that may have begun right after the last quiet time: what rises slowly is loud late.

    Args:
        still: end of that time [s].
    """
    half = 0.5 * min(max(event.onset - still, 0.0), SLOWLY)
    return changed(event, onset=event.onset - half, within=event.within + half)
