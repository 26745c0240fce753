"""Sample in, belief and surprise out: the same step for a log and for a live robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Generic

import numpy as np

from urdyn.dbn.graph import Network
from urdyn.dbn.joined import Joined
from urdyn.dbn.process import RandomWalk
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_slice import ROWS, RobotSlice
from urdyn.dbn.wear import Wear
from urdyn.dbn.widening import Widening
from urdyn.estimate import Filter, Innovation
from urdyn.estimate.protocol import S
from urdyn.identify.fit import Fit
from urdyn.signal import Causal, CausalState, Instant, Sample
from urdyn.signal.stretches import GAP
from urdyn.tracking.belief import beliefs
from urdyn.tracking.belief.model import STRIDE, Drift, tracking_model
from urdyn.tracking.belief.network import of_arm
from urdyn.tracking.belief.reading import Reading
from urdyn.tracking.noise import colour
from urdyn.tracking.noise.colour import Colour
from urdyn.tracking.noise.robust_noise import without_robust_noise
from urdyn.tracking.step.abrupt_changes import accumulated, no_evidence
from urdyn.tracking.step.change_detection import ChangeDetector, Hypothesis
from urdyn.tracking.step.hand_guiding import Driven, HandGuiding, HandTest
from urdyn.tracking.step.joint_motion import (
    LONGEST,
    JointMotion,
    before_any,
    joint_motion,
    long_ago,
)
from urdyn.tracking.step.past_beliefs import PastBeliefs, RollbackPoint
from urdyn.tracking.step.payload_handling import ImplausibleLoads, Rest
from urdyn.tracking.step.state import TrackerState, restarted, with_driven, with_encoder_jump
from urdyn.tracking.step.wear_test import WearTest
from urdyn.tracking.step.whitened_residuals import ResidualWhitener, WhitenedResiduals
from urdyn.tracking.streams.stream import Heard, Moment, Stream, assimilated, first
from urdyn.types import Array, Gaussian, Index, Mask, changed

# Factors on the commissioned values that no drive exceeds, whatever happens to it.
CREDIBLE = {"f": (0.15, 50.0), "alpha": (0.05, 50.0), "z": (0.3, 1.5)}


@dataclass(frozen=True, eq=False)
class _Update(Generic[S]):
    """An instant, what it was compared with, and what was learnt from it."""

    now: Instant
    motion: JointMotion
    hypothesis: Hypothesis[S]
    currents: WhitenedResiduals
    belief: S
    innovation: Innovation


@dataclass(frozen=True, eq=False)
class Tracker(Generic[S]):
    """A twin's filter over a stream of samples; holds settings only, the state is passed along."""

    fit: Fit
    filter: Filter[S]
    period: float  # [s] nominal, between samples
    drift: Drift | None = None
    network: Network | None = None  # what leads what, and what is observed; None: the paper's
    streams: tuple[Stream[Any], ...] = ()  # beside the joints' own sensors
    velocities: bool = True  # whether they are measured

    @cached_property
    def model(self) -> Joined[RobotSlice]:
        """The two slices."""
        network = self.network and of_arm(self.network, (s.shared for s in self.streams))
        return tracking_model(self.fit, self.drift, network, [s.own for s in self.streams])

    @cached_property
    def _still(self) -> Joined[RobotSlice]:
        """The same slice with parameters that do not move."""
        names, prior = self.model.names, self.model.prior
        return Joined(RandomWalk(names, prior, np.zeros(len(names))), self.currents)

    @cached_property
    def currents(self) -> RobotCurrents:
        """The model's observation."""
        observation = self.model.observation
        assert isinstance(observation, RobotCurrents)
        return observation

    @cached_property
    def beside(self) -> tuple[tuple[str, str], ...]:
        """Names and units of the other streams' own quantities."""
        pairs = (zip(s.names, s.units, strict=True) for s in self.streams)
        return tuple(pair for of in pairs for pair in of)

    @cached_property
    def _detector(self) -> ChangeDetector[S]:
        """Detects abrupt changes of the arm."""
        places, drive = self.currents.places, self.fit.dynamics.drive
        tool = float(self.fit.dynamics.payload[0])
        process = self.model.process
        assert isinstance(process, Widening), "a payload may jump"
        assert isinstance(process.process, Wear), "and drives wear"
        return ChangeDetector(
            filter=self.filter,
            wear_test=WearTest(process.process),
            places=places,
            drive=drive,
            tool=tool,
            period=self.period,
            poses=any(stream.shared == "k" for stream in self.streams),
        )

    @cached_property
    def _whitener(self) -> ResidualWhitener[S]:
        """Compares currents with the hypothesis."""
        drive = self.fit.dynamics.drive
        return ResidualWhitener(self.filter, self.model, self.currents, drive, self.period)

    @cached_property
    def _hand(self) -> HandTest[S]:
        """Tells whether a hand moves the arm."""
        return HandTest(self.filter, self.currents)

    @cached_property
    def _told(self) -> tuple[Index, ...]:
        """States that each stream measures: shared ones, and its own."""
        groups = {"": slice(0)} | self.currents.places
        own = [[self.model.names.index(name) for name in s.own.names] for s in self.streams]
        shared = [np.r_[groups[s.shared]] for s in self.streams]
        return tuple(np.r_[a, b].astype(np.intp) for a, b in zip(shared, own, strict=True))

    @cached_property
    def _causal(self) -> Causal:
        offset = self.fit.dynamics.drive.time_offset
        return Causal(self.period, offset=offset, velocities=self.velocities)

    def init(self) -> TrackerState[S]:
        """The commissioned arm, before the first sample."""
        J = self.fit.dynamics.arm.joints
        belief, never = self.filter.init(self.model), -np.inf
        width = 2 * self.currents.rigid.stop + len(ROWS)
        noise = colour.first(self.fit.noise, width, self.period)
        known = RollbackPoint(belief, noise)
        payload = self.model.prior.mean[self.currents.places["payload"]]
        unchanged = np.zeros(J, dtype=bool)
        return TrackerState(
            causal=self._causal.init(J),
            belief=belief,
            t=never,
            waited=0.0,
            joints=before_any(J),
            evidence=no_evidence(J),
            changed_at=never,
            widened=never,
            colour=noise,
            variance_ratio=np.ones(J),
            past=PastBeliefs.only(known, never, 0.0, 0.0),
            heard=tuple(first(stream) for stream in self.streams),
            payload=payload,
            changed_drives=unchanged,
            stuck=np.zeros(J),
            hand=HandGuiding(Driven(known, payload, unchanged, never)),
        )

    def step(
        self, state: TrackerState[S], sample: Sample
    ) -> tuple[TrackerState[S], Reading | None]:
        """Take one sample; gives a reading once the causal window is full."""
        causal, instant = self._causal.step(state.causal, sample)
        if self.streams:
            state = replace(state, heard=self._with_more(state.heard, sample))
        if instant is None:
            return replace(state, causal=causal), None
        # A jump is reported once, whatever else is missing; poses have shown it before.
        if np.count_nonzero(instant.shift) and not self._detector.poses:
            shift, zeros = np.nan_to_num(instant.shift), self.currents.places["k"]
            state = with_encoder_jump(state, self.filter, zeros, shift)
        if not np.isfinite([instant.q, instant.v, instant.a]).all():
            return replace(state, causal=causal), None
        wrong = self.fit.dynamics.undrawn(instant.current)
        if np.count_nonzero(wrong):
            instant = replace(instant, current=np.where(wrong, np.nan, instant.current))
            state = replace(state, undrawn=state.undrawn + int(np.count_nonzero(wrong)))
        touching = self._touching(state, instant.t) and np.isfinite(instant.current).any()
        learnt = instant
        if touching or state.hand.going:
            learnt = replace(instant, current=np.full_like(instant.current, np.nan))
            state = replace(state, touched=state.touched + int(touching))
        state, reading = self._assimilate(state, causal, learnt)
        if touching:  # a push still shows; as where friction is unknown, nothing slow does
            reading = replace(reading, instant=instant, travelled=np.zeros_like(instant.q))
        else:
            state = self._led(state, instant, reading)
        return self._listened(state, reading) if self.streams else (state, reading)

    def _touching(self, state: TrackerState[S], t: float) -> bool:
        """Whether a stream has shown contact: then currents do not tell the arm."""
        pairs = zip(self.streams, state.heard, strict=True)
        return any(stream.touching(heard.state, t) for stream, heard in pairs)

    def _led(self, state: TrackerState[S], now: Instant, reading: Reading) -> TrackerState[S]:
        """The state after asking whether a hand moves the arm; if so, as before it did."""
        known = RollbackPoint(state.belief, state.colour)
        driven = Driven(known, state.payload, state.changed_drives, state.widened)
        hand = self._hand.after(state.hand, now, reading, driven)
        begins = hand.going and not state.hand.going
        return with_driven(state, hand) if begins else changed(state, hand=hand)

    @property
    def enough(self) -> int:
        """Samples in a row that it takes to give readings."""
        return self._causal.fit.samples

    def missed(self, state: TrackerState[S]) -> tuple[float, Mask, Array]:
        """An instant without a reading: its time [s], missing angles and currents, (J,) each.

        The angles as a mask of joints, the currents in [A].
        """
        return self._causal.missed(state.causal)

    def _with_more(self, heard: tuple[Heard[Any], ...], sample: Sample) -> tuple[Heard[Any], ...]:
        def rows(stream: Stream[Any]) -> Array | None:
            pressed = sample.in_contact and stream.shared == "payload"
            return None if pressed else sample.beside.get(stream.name)

        pairs = zip(self.streams, heard, strict=True)
        return tuple(h.with_more(rows(stream)) for stream, h in pairs)

    def _assimilate(
        self, state: TrackerState[S], causal: CausalState, now: Instant
    ) -> tuple[TrackerState[S], Reading]:
        state, dt = self._since(state, now.t)
        motion = joint_motion(state.joints, now, dt, self.fit.dynamics.drive, self.period)
        hypothesis = self._detector.hypothesis(state, now.t, motion.moving)
        waited = state.waited + motion.passed
        # At high rates, no sample both looks for changes and moves parameters: both take time.
        due = waited >= STRIDE * (1 + hypothesis.detection.looked)
        moves = hypothesis.resets or hypothesis.widening is not None or due
        # With the payload as reported: an estimate's noise would enter the gears' load.
        about = self._detector.carrying(hypothesis.mean, hypothesis.payload)
        u = self._whitener.inputs(now, motion, hypothesis, about, waited if moves else 0.0)
        currents = self._whitener.whitened(now, motion, hypothesis, u, state.variance_ratio)
        model = self.model if moves else self._still
        belief, innovation = self.filter.step(model, hypothesis.belief, currents.robust, currents.y)
        if currents.robust is not currents.white:
            added = currents.robust.power - currents.white.power
            innovation = without_robust_noise(innovation, added, currents.y)
        update = _Update(now, motion, hypothesis, currents, belief, innovation)
        after = self._after(state, causal, update)
        widened = after.load.told and not hypothesis.load.told
        astray = not self._credible(belief)
        if astray:  # a reported change of payload is not believed any more, either
            after, widened = restarted(after, self.init()), False
        return after, Reading(
            t=now.t,
            current=now.current,
            predicted=currents.measured - innovation.residual,
            modelled=currents.modelled,
            innovation=innovation,
            widened=widened,
            instant=now,
            travelled=motion.end.travelled,
            inputs=u,
            believed=partial(self.believed, after),
            told=partial(self.estimates_beside, after),
            learnt=(currents.robust, currents.y),
            restarted=astray,
        )

    def _since(self, state: TrackerState[S], t: float) -> tuple[TrackerState[S], float]:
        """The state, reset as needed after a gap, and the time since the last instant [s]."""
        dt = t - state.t
        if dt <= 0.0:  # the clock was set, or the controller restarted: unknown time
            state = replace(
                state,
                changed_at=-np.inf,
                widened=-np.inf,
                past=replace(state.past, marked=-np.inf),
                hand=replace(state.hand, driven=replace(state.hand.driven, widened=-np.inf)),
                rest=Rest(),
                implausible=ImplausibleLoads(),
                joints=long_ago(state.joints),
            )
            dt = LONGEST
        if GAP * self.period < dt < np.inf:  # the noise's past does not count
            noise, rest = colour.interrupted(state.colour), state.rest.unseen(dt)
            state = replace(state, colour=noise, rest=rest)
        return state, dt

    def _after(
        self, state: TrackerState[S], causal: CausalState, update: _Update[S]
    ) -> TrackerState[S]:
        """The state after learning from an instant."""
        now, motion, hypothesis = update.now, update.motion, update.hypothesis
        currents, belief, innovation = update.currents, update.belief, update.innovation
        ratio, noise = self._whitener.noise(currents, innovation, state.variance_ratio)
        since, payload = hypothesis.unknown_since(now.t), hypothesis.payload
        changes = hypothesis.detection.reported and hypothesis.change is not None
        compared = bool(np.count_nonzero(np.isfinite(currents.residual)))
        first_weighed = self._detector.first_weighed(state, hypothesis.phase)
        if not hypothesis.resets:
            payload = self._detector.renewed(state, belief, now.t, hypothesis.phase.shown)
        return changed(
            state,
            causal=causal,
            belief=belief,
            t=now.t,
            waited=state.waited + motion.passed - currents.robust.span,
            joints=motion.end,
            past=_past(state, update, noise, first_weighed),
            evidence=accumulated(
                hypothesis.detection.evidence,
                currents.white,
                self.fit.dynamics.drive,
                innovation,
                motion.passed,
            ),
            changed_at=now.t if changes else state.changed_at,
            widened=now.t if hypothesis.another_payload else state.widened,
            colour=noise,
            variance_ratio=ratio,
            passed=state.passed + motion.passed,
            moved=state.moved + motion.passed * compared,
            payload=payload,
            changed_drives=hypothesis.changed_drives,
            stuck=state.stuck + motion.stuck,
            rest=state.rest.after(motion.moving, motion.passed, since, now.t),
            implausible=hypothesis.phase.implausible,
            load=self._detector.updated_load(hypothesis, belief, motion.moving),
        )

    def _credible(self, belief: S) -> bool:
        """Whether its drives can be an arm's; data of another arm, or of none, spoil them."""
        low, high = self._limits
        mean = beliefs.mean(self.filter, belief)
        return bool(((low < mean) & (mean < high)).all())

    @cached_property
    def _limits(self) -> tuple[Array, Array]:
        """Lower and upper limits of all states, (n,) each."""
        low = np.full(len(self.model.names), -np.inf)
        high = -low
        for group, (least, most) in CREDIBLE.items():
            at = self.currents.places[group]
            low[at], high[at] = self.model.prior.mean[at] + np.log([[least], [most]])
        return low, high

    def _listened(
        self, state: TrackerState[S], reading: Reading
    ) -> tuple[TrackerState[S], Reading]:
        """Update by the other streams' rows up to this instant."""
        lead = self.fit.dynamics.drive.time_offset
        now = replace(reading.instant, t=reading.t + lead)  # when its angles were
        belief, heard = state.belief, []
        for stream, at, h in zip(self.streams, self._told, state.heard, strict=True):
            moment = Moment(now, self.period, at)
            belief, h = assimilated(stream, h, moment, self.filter, self.model, belief)
            heard.append(h)
        state = replace(state, belief=belief, heard=tuple(heard))
        believed, told = partial(self.believed, state), partial(self.estimates_beside, state)
        return state, replace(reading, believed=believed, told=told)

    def believed(self, state: TrackerState[S]) -> Gaussian:
        """Reported belief in all states, (n,), over the hypotheses of the payload."""
        return self._detector.payload_belief.believed(state)

    def estimates_beside(self, state: TrackerState[S]) -> tuple[Array, Array]:
        """Means and standard deviations of the other streams' own quantities."""
        pairs = [s.estimates(h.state) for s, h in zip(self.streams, state.heard, strict=True)]
        means, sds = zip(*pairs, strict=True) if pairs else ((), ())
        return np.concatenate([*means, []]), np.concatenate([*sds, []])


def _past(
    state: TrackerState[S], update: _Update[S], noise: Colour, first_weighed: bool
) -> PastBeliefs[S]:
    """The earlier beliefs after an instant, by which the noise has this colour."""
    hypothesis, start = update.hypothesis, update.hypothesis.start
    now = update.now.t, state.passed, state.moved
    if hypothesis.resets:
        changes = hypothesis.change is not None
        known = (update.belief, noise) if changes else (start.belief, start.colour)
        point = RollbackPoint(*known)
        return start.past.marked_by(point, point, *now)
    if first_weighed:
        point = RollbackPoint(state.belief, state.colour)
        return start.past.marked_by(point, point, *now)
    if start.past.due(update.now.t):
        point = RollbackPoint(state.belief, state.colour)
        return start.past.marked_by(point, start.past.next_rollback, *now)
    return start.past
