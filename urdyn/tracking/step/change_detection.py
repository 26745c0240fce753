"""Detection of abrupt changes beside a filter, and the hypothesis that it continues from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic

import numpy as np

from urdyn.estimate import Filter
from urdyn.estimate.protocol import S, is_gaussian
from urdyn.model.drive import Drive
from urdyn.tracking.belief import beliefs
from urdyn.tracking.belief.model import BULKY, LIGHT
from urdyn.tracking.belief.physical import KNOWN
from urdyn.tracking.step.abrupt_changes import (
    LASTS,
    AbruptChange,
    Evidence,
    PriorScales,
    detect,
    drive_evidence,
    no_evidence,
    significant,
    wearing_drive,
)
from urdyn.tracking.step.health_prior import HealthPrior
from urdyn.tracking.step.payload_belief import PayloadBelief
from urdyn.tracking.step.payload_handling import HANDLING, HandlingPhase, exchanged
from urdyn.tracking.step.payload_hypotheses import CHANGE, PayloadHypotheses
from urdyn.tracking.step.state import TrackerState, rolled_back
from urdyn.tracking.step.wear_test import ASK, SURE, SURER, YOUNG, WearReference, WearTest
from urdyn.types import Array, Mask, changed

PATIENCE = 2.0  # [s] after one change was reported before the next may be
LOOK, LOOK_TIME = 5.0, 0.08  # samples, and at high rates [s], between two looks for a change


@dataclass(frozen=True, eq=False)
class Detection:
    """What was detected at one sample."""

    change: AbruptChange | None  # assumed to have happened; None: none
    reported: bool  # a change of payload or drive is reported at this sample
    looked: bool  # changes were looked for at this sample
    evidence: Evidence  # what is left of it


@dataclass(frozen=True, eq=False)
class Hypothesis(Generic[S]):
    """What is assumed of the arm before learning from an instant's currents."""

    detection: Detection
    phase: HandlingPhase
    start: TrackerState[S]  # state to continue from: before the change, if there was one
    belief: S  # to be updated by the currents
    mean: Array  # (n,) of the states, by that belief with the payload replaced
    payload: Array  # (10,) approximate payload
    load: PayloadHypotheses  # what was known of the load before it was learnt anew

    @property
    def change(self) -> AbruptChange | None:
        """The change assumed to have happened; None: none."""
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
        """Doubt to be added about the payload, sd (10,); None: none."""
        if self.phase.light:
            return LIGHT
        return BULKY if self.detection.reported and self.change is None else None

    def unknown_since(self, t: float) -> float:
        """Time since when the payload has been unknown [s]; inf: it is known."""
        if self.phase.handles and (self.phase.sets_off or self.another_payload):
            return t
        known = self.change is not None or self.phase.shown
        return np.inf if known else self.start.rest.left


