"""Detection of abrupt changes beside a filter, and the hypothesis that it goes on from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from urdyn.estimate import Filter
from urdyn.estimate.protocol import is_gaussian
from urdyn.model.drive import Drive
from urdyn.tracking import beliefs
from urdyn.tracking.abrupt_changes import (
    AbruptChange,
    Evidence,
    PriorScales,
    detect,
    drive_evidence,
    no_evidence,
    significant,
    wearing_drive,
)
from urdyn.tracking.health_prior import HealthPrior
from urdyn.tracking.model import BULKY, LIGHT
from urdyn.tracking.payload.belief import PayloadBelief
from urdyn.tracking.payload.handling import HANDLING, HandlingPhase, exchanged
from urdyn.tracking.payload.hypotheses import CHANGE, PayloadHypotheses
from urdyn.tracking.physical import KNOWN
from urdyn.tracking.state import TrackerState, rolled_back
from urdyn.tracking.wear_test import ASK, SURE, SURER, YOUNG, WearReference, WearTest
from urdyn.types import Array, Mask, changed

S = TypeVar("S")

PATIENCE = 2.0  # [s] after something was told before the next
LOOK, LOOK_TIME = 5.0, 0.08  # samples and, where they are many, [s] between two looks for it


@dataclass(frozen=True, eq=False)
class Detection:
    """What was detected at one sample."""

    change: AbruptChange | None  # that is assumed to have happened; None: none
    reported: bool  # a change of payload or drive is reported here
    looked: bool  # this was one of the samples at which one looks
    evidence: Evidence  # that is left


@dataclass(frozen=True, eq=False)
class Hypothesis(Generic[S]):
    """What is assumed about the arm before an instant's currents are learnt from."""

    detection: Detection
    phase: HandlingPhase
    start: TrackerState[S]  # from which it goes on: before the change, if there was one
    belief: S  # to learn from the currents with
    mean: Array  # (n,) of the states, by that and by the payload
    payload: Array  # (10,) what is carried, roughly
    load: PayloadHypotheses  # what was known of it before it was learnt anew

    @property
    def change(self) -> AbruptChange | None:
        """That is assumed to have happened; None: none."""
        return self.detection.change

    @property
    def resets(self) -> bool:
        """Whether something changed, or may have."""
        return self.change is not None or self.phase.unknown

    @property
    def changed_drives(self) -> Mask:
        """Drives that changed abruptly since commissioning, (J,)."""
        before, change = self.start.changed_drives, self.change
        return before if change is None else before | change.drives

    @property
    def another_payload(self) -> bool:
        """Whether it is reported here that something else is carried."""
        change = self.change
        return self.detection.reported and (change is None or change.payload is not None)

    @property
    def widening(self) -> Array | None:
        """What may be carried besides, sd (10,)."""
        if self.phase.light:
            return LIGHT
        return BULKY if self.detection.reported and self.change is None else None

    def unknown_since(self, t: float) -> float:
        """Since when nobody knows what is carried [s]; inf: it is known."""
        if self.phase.handles and (self.phase.sets_off or self.another_payload):
            return t
        known = self.change is not None or self.phase.shown
        return np.inf if known else self.start.rest.left


