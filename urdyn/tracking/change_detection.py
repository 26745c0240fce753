"""What befell an arm, noticed beside its filter; and what is supposed of it from then on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from urdyn.estimate import Filter
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
from urdyn.tracking.payload.handling import HANDLING, Weighed, exchanged
from urdyn.tracking.payload.hypotheses import CHANGE, PayloadHypotheses
from urdyn.tracking.physical import KNOWN
from urdyn.tracking.state import ROLLBACK, TrackerState, rolled_back
from urdyn.tracking.wear_test import ASK, SURE, SURER, YOUNG, PastBelief, WearTest
from urdyn.types import Array, Mask, changed

S = TypeVar("S")

PATIENCE = 2.0  # [s] after something was told before the next
LOOK, LOOK_TIME = 5.0, 0.08  # samples and, where they are many, [s] between two looks for it


@dataclass(frozen=True, eq=False)
class Hypothesis(Generic[S]):
    """What is supposed of an arm before an instant's currents are learnt from."""

    what: AbruptChange | None  # abrupt change that is assumed to have happened; None: none
    another: bool  # a change is reported at this sample
    stood: bool  # the arm sets off here: a gripper may have opened or closed
    weighed: Weighed  # holds up to here
    light: bool  # a piece too light for evidence may be carried
    handles: bool  # pieces have come or gone within HANDLING
    shown: bool  # the arm has moved so long that what it carries is known
    looked: bool  # this was one of the samples at which one looks
    evidence: Evidence  # that is left
    was: TrackerState[S]  # before whatever befell the arm
    before: S  # belief to learn from the currents with
    mean: Array  # (n,) of the states, by that and by what is carried
    carried: Array  # (10,) roughly
    held: PayloadHypotheses  # what was known of it before it was learnt anew

    @property
    def anew(self) -> bool:
        """Something befell the arm."""
        return self.what is not None

    @property
    def fresh(self) -> bool:
        """Something did, or may have."""
        return self.anew or (self.stood and self.handles)

    @property
    def changed_drives(self) -> Mask:
        """Drives that something befell since commissioning, (J,)."""
        before = self.was.changed_drives
        return before if self.what is None else before | self.what.drives

    @property
    def widens(self) -> bool:
        """Something else is carried."""
        return self.another and (self.what is None or self.what.payload is not None)

    @property
    def taken(self) -> Array | None:
        """What may be carried besides, sd (10,)."""
        return LIGHT if self.light else BULKY if self.another and not self.anew else None

    def unknown_since(self, t: float) -> float:
        """Since when nobody knows what is carried [s]; inf: it is known."""
        if self.handles and (self.stood or self.widens):
            return t
        return np.inf if self.anew or self.shown else self.was.rest.left


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
        """Samples from one look for what befell the arm to the next."""
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
        mean, rest = beliefs.mean(self.filter, state.belief), state.rest
        looks = state.colour.count % self._look < 1.0
        stood, doubted = rest.ends(moving), state.weighed.doubted(t)
        handles = t - state.widened < HANDLING and not doubted
        weighed = self._weighed(state, t) if stood else state.weighed
        doubtful = stood and handles
        shown = moving and rest.known(t)  # an arm that stands is asked as it sets off
        what, evidence, another = self._found(state, t, mean, looks, doubtful, shown)
        anew = what is not None
        if anew or doubtful:
            evidence = no_evidence(len(state.v)) if another else drive_evidence(evidence)
        thought = self._thought(state) if doubtful and np.isfinite(rest.left) else state.carried
        was = rolled_back(state) if anew or thought is not state.carried else state
        was = self._allowing(was, state, what)
        retold = what is not None and what.known is not None
        before = state.belief if self.poses and not retold else was.belief
        carried = thought if what is None or what.payload is None else what.payload
        held = self._held(state, what, stood, doubtful, carried)
        mean = beliefs.mean(self.filter, before) if anew else mean
        mean = mean if carried is state.carried else self.carrying(mean, carried)
        return Hypothesis(
            what=what,
            another=another,
            stood=stood,
            weighed=weighed,
            light=stood and not doubted,
            handles=handles,
            shown=shown,
            looked=looks,
            evidence=evidence,
            was=was,
            before=before,
            mean=mean,
            carried=carried,
            held=held,
        )

    def told(self, hypothesis: Hypothesis[S], belief: S, moving: bool) -> PayloadHypotheses:
        """What was carried before, and whether another was told by now, an instant learnt."""
        held = hypothesis.held
        if held.told:
            return held
        if held.doubted:
            asked = hypothesis.looked and moving
            now = changed(hypothesis.was, belief=belief, changed_drives=hypothesis.changed_drives)
            sure = asked and self.payload_belief.exchanged(held, now)
        else:
            sure = hypothesis.widens
        return replace(held, told=True) if sure else held

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
        due = shown or (t - state.rollback_marked >= ROLLBACK and np.isinf(state.rest.left))
        return significant(state.carried, *self._payload(belief)) if due else state.carried

    def _held(
        self,
        state: TrackerState[S],
        what: AbruptChange | None,
        stood: bool,
        doubtful: bool,
        carried: Array,
    ) -> PayloadHypotheses:
        """What was carried before it is learnt anew, around `carried`, if that begins here."""
        anew, was = what is not None and what.payload is not None, state.load
        if not (anew or doubtful):
            return was.given_up() if stood else was
        weighed = what is not None and what.weighed
        # Evidence that comes soon after a change was told is of the same change.
        told = weighed or (was.told and not stood and state.rest.just(state.t))
        change = 0.0 if weighed else CHANGE
        return self.payload_belief.begun(state, carried, change, told)

    def _found(
        self,
        state: TrackerState[S],
        t: float,
        mean: Array,
        looks: bool,
        doubtful: bool,
        shown: bool,
    ) -> tuple[AbruptChange | None, Evidence, bool]:
        """What befell the arm, the evidence that is left, and whether a change is reported now."""
        what, evidence = self._abrupt(state, t, mean) if looks else (None, state.evidence)
        if what is None and not doubtful:
            what = self._wore(state, t)
        if what is not None:
            return what, evidence, True
        another = looks and self._exchanged(state, t)
        load = self._another_load(state) if shown and not doubtful else None
        return load, evidence, another

    def _abrupt(
        self, state: TrackerState[S], t: float, mean: Array
    ) -> tuple[AbruptChange | None, Evidence]:
        """What the evidence says befell the arm, and the evidence that is left."""
        what, evidence = detect(state.evidence, self._sizes, mean[self.places["payload"]])
        told = what.anything and t - state.changed_at > PATIENCE
        return what if told else None, evidence

    def _wore(self, state: TrackerState[S], t: float) -> AbruptChange | None:
        """A drive that wore before the run, or does, told while nothing else is in question."""
        unsettled = state.evidence.highest or t - state.changed_at < PATIENCE
        if unsettled or (state.colour.count - self._ask // 8) % self._ask >= 1.0:
            return None  # between looks at the colour: no one sample has it all
        handling = np.isfinite(state.rest.left)
        if handling and self._payload(state.belief)[1][0] > KNOWN:
            return None
        reference, sure = state.wear_reference, SURE
        recent, turn = state.recent_reference, state.colour.count // self._ask % 2.0
        if turn and state.moved - recent.moved > YOUNG:
            reference, sure = recent, SURER
        before, now = self.filter.belief(reference.belief), self.filter.belief(state.belief)
        blind = bool(np.isnan(state.lubricant).any())
        odds = self.wear_test.compared(before, now, state.passed - reference.passed, blind)
        wore = odds.wore(sure)
        if wore.any():  # what befell a drive before the run is not known to go on
            wears = reference.moved > 0.0
            return AbruptChange(None, wore, wears=wears, known=odds.allowing(wore))
        if handling:  # pieces begin that evidence anew
            return None
        wearing = wearing_drive(state.evidence, self._sizes)
        return AbruptChange(None, wearing, wears=True) if wearing.any() else None

    def _exchanged(self, state: TrackerState[S], t: float) -> bool:
        """Whether the arm carries something else since it stood until just now."""
        since = state.rest.left if np.isfinite(state.rest.left) else t - HANDLING
        sought = state.rest.just(t) and not state.weighed.doubted(t) and state.widened < since
        return sought and exchanged(
            self._payload(state.rollback.belief), self._payload(state.belief)
        )

    def _another_load(self, state: TrackerState[S]) -> AbruptChange | None:
        """What is carried since a rest, once known; all else goes on with it from before.

        Nothing where it is what it was, and may not be none: all else was learnt beside that
        already, and an arm that stops before a load is weighed again knows less of it than it did.
        """
        before, now = self._payload(state.rollback.belief), self._payload(state.belief)
        payload = significant(state.carried, *now)
        weighed = before[1][0] < KNOWN and payload.any()
        if np.array_equal(payload, state.carried) or (weighed and not exchanged(before, now)):
            return None
        return AbruptChange(payload, np.zeros(len(state.v), dtype=bool), weighed=True)

    def _allowing(
        self, was: TrackerState[S], state: TrackerState[S], what: AbruptChange | None
    ) -> TrackerState[S]:
        """With beliefs, and those that drives will be asked of, of who knew what befell these."""
        if what is None or not what.drives.any():
            return was

        def allowed(of: PastBelief[S]) -> PastBelief[S]:
            drives = what.drives.astype(np.float64)
            known = self.filter.belief(of.belief)
            may_have = self.wear_test.wear.befallen(known, drives, what.wears)
            return replace(of, belief=beliefs.replaced(self.filter, of.belief, may_have))

        belief = was.belief
        if what.known is not None:
            belief = beliefs.replaced(self.filter, state.belief, what.known)
        return replace(
            was,
            belief=belief,
            wear_reference=allowed(was.wear_reference),
            recent_reference=allowed(PastBelief(belief, state.passed, state.moved)),
        )

    def _thought(self, state: TrackerState[S]) -> Array:
        """What is taken to be carried (10,) where the arm stood again before that was known.

        The same array, where it was found to be what it was taken for.
        """
        mean, sd = self._payload(state.belief)
        if sd[0] > KNOWN:
            return np.array(state.carried)
        found = significant(state.carried, mean, sd)
        return state.carried if np.array_equal(found, state.carried) else found

    def _weighed(self, state: TrackerState[S], t: float) -> Weighed:
        """Holds up to a rest that is over at t [s]."""
        mean, sd = self._payload(state.belief)
        return state.weighed.after(self.tool + float(mean[0]), float(sd[0]), t)

    def _payload(self, belief: S) -> tuple[Array, Array]:
        """What is carried, mean and standard deviation, (10,) each."""
        return beliefs.mean_and_sd(self.filter, belief, self.places["payload"])
