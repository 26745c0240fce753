"""Whether the bank shows a change, which, and what is known once it is found."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from urdyn.diagnose.kinds.rules import PAYLOAD_STATES
from urdyn.diagnose.kinds.suspects import Suspects
from urdyn.diagnose.slow import onsets
from urdyn.diagnose.slow.alarm import Alarm, alarm_of
from urdyn.diagnose.slow.explanation import Explanation, explanation, gathered, ratios, supposed
from urdyn.diagnose.slow.extent import Extent
from urdyn.diagnose.slow.fault import Fault, known_by
from urdyn.diagnose.slow.healthy import Healthy
from urdyn.diagnose.slow.onsets import Bank
from urdyn.diagnose.slow.recall import Recall
from urdyn.diagnose.slow.slow_state import SlowState
from urdyn.types import Array

OLDER = 1.0 / 3.0  # [-] of a shift's blocks that the time before it counts as
NEAR = 10.0  # [nats] below an alarm, within which a suspect is a rival
UNSURE = 2.0  # [sd] below which nothing is left of a change beside another finding
FAINT = 0.5  # [-] of the least size reported, below which nothing is left either
SURELY = 2.5  # [sd] below its reported size, at which later blocks retract it
LIKELY = 7.0  # [nats] beyond a healthy arm's, from which a change is no noise and no load
FRESH = 60.0  # [s] since its onset; since its alarm, while a retracted one is not repeated
BACK = 40.0  # [s] since its alarm, while a change may be retracted


@dataclass(frozen=True, eq=False)
class Judge:
    """Decides block by block which faults the evidence supports."""

    healthy: Healthy
    of: Suspects
    promised: float  # blocks to a false alarm
    shift: float  # blocks that a run counts as

    @cached_property
    def E(self) -> Array:
        """Directions of all suspects, (N, p)."""
        return self.of.directions(self.healthy.size)

    @cached_property
    def extent(self) -> Extent:
        """How far the changes found have gone."""
        return Extent(self.healthy, self.of)

    def judged(self, state: SlowState) -> SlowState:
        """State after a block; `found` are the changes that it settles, without those retracted."""
        return self._explained(self._alarmed(self._explained(state)))

    def concluded(self, state: SlowState) -> SlowState:
        """At the end of a recording: an alarm that waits for a clearer name keeps the one it has.

        Given all blocks, its change may have been retracted since.
        """
        if not (state.waited and len(state.bank.onset)):
            return state
        return self._explained(self._alarmed(state, last=True))

    def _alarmed(self, state: SlowState, last: bool = False) -> SlowState:
        """Accept an alarm, if there is one whose name is clear or has waited long enough."""
        ratio = ratios(state.bank, self.of)
        state = replace(state, likely=self._likely(state.bank, gathered(state.bank, ratio)))
        candidates, evidence = self._candidates(state, ratio)
        if not candidates:
            return replace(state, waited=0)
        state, alarm = replace(state, waited=state.waited + 1), alarm_of(candidates, evidence)
        ripe = alarm.ripe_at_the_end if last else alarm.ripe
        return self._accepted(state, alarm, last) if ripe(state.bank, state.waited) else state

    def _candidates(self, state: SlowState, ratio: Array) -> tuple[dict[int, Explanation], Array]:
        """Suspects that an alarm may be of, and each one's explanation; {}: no alarm.

        Args:
            ratio: each suspect's `ratios`, (h, m).

        Returns:
            also the evidence of each suspect, (h,) [nats].
        """
        asked, evidence = self._asked(state), gathered(state.bank, ratio, OLDER * self.shift)
        # A healthy arm's sums begin at what earlier time counts as, and grow by one per block.
        enough = np.log((1.0 + OLDER) * self.promised * len(asked))
        if logsumexp(evidence[asked]) < enough:
            return {}, evidence
        near = [k for k in asked if evidence[k] > enough - NEAR]
        each = {k: explanation(state.bank, self.of.each[k]) for k in near}
        told = {k: e for k, e in each.items() if e.large and not _shadow(e, each.values())}
        clear = told and not logsumexp(evidence[list(told)]) < enough
        return told if clear else {}, evidence

    def _asked(self, state: SlowState) -> list[int]:
        """Suspects that are not known faults, nor part of one, nor just retracted."""
        fresh = (f for f in state.passed if state.bank.t - f.alarm < FRESH)
        told = {fault.suspect for fault in (*state.known, *fresh)}
        return [k for k in range(len(self.of.each)) if k not in told and not self._within(state, k)]

    def shares(self, state: SlowState, recall: Recall) -> tuple[float, ...]:
        """Each suspect's share in the evidence of these blocks, (h,) [-].

        Empty where they are the blocks that the bank has seen anyway.
        """
        if recall.blocks == state.recall.blocks:
            return ()
        bank = recall.again(state.arm(self.healthy), self.E)
        evidence = gathered(bank, ratios(bank, self.of))
        evidence[list(state.suspects)] = -np.inf
        return tuple(np.exp(evidence - logsumexp(evidence)).tolist())

    def _likely(self, bank: Bank, evidence: Array) -> int | None:
        """The likeliest change that has just happened; None where none did.

        What has long been slightly wrong may as well be the model.
        """
        best = int(np.argmax(evidence))
        # The evidence of a healthy arm is about the number of onsets.
        if evidence[best] - np.log(bank.weight.sum()) < LIKELY:
            return None
        fresh = bank.t - explanation(bank, self.of.each[best]).onset < FRESH
        return best if fresh else None

    def _accepted(self, state: SlowState, alarm: Alarm, last: bool) -> SlowState:
        """With the change of an alarm, and any others beside it."""
        suspect = alarm.told.suspect
        if suspect.kind.of_tool:
            return self._loaded(state, alarm)
        change = alarm.change()
        change = replace(change, pause=state.recall.pause(*change.began))
        if any(self._ends(state, alarm, fault) for fault in state.passed):
            return replace(state, passed=_latest(state.passed, (known_by(change),)), waited=0)
        rest = tuple(f for f in state.known if not self.of.each[f.suspect].part_of(suspect))
        after = replace(state, found=(*state.found, change), known=rest, waited=0)
        fault = self.extent.with_before(after, known_by(change))
        after = self.knowing(after, (*rest, fault))
        again = any(f.suspect == alarm.suspect for f in state.passed)
        if again and self._nothing(after, fault):  # it is still what was retracted
            return replace(state, passed=_latest(state.passed, (fault,)), waited=0)
        return self._alarmed(after, last)

    def _loaded(self, state: SlowState, alarm: Alarm) -> SlowState:
        """With a change of the payload."""
        # An arm tracked as healthy has absorbed only a part of it by then.
        more = supposed(state.bank, alarm.told.suspect, self.E).x[self.healthy.space.payload]
        inertials = (state.carrying.modes[0].mean + more)[: len(PAYLOAD_STATES)]
        found = (*state.found, alarm.change(tuple(inertials.tolist())))
        return self._settled_on(replace(state, found=found, waited=0), more)

    def _within(self, state: SlowState, k: int) -> bool:
        """Whether a known fault has changed all that this suspect would, and more."""
        return any(self.of.each[k].part_of(self.of.each[f.suspect]) for f in state.known)

    def knowing(self, state: SlowState, known: tuple[Fault, ...]) -> SlowState:
        """With these suspects found, and the bank recomputed given them."""
        state = replace(state, known=known)
        return replace(state, bank=state.recall.again(state.arm(self.healthy), self.E))

    def _explained(self, state: SlowState) -> SlowState:
        """Without findings that other findings or later blocks show to be no faults."""
        known = state.known
        # A change of which others leave nothing was their shadow; but one of them is real.
        left = tuple(f for f in known if not self._nothing(state, f)) or known
        back = tuple(f for f in left if self._taken_back(state, f))
        left = tuple(f for f in left if f not in back)
        state = replace(state, passed=_latest(state.passed, back))
        return state if left == known else self.knowing(state, left)

    def _nothing(self, state: SlowState, fault: Fault) -> bool:
        """Whether a found change may by now as well be none, or of another kind.

        One well below the least size reported counts as none, too.
        """
        (size, sd), suspect = self._now(state, fault), self.of.each[fault.suspect]
        return size < max(UNSURE * sd, FAINT * suspect.kind.least * suspect.unit)

    def _taken_back(self, state: SlowState, fault: Fault) -> bool:
        """Whether so little is left so soon that it was none, and surely not the reported size.

        An unknown piece in the tool looks like friction for a block. A change that has lasted was
        real, wherever it went.
        """
        size, sd = self._now(state, fault)
        soon = state.bank.t - fault.alarm < BACK
        return soon and self._nothing(state, fault) and size + SURELY * sd < abs(fault.size)

    def _ends(self, state: SlowState, alarm: Alarm, fault: Fault) -> bool:
        """Whether an alarm is but the end of a change of its joint that was just retracted.

        The bank took what was there until then for healthy. It is, where nothing of the change is
        left by now, and nothing of the alarm once the change is known.
        """
        told, joint = alarm.told, self.of.each[fault.suspect].joint
        fresh = told.t - fault.alarm < FRESH  # what comes later, or stays, is told
        if joint != told.suspect.joint or told.onset < fault.alarm or not fresh:
            return False
        after = self.knowing(state, (*state.known, fault))
        candidates, _ = self._candidates(after, ratios(after.bank, self.of))
        return alarm.suspect not in candidates and self._nothing(after, fault)

    def _now(self, state: SlowState, fault: Fault) -> tuple[float, float]:
        """Size of a change as it is told, positive in its kind's direction, and its sd."""
        _, size, sd = self.extent.level(state, fault)
        sign = self.of.each[fault.suspect].kind.sign
        return sign * size if sign else abs(size), sd

    def _settled_on(self, state: SlowState, more: Array) -> SlowState:
        """Take the present load as the usual one; keep all other beliefs."""
        first, *others = state.carrying.modes
        modes = (replace(first, mean=first.mean + more), *others)
        return self.afresh(replace(state, carrying=replace(state.carrying, modes=modes)))

    def afresh(self, state: SlowState) -> SlowState:
        """Look for changes from here on, given the present load."""
        t, (x, P) = state.bank.t, self.healthy.emptied(state.bank.x, state.bank.P)
        bank = onsets.first(x, P, self.E.shape[1], t, state.bank.middle)
        recall = Recall(t, x, P)
        return replace(state, bank=bank, recall=recall, before=(bank, recall))

    def without(self, state: SlowState, over: Collection[int]) -> SlowState:
        """Without known changes of these suspects, which are over: they may change anew."""
        known = tuple(fault for fault in state.known if fault.suspect not in over)
        carrying = replace(state.carrying, unclaimed=())  # kept by what was known
        return self.afresh(replace(state, known=known, carrying=carrying, waited=0))

    def relieved(self, state: SlowState, more: Array, since: float, until: float) -> SlowState:
        """Look for changes of a new load from here on; of joints as before.

        Args:
            more: inertials by which it differs, (10,).
            since, until: when it was carried [s].
        """
        payload = self.healthy.space.payload
        off = np.zeros(self.healthy.size)
        off[payload] = more
        x, P = self.healthy.emptied(state.bank.x, state.bank.P)
        of_load = np.flatnonzero(np.isin(self.of.states, payload))
        bank = onsets.relieved(replace(state.bank, x=x, P=P), payload, of_load)
        recall = state.recall.bearing(off, since, until)
        gathering = state.gathering.usually(off[: self.healthy.space.size])
        return replace(state, bank=bank, gathering=gathering, recall=recall, before=(bank, recall))

    def supposed(self, state: SlowState) -> Bank:
        """The bank with its arm changed by the likeliest change."""
        if state.likely is None or not len(state.bank.onset):
            return state.bank
        return supposed(state.bank, self.of.each[state.likely], self.E)


def _latest(faults: Iterable[Fault], more: Iterable[Fault]) -> tuple[Fault, ...]:
    """The latest fault of each suspect."""
    return tuple({fault.suspect: fault for fault in (*faults, *more)}.values())


def _shadow(one: Explanation, told: Iterable[Explanation]) -> bool:
    """Whether a change of the same joint that is too small to report explains more than this."""
    return any(
        other.evidence > one.evidence and not other.large
        for other in told
        if other.suspect.joint == one.suspect.joint
    )