@dataclass(frozen=True, eq=False)
class ChangeDetector(Generic[S]):
    """Detects abrupt changes of payload or drive, and says what is assumed from then on."""

    filter: Filter[S]
    wear_test: WearTest  # of drives
    places: Mapping[str, slice]  # of groups among the states
    drive: Drive
    tool: float  # [kg] carried on the first day
    period: float  # [s] between samples, as a rule
    poses: bool  # whether poses are used: what they showed of zeros survives a change of payload

    @cached_property
    def payload_belief(self) -> PayloadBelief[S]:
        """Estimates the payload while it is learnt anew."""
        health_prior = HealthPrior(self.wear_test.wear, self.places["z"])
        return PayloadBelief(self.filter, self.places["payload"].start, health_prior)

    @cached_property
    def _look(self) -> float:
        """Samples between two looks for an abrupt change."""
        return max(LOOK, round(LOOK_TIME / self.period))

    @cached_property
    def _ask(self) -> float:
        """Samples between two tests of drives for wear."""
        return max(1.0, round(ASK / self.period))

    @cached_property
    def _sizes(self) -> PriorScales:
        """How large changes of the arm may be."""
        return PriorScales.of(self.drive)

    def hypothesis(self, state: TrackerState[S], t: float, moving: bool) -> Hypothesis[S]:
        """The hypothesis at t [s]; `moving`: whether the arm moves."""
        mean = beliefs.mean(self.filter, state.belief)
        phase = self._phase(state, t, moving)
        detection = self._detected(state, t, mean, phase)
        change = detection.change
        assumed = self._presumed(state) if phase.unknown else None
        back = change is not None or assumed is not None
        start = self._allowing(rolled_back(state) if back else state, state, change)
        retold = change is not None and change.known is not None
        belief = state.belief if self.poses and not retold else start.belief
        if change is not None:
            mean = beliefs.mean(self.filter, belief)
            assumed = assumed if change.payload is None else change.payload
        payload = state.payload if assumed is None else assumed
        return Hypothesis(
            detection=detection,
            phase=phase,
            start=start,
            belief=belief,
            mean=mean if assumed is None else self.carrying(mean, assumed),
            payload=payload,
            load=self._load(state, start, change, phase, payload),
        )

    def updated_load(self, hypothesis: Hypothesis[S], belief: S, moving: bool) -> PayloadHypotheses:
        """What was carried before, and whether a change is reported, once an instant is learnt."""
        load = hypothesis.load
        if load.told:
            return load
        if load.doubted:
            # How a joint breaks loose may be any load's, as a knock may.
            off = hypothesis.start.t - hypothesis.start.rest.over
            asked = hypothesis.detection.looked and moving and off > LASTS
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
        """The payload, (10,): as estimated now where it surely is another.

        Once it is `shown`, and seldom: each time, the estimate's errors enter the regressors of
        health and gain anew.
        """
        due = shown or (state.past.due(t) and np.isinf(state.rest.left))
        return significant(state.payload, *self._payload(belief)) if due else state.payload

    def first_weighed(self, state: TrackerState[S], phase: HandlingPhase) -> bool:
        """Whether the arm sets off with a load that it knows, and did not at the rollback point.

        Rolled back to that point, it would not know that what it carries now is another.
        """
        if not phase.sets_off:
            return False
        before, now = self._payload(state.past.rollback.belief), self._payload(state.belief)
        return bool(now[1][0] < KNOWN < before[1][0])

    def _phase(self, state: TrackerState[S], t: float, moving: bool) -> HandlingPhase:
        """The phase of the program at t [s]."""
        rest, implausible = state.rest, state.implausible
        sets_off, suspected = rest.ends(moving), implausible.suspected(t)
        if sets_off:
            mean, sd = self._payload(state.belief)
            implausible = implausible.after(self.tool + float(mean[0]), float(sd[0]), t)
        return HandlingPhase(
            sets_off=sets_off,
            handles=t - state.widened < HANDLING and not suspected,
            shown=moving and rest.known(t),  # an arm that stands is judged as it sets off
            implausible=implausible,
            suspected=suspected,
        )

    def _load(
        self,
        state: TrackerState[S],
        start: TrackerState[S],
        change: AbruptChange | None,
        phase: HandlingPhase,
        payload: Array,
    ) -> PayloadHypotheses:
        """What was carried before learning anew around `payload`, if that begins here."""
        before = state.load
        if not (phase.unknown or (change is not None and change.payload is not None)):
            return before.given_up() if phase.sets_off else before
        weighed = change is not None and change.weighed
        # Evidence soon after a change was reported is of the same change.
        told = weighed or (before.told and not phase.sets_off and state.rest.just(state.t))
        # Just after a rest, the change is told against what was carried before it, if known.
        rests = change is not None and not weighed and state.rest.just(state.t)
        since = start if rests and self._payload(start.belief)[1][0] < KNOWN else state
        return self.payload_belief.begun(since, payload, 0.0 if weighed else CHANGE, told)

    def _detected(
        self, state: TrackerState[S], t: float, mean: Array, phase: HandlingPhase
    ) -> Detection:
        """An abrupt change, and the evidence left for the next."""
        looks = state.colour.sample % self._look < 1.0
        change, evidence = self._abrupt(state, t, mean) if looks else (None, state.evidence)
        if change is None and not phase.unknown:
            change = self._wore(state, t)
        exchanged = looks and self._exchanged(state, t)
        if change is None and exchanged and np.isinf(state.rest.left):
            change = self._taken_for_light(state)
        reported = change is not None or exchanged
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
        """A drive that wore before the run or wears now, while nothing else is in question."""
        unsettled = state.evidence.highest or t - state.changed_at < PATIENCE
        if unsettled or (state.colour.sample - self._ask // 8) % self._ask >= 1.0:
            return None  # between looks at the colour, so that no sample does all the work
        handling = np.isfinite(state.rest.left)
        if handling and self._payload(state.belief)[1][0] > KNOWN:
            return None
        change = self._known_to_wear(state)
        if change is not None or handling:  # handling pieces resets the other evidence
            return change
        wearing = wearing_drive(state.evidence, self._sizes)
        return AbruptChange(None, wearing, wears=True) if wearing.any() else None

    def _known_to_wear(self, state: TrackerState[S]) -> AbruptChange | None:
        """A drive that wore, by comparing an earlier belief with the one now.

        None for a filter that keeps no Gaussian: particles copied from one are overconfident.
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
        wears = reference.moved > 0.0  # wear from before the run need not go on
        return AbruptChange(None, wore, wears=wears, known=odds.allowing(wore))

    def _exchanged(self, state: TrackerState[S], t: float) -> bool:
        """Whether the arm, which stood until just now, has carried something else since."""
        since = state.rest.left if np.isfinite(state.rest.left) else t - HANDLING
        sought = state.rest.just(t) and not state.implausible.suspected(t) and state.widened < since
        return sought and exchanged(
            self._payload(state.past.rollback.belief), self._payload(state.belief)
        )

    def _taken_for_light(self, state: TrackerState[S]) -> AbruptChange:
        """Another payload since a rest, for which the belief had widened by a light piece only.

        Drives took what a light piece does not explain: they continue from before the rest.
        """
        payload = significant(state.payload, *self._payload(state.belief))
        return AbruptChange(payload, np.zeros(len(state.stuck), dtype=bool))

    def _another_load(self, state: TrackerState[S]) -> AbruptChange | None:
        """The payload carried since a rest, once known; all else continues from before the rest.

        None where it is the same and surely not 0: all else was learnt with that payload already,
        and an arm that stops before a load is weighed again knows less of it than it did.
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
        """The state whose beliefs and references for wear tests allow for a change of drives."""
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

    def _presumed(self, state: TrackerState[S]) -> Array | None:
        """The payload (10,) to assume where the arm stood again before it was known.

        None where it was known, or the estimate confirms what was assumed so far.
        """
        if np.isinf(state.rest.left):
            return None
        mean, sd = self._payload(state.belief)
        if sd[0] > KNOWN:
            return state.payload
        found = significant(state.payload, mean, sd)
        return None if np.array_equal(found, state.payload) else found

    def _payload(self, belief: S) -> tuple[Array, Array]:
        """Mean and standard deviation of the payload, (10,) each."""
        return beliefs.mean_and_sd(self.filter, belief, self.places["payload"])
