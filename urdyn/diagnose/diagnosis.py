"""From moments of work to findings: fast kinds every beat, slow kinds every moment.

    diagnosis = Diagnosis(fit, period)
    state = diagnosis.init()
    state, findings = diagnosis.step(state, now)     # new or changed findings

The commissioned model is held: what is judged never changes its own reference.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from urdyn.diagnose.fast.encoder import all_seen, ever_unseen, seen, unseen, well
from urdyn.diagnose.fast.encoder_zero import jumps
from urdyn.diagnose.fast.fast import Fast
from urdyn.diagnose.fast.observability import MOVED
from urdyn.diagnose.fast.sensor import BELIEVED
from urdyn.diagnose.findings.ledger import Ledger
from urdyn.diagnose.kinds.change import Push
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.kinds.rules import Rules
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.load.carrying import MOMENT
from urdyn.diagnose.residual.pace import BEAT, Pace
from urdyn.diagnose.residual.rows import Rows, joined, rows
from urdyn.diagnose.residual.space import Space, space
from urdyn.diagnose.residual.warmth import felt, unfelt
from urdyn.diagnose.slow.onsets import PAUSE
from urdyn.diagnose.slow.slow import Slow
from urdyn.diagnose.state import Now, State, motion_of
from urdyn.identify.fit import Fit
from urdyn.types import Array, Mask, Motion

# Fast kinds that distort the data of slow ones.
BENDS = ("sensor_fault", "joint_backlash", "controller_instability")


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Diagnosis of a commissioned arm: fast tests every beat, slow ones every moment."""

    fit: Fit
    period: float  # [s] between rows
    rules: Rules = field(default_factory=read_rules)

    @cached_property
    def space(self) -> Space:
        """Where each possible change has a direction."""
        return space(self.fit)

    @cached_property
    def fast(self) -> Fast:
        """Tests of fast kinds."""
        return Fast(self.space, self.period, self.rules.fast, self.rules.jump)

    @cached_property
    def slow(self) -> Slow:
        """Tests of slow kinds."""
        return Slow(self.space, self.period, self.rules)

    @cached_property
    def pace(self) -> Pace:
        """How many rows are processed together."""
        return Pace(self.period)

    @cached_property
    def ledger(self) -> Ledger:
        """Turns the tests' results into findings."""
        return Ledger(self.space, self.rules, self.slow.judge)

    def init(self) -> State:
        """Before the first instant."""
        J = self.space.joints
        return State(self.fast.init(), self.slow.init(), unfelt(J), np.zeros(J), all_seen(J))

    def step(self, state: State, now: Now) -> tuple[State, list[Finding]]:
        """One instant on; new findings, and those that are worse than before.

        A clock that is set back does not show how long that took: time goes on as after a pause.
        """
        ahead, known = state.ahead, np.isfinite(now.instant.current)
        if now.instant.t + ahead <= state.last:
            ahead = state.last + PAUSE + self.period - now.instant.t
        t, found = now.instant.t + ahead, list[Finding]()
        if np.count_nonzero(silent := np.isnan(now.instant.q)):
            return self._unseen(replace(state, ahead=ahead), t, silent, known)
        if state.chunk and t - state.last > self.pace.gap:
            state, found = self._chunk(state)
        now = replace(now, instant=replace(now.instant, t=t))
        chunk = (*state.chunk, now)
        state = replace(state, ahead=ahead, chunk=chunk)
        state, more = self._seen(state, np.array([t]), now.instant.q[None], known[None])
        left = self.pace.beat - sum(map(len, state.beat))
        if len(state.chunk) < min(self.pace.chunk, max(left, 1)):
            return state, found + more
        state, late = self._chunk(state)
        return state, found + more + late

    def _seen(self, state: State, t: Array, q: Array, known: Mask) -> tuple[State, list[Finding]]:
        """After instants (N,) [s] with known angles, (N, J) [rad]: which sensors are well again?"""
        last = float(t[-1])
        unseen, events = well(seen(state.unseen, t, q, known), last)
        state = replace(state, last=last, unseen=unseen)
        return self._told(state, events) if events else (state, [])

    def _unseen(
        self, state: State, t: float, silent: Mask, known: Mask
    ) -> tuple[State, list[Finding]]:
        """With an instant without some angles, but perhaps with their currents, (J,) each."""
        held = self.rules.fast.sensor_silent.held
        unknown, events = unseen(state.unseen, t, silent, known, held)
        return self._blind(replace(state, unseen=unknown), events)

    def _ever_unseen(self, state: State, t: Array, silent: Mask, known: Mask) -> State:
        """With many such instants, (N,) [s] and (N, J) each."""
        if not silent.any():
            return state
        held = self.rules.fast.sensor_silent.held
        unknown, events = ever_unseen(state.unseen, t, silent, known, held)
        return self._blind(replace(state, unseen=unknown), events)[0]

    def _blind(self, state: State, events: list[Event]) -> tuple[State, list[Finding]]:
        """Without what waits, where an encoder was found silent; it also affects the last beat."""
        if not events:
            return state, []
        slow = self.slow.unsaid(state.slow, min(event.onset for event in events) - BEAT)
        return self._told(replace(state, slow=slow, chunk=(), beat=(), moment=()), events)

    def _chunk(self, state: State) -> tuple[State, list[Finding]]:
        """The kept instants, compared with the commissioned model."""
        state, part = self._rows(replace(state, chunk=()), *motion_of(state.chunk))
        return self.take(state, part)

    def _rows(self, state: State, motion: Motion, s: Array, travelled: Array) -> tuple[State, Rows]:
        """A motion compared with the model, without the encoder jumps already reported."""
        warmth = felt(state.warmth, motion.t, motion.temperature)
        off = state.off + np.cumsum(jumps(motion.shift, self.rules.jump), axis=0)
        if np.count_nonzero(off):
            motion = replace(motion, q=motion.q - off)
        state = replace(state, warmth=warmth, off=off[-1])
        return state, rows(self.space, motion, s, travelled, warmth)

    def take(self, state: State, part: Rows) -> tuple[State, list[Finding]]:
        """Process some rows, at most a beat and without a gap."""
        found: list[Finding] = []
        before = (*state.moment, *state.beat)
        if before and part.t[0] - before[-1].t[-1] > self.pace.gap:
            state, found = self._broken(state)
        state = replace(state, beat=(*state.beat, part))
        if self.pace.lasted(state.beat[0].t[0], part.t[-1], BEAT):
            state, more = self._beat(state)
            found += more
        return state, found

    def _broken(self, state: State) -> tuple[State, list[Finding]]:
        """Finish a beat and a moment that a gap has ended."""
        state, found = self._beat(state) if state.beat else (state, [])
        if not state.moment:
            return state, found
        state, more = self._moment(state)
        return state, found + more

    def finish(self, state: State) -> tuple[State, list[Finding]]:
        """Process what waits, at the end of a recording."""
        found: list[Finding] = []
        if state.chunk:
            state, found = self._chunk(state)
        if state.beat:
            state, more = self._beat(state)
            found += more
        state, more = self._tells_again(state)
        found += more
        slow = self.slow.concluded(state.slow, state.push)
        state, more = self._changes(replace(state, slow=slow))
        return state, found + more

    def _tells_again(self, state: State) -> tuple[State, list[Finding]]:
        """With sensors that failed, but at the end have worked for long enough to be trusted."""
        if np.isinf(state.last):
            return state, []
        sensors, currents = self.fast.sensors.well(state.fast.sensors, state.last, BELIEVED)
        unseen, angles = well(state.unseen, state.last, BELIEVED)
        state = replace(state, unseen=unseen, fast=replace(state.fast, sensors=sensors))
        return self._told(state, [*currents, *angles])

    def _beat(self, state: State) -> tuple[State, list[Finding]]:
        beat = joined(state.beat)
        fast, events, untrue = self.fast.step(state.fast, beat, state.slow.carrying.loads)
        believed = replace(beat, settled=beat.settled & ~untrue)
        state = replace(state, fast=fast, beat=(), moment=(*state.moment, believed))
        if sick := [event.onset for event in events if _bends(event)]:
            slow = self.slow.unsaid(state.slow, min(sick))
            state = replace(state, slow=slow, moment=(believed,))
        push = _told_of(state.push, events, fast.quiet.going)
        state, found = self._told(replace(state, push=push), events)
        book = self.ledger.unjolted(state.book, state.fast.reversals.recurred)
        state = replace(state, book=book)
        first, last = state.moment[0].t[0], state.moment[-1].t[-1]
        if not self.pace.lasted(first, last, MOMENT):
            return state, found
        state, more = self._moment(state)
        return state, found + more

    def _moment(self, state: State) -> tuple[State, list[Finding]]:
        """Process a moment that is over."""
        slow = self.slow.moment(state.slow, joined(state.moment), state.push)
        return self._changes(replace(state, slow=slow, moment=(), push=Push(state.push.going)))

    def _told(self, state: State, events: Iterable[Event]) -> tuple[State, list[Finding]]:
        """Events as findings."""
        book, found = self.ledger.events(state.book, events)
        return replace(state, book=book), found

    def _changes(self, state: State) -> tuple[State, list[Finding]]:
        """New changes as findings, and the course of the known ones."""
        book, found = self.ledger.changes(state.book, state.slow)
        book, slow = self.ledger.closed(book, state.slow)
        return replace(state, book=book, slow=slow), found

    def findings(self, state: State) -> list[Finding]:
        """All findings as they are now; `state.findings` has them as last reported."""
        return self.ledger.now(state.book, state.slow)

    def observable(self, state: State) -> list[dict[str, Any]]:
        """Joint by joint, whether this motion could show backlash; if not, one that would."""
        return self.fast.observable(state.fast)

    def judged(self, state: State) -> list[bool]:
        """Joint by joint, whether it has moved for long enough to be judged, at commissioning too.

        None is before the first block was compared.
        """
        moved = (state.fast.reversals.slid > MOVED) & ~self.space.unlearnt
        return [bool(enough) for enough in moved & np.isfinite(state.book.upto)]

    def over(self, motion: Motion, s: Array, travelled: Array) -> tuple[State, list[Finding]]:
        """A whole motion at once: the same beats as instant by instant, except at their seams."""
        state, silent, told = self.init(), np.isnan(motion.q), 0
        there = np.isfinite(motion.current)
        known = np.flatnonzero(np.isfinite(motion.q + motion.v + motion.a).all(axis=1))
        apart = np.diff(motion.t[known]) > self.pace.gap
        for stretch in np.split(known, np.flatnonzero(apart) + 1):
            for at in range(0, len(stretch), self.pace.beat):
                part = stretch[at : at + self.pace.beat]
                upto = slice(told, told := int(part[-1]) + 1)
                state = self._ever_unseen(state, motion.t[upto], silent[upto], there[upto])
                state, _ = self._seen(state, motion.t[part], motion.q[part], there[part])
                state, beside = self._rows(state, motion.rows(part, ()), s[part], travelled[part])
                state, _ = self.take(state, beside)
        state = self._ever_unseen(state, motion.t[told:], silent[told:], there[told:])
        state, _ = self.finish(state)
        return state, self.findings(state)


def _bends(event: Event) -> bool:
    """Whether it distorts the data of slow kinds; a missing current distorts nothing.

    What goes on has been excluded since it was reported.
    """
    if event.goes_on:
        return False
    return event.kind in BENDS and event.says.mode not in ("dropped", "erratic")


def _told_of(push: Push, events: Iterable[Event], going: bool) -> Push:
    """With what was told in a beat; smoothed signals show a push a little earlier."""
    told = [event for event in events if event.kind == "collision"]
    begin = min([push.begin, *(event.onset - BEAT for event in told)])
    return Push(going, begin, max([push.end, *(event.alarm for event in told)]))
