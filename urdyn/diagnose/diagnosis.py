"""From moments of work to findings: fast kinds every beat, slow kinds every moment.

    diagnosis = Diagnosis(fit, period)
    state = diagnosis.init()
    state, findings = diagnosis.step(state, now)     # findings that are new or changed

The commissioned model is held: what is judged never bends to what it is judged by.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from urdyn.diagnose import ledger
from urdyn.diagnose.carrying import MOMENT
from urdyn.diagnose.change import Push
from urdyn.diagnose.encoder import Unseen, all_seen, ever_unseen, seen, unseen, well
from urdyn.diagnose.event import Event
from urdyn.diagnose.explain import Suspect
from urdyn.diagnose.fast import Fast, FastState
from urdyn.diagnose.finding import Finding
from urdyn.diagnose.observability import MOVED
from urdyn.diagnose.onsets import PAUSE
from urdyn.diagnose.recall import Level
from urdyn.diagnose.recurring import unjolted
from urdyn.diagnose.rows import Rows, joined, rows
from urdyn.diagnose.rules import Rules, read_rules
from urdyn.diagnose.sensor import BELIEVED
from urdyn.diagnose.slow import Slow
from urdyn.diagnose.slow_state import SlowState
from urdyn.diagnose.space import Space, space
from urdyn.diagnose.verdict import apart, identity, of_change, risen, up_to_date
from urdyn.diagnose.warmth import Warmth, felt, unfelt
from urdyn.diagnose.zero import jumps
from urdyn.identify.fit import Fit
from urdyn.signal import Instant
from urdyn.signal.stretches import GAP
from urdyn.types import Array, Mask, Motion

CHUNK = 10  # rows that are compared with the model at once
BEAT = 0.25  # [s]
# Fast kinds that bend what slow ones are judged by.
BENDS = ("sensor_fault", "joint_backlash", "controller_instability")
JUMPS = "encoder_offset"  # a slow kind that is a fast one where it comes at once
SERIES = 400  # blocks of a found change that are remembered


@dataclass(frozen=True, eq=False)
class Now:
    """One instant as a tracker has it."""

    instant: Instant
    s: Array  # (J,) presliding state [-]
    travelled: Array  # (J,) [rad] since the bristles were unknown


@dataclass(frozen=True, eq=False)
class State:
    """All that is remembered from instant to instant."""

    fast: FastState
    slow: SlowState
    warmth: Warmth
    off: Array  # (J,) [rad] by which encoders are off that were told to have jumped
    unseen: Unseen
    chunk: tuple[Now, ...] = ()
    beat: tuple[Rows, ...] = ()
    moment: tuple[Rows, ...] = ()
    findings: tuple[Finding, ...] = ()
    series: tuple[tuple[int, tuple[Level, ...]], ...] = ()  # of slow ones, by suspect
    push: tuple[float, float] = (np.inf, -np.inf)  # [s] begin and end of the last one
    blocks: float = np.nan  # [s] end of the last block that was looked at
    last: float = -np.inf  # [s] stamp of the last instant
    ahead: float = 0.0  # [s] of the robot's clock, which was set back


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Diagnosis of a commissioned arm: fast tests every beat, slow ones every moment."""

    fit: Fit
    period: float  # [s] between rows
    rules: Rules = field(default_factory=read_rules)

    @cached_property
    def space(self) -> Space:
        """Where everything that can change has a direction."""
        return space(self.fit)

    @cached_property
    def fast(self) -> Fast:
        """Tests of fast kinds."""
        levels = {**self.rules.fast, JUMPS: self.rules.levels(JUMPS)}
        return Fast(self.space, self.period, levels)

    @cached_property
    def slow(self) -> Slow:
        """Tests of slow kinds."""
        return Slow(self.space, self.period, self.rules)

    def init(self) -> State:
        """Before the first instant."""
        J = self.space.joints
        return State(self.fast.init(), self.slow.init(), unfelt(J), np.zeros(J), all_seen(J))

    def step(self, state: State, now: Now) -> tuple[State, list[Finding]]:
        """One instant on; findings that are new, or worse than they were.

        Where a clock is set back nobody knows how long that took: it goes on as after a pause.
        """
        ahead, silent = state.ahead, np.isnan(now.instant.q)
        if np.count_nonzero(silent):
            return self._unseen(state, now.instant.t + ahead, silent)
        if now.instant.t + ahead <= state.last:
            ahead = state.last + PAUSE + self.period - now.instant.t
        t, found = now.instant.t + ahead, list[Finding]()
        if state.chunk and t - state.last > self._gap:
            state, found = self._chunk(state)
        now = replace(now, instant=replace(now.instant, t=t))
        chunk = (*state.chunk, now)
        state = replace(state, ahead=ahead, chunk=chunk)
        state, more = self._seen(state, t, now.instant.q[None])
        if len(state.chunk) < self._chunk_rows:
            return state, found + more
        state, late = self._chunk(state)
        return state, found + more + late

    def _seen(self, state: State, t: float, q: Array) -> tuple[State, list[Finding]]:
        """After instants up to `t` [s] whose angles are known, (N, J) [rad]: who is well again?"""
        unseen, events = well(seen(state.unseen, q), t)
        state = replace(state, last=t, unseen=unseen)
        return self._told(state, events) if events else (state, [])

    def _unseen(self, state: State, t: float, silent: Mask) -> tuple[State, list[Finding]]:
        """With an instant at which the angles of some joints are not known, (J,)."""
        unknown, events = unseen(state.unseen, t, silent, self.rules.fast["sensor_silent"])
        return self._blind(replace(state, unseen=unknown), events)

    def _ever_unseen(self, state: State, t: Array, silent: Mask) -> State:
        """With many such instants, (N,) [s] and (N, J)."""
        if not silent.any():
            return state
        unknown, events = ever_unseen(state.unseen, t, silent, self.rules.fast["sensor_silent"])
        return self._blind(replace(state, unseen=unknown), events)[0]

    def _blind(self, state: State, events: list[Event]) -> tuple[State, list[Finding]]:
        """Without what waits, where an encoder was found to be none; the last beat was its, too."""
        if not events:
            return state, []
        slow = self.slow.unsaid(state.slow, min(event.onset for event in events) - BEAT)
        return self._told(replace(state, slow=slow, chunk=(), beat=(), moment=()), events)

    @property
    def _gap(self) -> float:
        """Between stamps after which a beat and a moment end early, at least [s]."""
        return GAP * self.period

    @cached_property
    def _beat_rows(self) -> int:
        return max(1, round(BEAT / self.period))

    @cached_property
    def _chunk_rows(self) -> int:
        """Rows of which a few make a beat, and no more than that."""
        return -(-self._beat_rows // -(-self._beat_rows // CHUNK))

    def _lasted(self, first: float, last: float, length: float) -> bool:
        """Whether what began and ended with these rows is that long [s]; half a row a beat less."""
        slack = 0.51 * self.period * round(length / BEAT)  # and what stamps are rounded by
        return bool(last - first + self.period >= length - slack)

    def _chunk(self, state: State) -> tuple[State, list[Finding]]:
        """The instants that were kept, beside the commissioned model."""
        state, part = self._rows(replace(state, chunk=()), *_motion(state.chunk))
        return self.take(state, part)

    def _rows(self, state: State, motion: Motion, s: Array, travelled: Array) -> tuple[State, Rows]:
        """A motion beside the model, as it was: without the jumps of encoders that are told."""
        warmth = felt(state.warmth, motion.t, motion.temperature)
        off = state.off + np.cumsum(jumps(motion.shift, self.fast.levels[JUMPS]), axis=0)
        if np.count_nonzero(off):
            motion = replace(motion, q=motion.q - off)
        state = replace(state, warmth=warmth, off=off[-1])
        return state, rows(self.space, motion, s, travelled, warmth)

    def take(self, state: State, part: Rows) -> tuple[State, list[Finding]]:
        """Some rows on, no longer than a beat and without a gap."""
        found: list[Finding] = []
        before = (*state.moment, *state.beat)
        if before and part.t[0] - before[-1].t[-1] > self._gap:
            state, found = self._broken(state)
        state = replace(state, beat=(*state.beat, part))
        if self._lasted(state.beat[0].t[0], part.t[-1], BEAT):
            state, more = self._beat(state)
            found += more
        return state, found

    def _broken(self, state: State) -> tuple[State, list[Finding]]:
        """A beat and a moment that a gap has ended."""
        state, found = self._beat(state) if state.beat else (state, [])
        if not state.moment:
            return state, found
        state, more = self._moment(state)
        return state, found + more

    def finish(self, state: State) -> tuple[State, list[Finding]]:
        """What waits, at the end of a recording."""
        found: list[Finding] = []
        if state.chunk:
            state, found = self._chunk(state)
        if state.beat:
            state, more = self._beat(state)
            found += more
        state, more = self._tells_again(state)
        found += more
        state, more = self._changes(
            replace(state, slow=self.slow.concluded(state.slow, state.fast.quiet.going))
        )
        return state, found + more

    def _tells_again(self, state: State) -> tuple[State, list[Finding]]:
        """With sensors that were ill, and at the end have told for long enough to be believed."""
        if np.isinf(state.last):
            return state, []
        sensors, currents = self.fast.sensors.well(state.fast.sensors, state.last, BELIEVED)
        unseen, angles = well(state.unseen, state.last, BELIEVED)
        state = replace(state, unseen=unseen, fast=replace(state.fast, sensors=sensors))
        return self._told(state, [*currents, *angles])

    def _beat(self, state: State) -> tuple[State, list[Finding]]:
        beat = joined(state.beat)
        carrying = state.slow.carrying
        order = [carrying.now, *(k for k in range(len(carrying.modes)) if k != carrying.now)]
        carried = np.array([carrying.modes[k].mean for k in order])
        fast, events, untrue = self.fast.step(state.fast, beat, carried)
        believed = replace(beat, settled=beat.settled & ~untrue)
        state = replace(state, fast=fast, beat=(), moment=(*state.moment, believed))
        if sick := [event.onset for event in events if _bends(event)]:
            slow = self.slow.unsaid(state.slow, min(sick))
            state = replace(state, slow=slow, moment=(believed,))
        state, found = self._told(replace(state, push=_last(events, state.push)), events)
        state = self._unjolted(state)
        first, last = state.moment[0].t[0], state.moment[-1].t[-1]
        if not self._lasted(first, last, MOMENT):
            return state, found
        state, more = self._moment(state)
        return state, found + more

    def _moment(self, state: State) -> tuple[State, list[Finding]]:
        """A moment that is over."""
        push = Push(state.fast.quiet.going, *state.push)
        slow = self.slow.moment(state.slow, joined(state.moment), push)
        return self._changes(replace(state, slow=slow, moment=()))

    def _told(self, state: State, events: Iterable[Event]) -> tuple[State, list[Finding]]:
        """Events as findings; one that only goes on is told again where it is graver by now."""
        before = after = state.findings
        told = set[str]()
        for event in events:  # one by one: a zero may jump there and back within a beat
            finding = ledger.finding_of(event, after, self.space, self.rules)
            after, _ = ledger.entered(after, [finding])
            told.add(finding.id)
        found = [finding for finding in after if finding.id in told]
        return replace(state, findings=after), ledger.to_be_told(before, found)

    def _unjolted(self, state: State) -> State:
        """Without pushes that are a joint's play."""
        seen, coulomb = state.fast.reversals.recurred, self.space.reference.drive.coulomb
        return replace(state, findings=unjolted(state.findings, seen, coulomb))

    def _changes(self, state: State) -> tuple[State, list[Finding]]:
        """New changes, and how those that are known went on."""
        state = self._withdrawn(state)
        slow, series, new = state.slow, dict(state.series), []
        for change in slow.found:
            suspect = self.slow.of.each[change.suspect]
            if not suspect.kind.of_tool and change.suspect not in slow.suspects:
                continue
            trace = [] if suspect.kind.of_tool else self.slow.judge.trace(slow, change.suspect)
            series[change.suspect] = tuple(trace)
            new.append(of_change(change, self.slow.of, self.space, self.rules, trace))
        findings, found = ledger.entered(state.findings, new)
        state = replace(state, series=tuple(series.items()), findings=findings)
        if slow.bank.t == state.blocks or np.isnan(slow.bank.t):
            return state, found
        for k, level in self.slow.judge.levels(slow).items():
            had = series.get(k, ())
            if not had or level[0] > had[-1][0]:  # a trace has the last block
                series[k] = (*had, level)[-SERIES:]
        state = replace(state, series=tuple(series.items()), blocks=slow.bank.t)
        grown = risen(state.findings, self.findings(state))
        findings, more = ledger.entered(state.findings, grown)
        return replace(state, findings=findings), found + more

    def _withdrawn(self, state: State) -> State:
        """Without findings of which nothing is left since another one explains them."""
        of = self.slow.of.each
        gone = {
            k for k, _ in state.series if not of[k].kind.of_tool and k not in state.slow.suspects
        }
        if not gone:
            return state
        ids = {identity(of[k], self.space) for k in gone}
        series = tuple(pair for pair in state.series if pair[0] not in gone)
        kept = tuple(f for f in state.findings if f.id not in ids)
        return replace(state, series=series, findings=kept)

    def _known(self, state: State) -> dict[int, Suspect]:
        """Slow suspects that are found."""
        return {k: self.slow.of.each[k] for k in state.slow.suspects}

    def findings(self, state: State) -> list[Finding]:
        """All that was found, as it is now; `state.findings` is as it was last told."""
        known, series = self._known(state), dict(state.series)
        told = up_to_date(state.findings, known, series, self.space, state.blocks)
        return apart(told, known, self.slow.judge.terms(state.slow), self.space)

    def observable(self, state: State) -> list[dict[str, Any]]:
        """Joint by joint, whether this motion could show backlash; if not, one that would."""
        return self.fast.observable(state.fast)

    def judged(self, state: State) -> list[bool]:
        """Joint by joint, whether it has moved for long enough to be told well from ill.

        Nothing is before there was a block of what was compared.
        """
        moved = state.fast.reversals.slid > MOVED
        return [bool(enough) for enough in moved & np.isfinite(state.blocks)]

    def over(self, motion: Motion, s: Array, travelled: Array) -> tuple[State, list[Finding]]:
        """A whole motion at once: the same beats as instant by instant, but for their seams."""
        state, silent, told = self.init(), np.isnan(motion.q), 0
        known = np.flatnonzero(np.isfinite(motion.q + motion.v + motion.a).all(axis=1))
        apart = np.diff(motion.t[known]) > self._gap
        for stretch in np.split(known, np.flatnonzero(apart) + 1):
            for at in range(0, len(stretch), self._beat_rows):
                part = stretch[at : at + self._beat_rows]
                upto = slice(told, told := int(part[-1]) + 1)
                state = self._ever_unseen(state, motion.t[upto], silent[upto])
                state, _ = self._seen(state, float(motion.t[part[-1]]), motion.q[part])
                state, beside = self._rows(state, motion.rows(part, ()), s[part], travelled[part])
                state, _ = self.take(state, beside)
        state = self._ever_unseen(state, motion.t[told:], silent[told:])
        state, _ = self.finish(state)
        return state, self.findings(state)


def _motion(chunk: tuple[Now, ...]) -> tuple[Motion, Array, Array]:
    """Instants as a motion, with presliding states and ways."""
    one = [now.instant for now in chunk]
    motion = Motion(
        t=np.array([i.t for i in one]),
        q=np.array([i.q for i in one]),
        v=np.array([i.v for i in one]),
        a=np.array([i.a for i in one]),
        jerk=np.array([i.jerk for i in one]),
        current=np.array([i.current for i in one]),
        temperature=np.array([i.temperature for i in one]),
        shift=np.array([i.shift for i in one]),
        instrument=np.array([i.instrumental for i in one]),
    )
    return motion, np.array([n.s for n in chunk]), np.array([n.travelled for n in chunk])


def _bends(event: Event) -> bool:
    """Whether it bends what slow kinds are judged by; a current that is not there bends nothing.

    What goes on is not believed since it was told.
    """
    if event.goes_on:
        return False
    return event.kind in BENDS and event.evidence.get("mode") not in ("dropped", "erratic")


def _last(events: Iterable[Event], before: tuple[float, float]) -> tuple[float, float]:
    """When the last push was; what is smoothed feels it a little earlier."""
    pushes = [(e.onset - BEAT, e.alarm) for e in events if e.kind == "collision"]
    return pushes[-1] if pushes else before