@dataclass(frozen=True, eq=False)
class ChangeDetector(Generic[S]):
    """Detects abrupt changes of payload or drive, and says what is supposed from then on."""

    filter: Filter[S]
    wear_test: WearTest  # what drives are asked
    places: Mapping[str, slice]  # of groups among the states
    drive: Drive
    tool: float  # [kg] that was carried on the first day
    period: float  # [s] between samples, as a rule
    poses: bool  # what these told of zeros in the last seconds is not forgotten for a payload

    @cached_property
    def payload_belief(self) -> PayloadBelief[S]:
        """Who tells what is carried while it is learnt anew."""
        health_prior = HealthPrior(self.wear_test.wear, self.places["z"])
        return PayloadBelief(self.filter, self.places["payload"].start, health_prior)

    @cached_property
    def _look(self) -> float:
        """Samples between two looks for an abrupt change."""
        return max(LOOK, round(LOOK_TIME / self.period))

    @cached_property
    def _ask(self) -> float:
        """Samples from one time that drives are asked whether they wore to the next."""
        return max(1.0, round(ASK / self.period))

    @cached_property
    def _sizes(self) -> PriorScales:
        """How large what may befall the arm is."""
        return PriorScales.of(self.drive)

    def hypothesis(self, state: TrackerState[S], t: float, moving: bool) -> Hypothesis[S]:
        """At t [s], while the arm moves or does not."""
        mean = beliefs.mean(self.filter, state.belief)
        phase = self._phase(state, t, moving)
        detection = self._detected(state, t, mean, phase)
        change, payload = detection.change, state.payload
        if phase.unknown and np.isfinite(state.rest.left):
            payload = self._presumed(state)
        back = change is not None or payload is not state.payload
        start = self._allowing(rolled_back(state) if back else state, state, change)
        retold = change is not None and change.known is not None
        belief = state.belief if self.poses and not retold else start.belief
        if change is not None:
            mean = beliefs.mean(self.filter, belief)
            payload = payload if change.payload is None else change.payload
        return Hypothesis(
            detection=detection,
            phase=phase,
            start=start,
            belief=belief,
            mean=mean if payload is state.payload else self.carrying(mean, payload),
            payload=payload,
            load=self._load(state, change, phase, payload),
        )

    def updated_load(self, hypothesis: Hypothesis[S], belief: S, moving: bool) -> PayloadHypotheses:
        """What was carried before, and whether another was told by now, an instant learnt."""
        load = hypothesis.load
        if load.told:
            return load
        if load.doubted:
            asked = hypothesis.detection.looked and moving
            drives = hypothesis.changed_drives
            now = changed(hypothesis.start, belief=belief, changed_drives=drives)
            sure = asked and self.payload_belief.exchanged(load, now)
        else:
            sure = hypothesis.another_payload
        return replace(load, told=True) if sure else load

    def carrying(self, mean: Array, payload: Array) -> Array:
        """The states (n,) with this payload, (10,)."""
        mean = np.array(mean)
        mean[self.places["payload"]] = payload
        return mean

    def renewed(self, state: TrackerState[S], belief: S, t: float, shown: bool) -> Array:
        """What is carried, (10,), as it is known now where it surely is something else.

        Once it is `shown`, and seldom: every time, the errors of what is known are in the
        regressors of health and gain anew.
        """
        due = shown or (state.past.due(t) and np.isinf(state.rest.left))
        return significant(state.payload, *self._payload(belief)) if due else state.payload

    def _phase(self, state: TrackerState[S], t: float, moving: bool) -> HandlingPhase:
        """Of the program, at t [s]."""
        rest, implausible = state.rest, state.implausible
        sets_off, suspected = rest.ends(moving), implausible.suspected(t)
        if sets_off:
            mean, sd = self._payload(state.belief)
            implausible = implausible.after(self.tool + float(mean[0]), float(sd[0]), t)
        return HandlingPhase(
            sets_off=sets_off,
            handles=t - state.widened < HANDLING and not suspected,
            shown=moving and rest.known(t),  # an arm that stands is asked as it sets off
            implausible=implausible,
            suspected=suspected,
        )

    def _load(
        self,
        state: TrackerState[S],
        change: AbruptChange | None,
        phase: HandlingPhase,
        payload: Array,
    ) -> PayloadHypotheses:
        """What was carried before it is learnt anew, around `payload`, if that begins here."""
        before = state.load
        if not (phase.unknown or (change is not None and change.payload is not None)):
            return before.given_up() if phase.sets_off else before
        weighed = change is not None and change.weighed
        # Evidence that comes soon after a change was told is of the same change.
        told = weighed or (before.told and not phase.sets_off and state.rest.just(state.t))
        return self.payload_belief.begun(state, payload, 0.0 if weighed else CHANGE, told)

    def _detected(
        self, state: TrackerState[S], t: float, mean: Array, phase: HandlingPhase
    ) -> Detection:
        """An abrupt change, and what evidence is left for the next."""
        looks = state.colour.sample % self._look < 1.0
        change, evidence = self._abrupt(state, t, mean) if looks else (None, state.evidence)
        if change is None and not phase.unknown:
            change = self._wore(state, t)
        reported = change is not None or (looks and self._exchanged(state, t))
        if change is None and phase.shown and not phase.unknown:
            change = self._another_load(state)
        if change is not None or phase.unknown:
            evidence = no_evidence(len(state.stuck)) if reported else drive_evidence(evidence)
        return Detection(change, reported, looks, evidence)

    def _abrupt(
        self, state: TrackerState[S], t: float, mean: Array
    ) -> tuple[AbruptChange | None, Evidence]:
        """An abrupt change by the evidence, and the evidence that is left."""
        what, evidence = detect(state.evidence, self._sizes, mean[self.places["payload"]])
        told = what.anything and t - state.changed_at > PATIENCE
        return what if told else None, evidence

    def _wore(self, state: TrackerState[S], t: float) -> AbruptChange | None:
        """A drive that wore before the run, or does, told while nothing else is in question."""
        unsettled = state.evidence.highest or t - state.changed_at < PATIENCE
        if unsettled or (state.colour.sample - self._ask // 8) % self._ask >= 1.0:
            return None  # between looks at the colour: no one sample has it all
        handling = np.isfinite(state.rest.left)
        if handling and self._payload(state.belief)[1][0] > KNOWN:
            return None
        change = self._known_to_wear(state)
        if change is not None or handling:  # pieces begin other evidence anew
            return change
        wearing = wearing_drive(state.evidence, self._sizes)
        return AbruptChange(None, wearing, wears=True) if wearing.any() else None

    def _known_to_wear(self, state: TrackerState[S]) -> AbruptChange | None:
        """A drive that wore, by what was believed a while ago and what is believed now.

        None by a filter that keeps no Gaussian: particles that are copies of one are sure of all.
        """
        if not is_gaussian(self.filter):
            return None
        reference, sure = state.past.reference, SURE
        recent, turn = state.past.recent, state.colour.sample // self._ask % 2.0
        if turn and state.moved - recent.moved > YOUNG:
            reference, sure = recent, SURER
        before, now = self.filter.belief(reference.belief), self.filter.belief(state.belief)
        blind = bool(np.isnan(state.joints.lubricant).any())
        odds = self.wear_test.compared(before, now, state.passed - reference.passed, blind)
        wore = odds.wore(sure)
        if not wore.any():
            return None
        wears = reference.moved > 0.0  # wear from before the run is not known to go on
        return AbruptChange(None, wore, wears=wears, known=odds.allowing(wore))

    def _exchanged(self, state: TrackerState[S], t: float) -> bool:
        """Whether the arm carries something else since it stood until just now."""
        since = state.rest.left if np.isfinite(state.rest.left) else t - HANDLING
        sought = state.rest.just(t) and not state.implausible.suspected(t) and state.widened < since
        return sought and exchanged(
            self._payload(state.past.rollback.belief), self._payload(state.belief)
        )

    def _another_load(self, state: TrackerState[S]) -> AbruptChange | None:
        """What is carried since a rest, once known; all else goes on with it from before.

        Nothing where it is what it was, and may not be none: all else was learnt beside that
        already, and an arm that stops before a load is weighed again knows less of it than it did.
        """
        before, now = self._payload(state.past.rollback.belief), self._payload(state.belief)
        payload = significant(state.payload, *now)
        weighed = before[1][0] < KNOWN and payload.any()
        if np.array_equal(payload, state.payload) or (weighed and not exchanged(before, now)):
            return None
        return AbruptChange(payload, np.zeros(len(state.stuck), dtype=bool), weighed=True)

    def _allowing(
        self, was: TrackerState[S], state: TrackerState[S], what: AbruptChange | None
    ) -> TrackerState[S]:
        """With beliefs, and references for tests of wear, that allow for a change of drives."""
        if what is None or not what.drives.any():
            return was

        def allowed(of: WearReference[S]) -> WearReference[S]:
            drives = what.drives.astype(np.float64)
            known = self.filter.belief(of.belief)
            may_have = self.wear_test.wear.befallen(known, drives, what.wears)
            return replace(of, belief=beliefs.replaced(self.filter, of.belief, may_have))

        belief = was.belief
        if what.known is not None:
            belief = beliefs.replaced(self.filter, state.belief, what.known)
        recent = allowed(WearReference(belief, state.passed, state.moved))
        past = replace(was.past, reference=allowed(was.past.reference), recent=recent)
        return replace(was, belief=belief, past=past)

    def _presumed(self, state: TrackerState[S]) -> Array:
        """What is taken to be carried (10,) where the arm stood again before that was known.

        The same array, where it was found to be what it was taken for.
        """
        mean, sd = self._payload(state.belief)
        if sd[0] > KNOWN:
            return np.array(state.payload)
        found = significant(state.payload, mean, sd)
        return state.payload if np.array_equal(found, state.payload) else found

    def _payload(self, belief: S) -> tuple[Array, Array]:
        """What is carried, mean and standard deviation, (10,) each."""
        return beliefs.mean_and_sd(self.filter, belief, self.places["payload"])
