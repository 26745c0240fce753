"""Sample in, belief and surprise out: the same step for a log and for a live robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Generic, TypeVar

import numpy as np

from urdyn.dbn.graph import Network
from urdyn.dbn.joined import Joined
from urdyn.dbn.process import RandomWalk
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_slice import ROWS, RobotSlice
from urdyn.estimate import Filter
from urdyn.identify.fit import Fit
from urdyn.model.friction import follow
from urdyn.signal import Causal, CausalState, Instant, Sample
from urdyn.tracking import colour as noise
from urdyn.tracking.befallen import (
    Befallen,
    Evidence,
    Sizes,
    befallen,
    gathered,
    none_yet,
    of_drives,
    told_from,
    wearing,
)
from urdyn.tracking.blocks import Blocks
from urdyn.tracking.handling import HANDLING, Rest, exchanged
from urdyn.tracking.model import BULKY, LIGHT, STRIDE, Drift, tracking_model
from urdyn.tracking.reading import Reading
from urdyn.tracking.state import (
    HINDSIGHT,
    QUICK,
    Learnt,
    TrackerState,
    begun_anew,
    in_hindsight,
    marked,
    rezeroed,
)
from urdyn.tracking.streams import Heard, Moment, Stream, assimilated, first
from urdyn.tracking.temper import tempered, untempered
from urdyn.tracking.warmth import warmed
from urdyn.tracking.worn import ASK, ASKED, Worn
from urdyn.types import Array, Index, Mask

S = TypeVar("S")

STANDING = 0.02  # [rad/s] slower than this, friction is whatever holds the joint
# [rad] of travel, after which a joint that stood for long turns as it does as a rule: its bristles
# are known, and what broke it away is over. Real arms snap by a degree where programs begin.
LOOSE = 0.08
INTERRUPTED = 0.5  # [s] without a sample: the joints may have moved
LONGEST = 60.0  # [s] of drift that one gap may add: a night does not make an arm unknown
PATIENCE = 2.0  # [s] after such a moment before the next
LOOK, LOOK_TIME = 5.0, 0.08  # samples and, where they are many, [s] between two looks for one
GAP = 5.0  # periods without a sample, after which noise has no past
SURE = 2.0  # [-] variance of an innovation over its noise's: less, and it tells of the noise
# Times what they were at commissioning: no arm's drive is beyond that, whatever befell it.
CREDIBLE = {"f": (0.15, 50.0), "alpha": (0.05, 50.0), "z": (0.3, 1.5)}
HELD, REPEATS = 0.2, 8.0  # [s] and samples for which a current may stay while its joint slides


@dataclass(frozen=True, eq=False)
class Tracker(Generic[S]):
    """A twin's filter over a stream of samples; settings only, the state is passed along."""

    fit: Fit
    filter: Filter[S]
    period: float  # [s] between samples, as a rule
    drift: Drift | None = None
    network: Network | None = None  # None: the paper's
    streams: tuple[Stream[Any], ...] = ()  # beside the joints' own sensors

    @cached_property
    def model(self) -> Joined[RobotSlice]:
        """The two slices."""
        return tracking_model(self.fit, self.drift, self.network)

    @cached_property
    def _still(self) -> Joined[RobotSlice]:
        """The same slice while nothing moves."""
        names, prior = self.model.names, self.model.prior
        return Joined(RandomWalk(names, prior, np.zeros(len(names))), self.currents)

    @property
    def _stride(self) -> float:
        """[s] between two moves of the parameters; blocks that wait see to that themselves."""
        return 0.0 if isinstance(self.filter, Blocks) and self.filter.longest > 1 else STRIDE

    @cached_property
    def _look(self) -> float:
        """Samples from one look for what befell the arm to the next."""
        return max(LOOK, round(LOOK_TIME / self.period))

    @cached_property
    def _ask(self) -> float:
        """Samples from one time that drives are asked whether they wore to the next."""
        return max(1.0, round(ASK / self.period))

    @cached_property
    def _worn(self) -> Worn:
        """What they are asked."""
        return Worn.of(self.model.prior, self.currents.places)

    @cached_property
    def _sizes(self) -> Sizes:
        """How large what may befall the arm is."""
        return Sizes.of(self.fit.dynamics.drive)

    @cached_property
    def currents(self) -> RobotCurrents:
        """Its observation."""
        observation = self.model.observation
        assert isinstance(observation, RobotCurrents)
        return observation

    @cached_property
    def beside(self) -> tuple[tuple[str, str], ...]:
        """Names and units of what the other streams alone tell of."""
        pairs = (zip(s.names, s.units, strict=True) for s in self.streams)
        return tuple(pair for of in pairs for pair in of)

    @cached_property
    def _told_of_zeros(self) -> bool:
        """What poses told of zeros in the last seconds is not to be forgotten for a payload."""
        return any(stream.shared == "k" for stream in self.streams)

    @cached_property
    def _shared(self) -> dict[str, Index]:
        """States by the group that a stream shares."""
        nothing = {"": np.zeros(0, dtype=np.intp)}
        return nothing | {g: np.r_[at] for g, at in self.currents.places.items()}

    @cached_property
    def _causal(self) -> Causal:
        return Causal(self.period, offset=self.fit.dynamics.drive.time_offset)

    def init(self) -> TrackerState[S]:
        """The commissioned arm, before the first sample."""
        J = self.fit.dynamics.arm.joints
        belief, nothing = self.filter.init(self.model), np.zeros(J)
        causal = self._causal.init(J)
        width = 2 * self.currents.rigid.stop + len(ROWS)
        colour = noise.first(self.fit.noise, width, self.period)
        return TrackerState(
            causal,
            belief,
            -np.inf,
            0.0,
            nothing,
            np.full(J, np.nan),
            nothing,
            np.zeros((2, J)),
            nothing,
            none_yet(J),
            -np.inf,
            -np.inf,
            colour,
            np.ones(J),
            np.full(J, ASKED),
            np.full(J, np.nan),
            Learnt(belief, colour),
            Learnt(belief, colour),
            -np.inf,
            tuple(first(stream) for stream in self.streams),
            self.model.prior.mean[self.currents.places["payload"]],
        )

    def step(
        self, state: TrackerState[S], sample: Sample
    ) -> tuple[TrackerState[S], Reading | None]:
        """One sample on; a reading once the causal window is full."""
        causal, instant = self._causal.step(state.causal, sample)
        if self.streams:
            state = replace(state, heard=self._with_more(state.heard, sample))
        if instant is None or not np.isfinite([instant.q, instant.v, instant.a]).all():
            return replace(state, causal=causal), None
        wrong = self.fit.dynamics.undrawn(instant.current)
        if wrong.any():
            instant = replace(instant, current=np.where(wrong, np.nan, instant.current))
            state = replace(state, undrawn=state.undrawn + int(np.count_nonzero(wrong)))
        if instant.shift.any() and not self._told_of_zeros:  # poses tell of it before
            state = rezeroed(state, self.currents.places["k"], instant.shift)
        state, reading = self._assimilate(state, causal, instant)
        return self._listened(state, reading) if self.streams else (state, reading)

    def _with_more(self, heard: tuple[Heard[Any], ...], sample: Sample) -> tuple[Heard[Any], ...]:
        pairs = zip(self.streams, heard, strict=True)
        return tuple(h.with_more(sample.beside.get(stream.name)) for stream, h in pairs)

    def _assimilate(
        self, state: TrackerState[S], causal: CausalState, now: Instant
    ) -> tuple[TrackerState[S], Reading]:
        dt = now.t - state.t
        if dt <= 0.0:  # a clock that was set, or a controller that began anew: who knows how long
            state = replace(state, befell=-np.inf, widened=-np.inf, marked=-np.inf, rest=Rest())
            dt = LONGEST
        if dt > GAP * self.period:
            state = replace(state, colour=noise.interrupted(state.colour))
        passed = min(dt, LONGEST) if np.isfinite(dt) else 0.0
        bristles, travelled = self._moved(state, now, dt)
        slides = np.abs(now.v) > STANDING
        held = np.where(now.current == state.current, state.held + passed * slides, 0.0)
        lubricant = warmed(state.lubricant, now.temperature, passed)
        drive, J = self.fit.dynamics.drive, len(now.q)
        mean, rest = self._mean(state.belief), state.rest
        looks = state.colour.count % self._look < 1.0
        moving = bool(slides.any())
        stood, handles = rest.ends(moving), now.t - state.widened < HANDLING
        doubtful = stood and handles
        what, evidence, told_another = self._found(state, now.t, mean, looks, doubtful)
        anew = what is not None
        fresh = anew or doubtful
        if fresh:
            evidence = none_yet(J) if told_another else of_drives(evidence)
        was = in_hindsight(state) if anew or (doubtful and np.isfinite(rest.left)) else state
        before = state.belief if self._told_of_zeros else was.belief
        carried = state.carried if what is None or what.payload is None else what.payload
        mean = mean if what is None else self._mean(before)
        about = self._carrying(mean, carried)  # no estimate: its noise would load the gears
        mean = mean if carried is state.carried else about
        s = bristles[0] + drive.presliding_tail * (bristles[1] - bristles[0])
        waited = state.waited + passed
        taken = LIGHT if stood else BULKY if told_another and not anew else None
        # Where samples are many, no one of them both looks and moves: each takes its time.
        moves = fresh or taken is not None or waited >= self._stride * (1 + looks)
        span = waited if moves else 0.0
        u = self.currents.slice(now, s, passed, about, lubricant, span)
        if fresh:
            u = _jumping(u, what)
        elif taken is not None:
            u = replace(u, taken=taken)
        y = np.where(slides & self._told(travelled, held), now.current, np.nan)
        per_unit = self.currents.per_unit(mean, u)
        modelled = (per_unit * u.packed).sum(axis=1)
        left = y - modelled
        through = self.currents.instrumental(u, now)
        seen = left + (per_unit * through).sum(axis=1)
        through, seen, colour = noise.whitened(was.colour, through, seen)
        white = replace(u, packed=through, noise=colour.scale, stray=colour.slow)
        white = self.currents.near(white, mean, carried)
        unknown = white.unknown
        R = white.noise**2 + unknown
        wild = left - noise.foreseen(was.colour, mean[self.currents.places["slow"]])
        given = white if anew else tempered(white, wild, R, state.unsure)
        asked = state.asked - passed * np.isfinite(y)
        belief, told = self.filter.step(self.model if moves else self._still, before, given, seen)
        told = untempered(told, given.noise**2 - white.noise**2, seen)
        unsure = np.fmax(told.cov.diagonal() / R, np.isnan(told.residual) * state.unsure)
        sure = (unsure < SURE) & (unknown < 0.25 * white.noise**2)
        colour = noise.learnt(colour, left, unknown, sure, self.period)
        known = Learnt(belief, colour) if anew else Learnt(was.belief, was.colour)
        widen = told_another and (what is None or what.payload is not None)
        unknown_since = now.t if handles and (stood or widen) else np.inf if anew else rest.left
        after = replace(
            marked(state, now.t, known if fresh else None),
            causal=causal,
            belief=belief,
            t=now.t,
            waited=waited - span,
            v=now.v,
            current=now.current,
            held=held,
            bristles=bristles,
            travelled=travelled,
            lubricant=lubricant,
            evidence=gathered(evidence, white, drive, told, passed),
            befell=now.t if told_another and anew else state.befell,
            widened=now.t if widen else state.widened,
            colour=colour,
            unsure=unsure,
            asked=asked if what is None else np.where(what.drives, 0.0, asked),
            carried=carried if anew else self._renewed(state, belief, now.t),
            rest=rest.after(moving, passed, unknown_since, now.t),
        )
        if not self._credible(belief):
            after, widen = begun_anew(after, self.init()), True
        belief = after.belief
        believed, told_of = partial(self.filter.belief, belief), partial(self.told_beside, after)
        predicted = y - told.residual
        heard = now.t, now.current, predicted, modelled, told, widen
        return after, Reading(*heard, now, travelled, u, believed, told_of, (given, seen))

    def _found(
        self, state: TrackerState[S], t: float, mean: Array, looks: bool, doubtful: bool
    ) -> tuple[Befallen | None, Evidence, bool]:
        """What befell the arm, the evidence that is left, and whether it is told now."""
        what, evidence, told = None, state.evidence, False
        if looks:
            payload = mean[self.currents.places["payload"]]
            what, evidence = befallen(evidence, self._sizes, payload)
            told = what.anything and t - state.befell > PATIENCE
            what = what if told else None
        if what is None and not doubtful:
            what = self._wore(state, t)
            told = what is not None
        if what is not None:
            return what, evidence, told
        since = state.rest.left if np.isfinite(state.rest.left) else t - HANDLING
        if looks and state.rest.just(t) and state.widened < since:
            told = exchanged(*self._handled(state))
        if state.rest.known(t) and not doubtful:
            payload = told_from(state.carried, *self._handled(state)[1])
            what = Befallen(payload, np.zeros(len(state.v), dtype=bool))
        return what, evidence, told

    def _wore(self, state: TrackerState[S], t: float) -> Befallen | None:
        """A drive that wore before the run, or does, told while nothing else is in question."""
        unsettled = state.evidence.highest or t - state.befell < PATIENCE
        if unsettled or np.isfinite(state.rest.left) or state.colour.count % self._ask >= 1.0:
            return None
        wears = wearing(state.evidence, self._sizes)
        if wears.any():
            return Befallen(None, wears, wears=True)
        asked = state.asked > 0.0
        if not asked.any():
            return None
        wore = self._worn.found(self.filter.belief(state.belief), asked)
        return Befallen(None, wore) if wore.any() else None

    def _renewed(self, state: TrackerState[S], belief: S, t: float) -> Array:
        """What is carried, (10,), as it is known now where it surely is something else.

        Seldom: every time, the errors of what is known are in the regressors of health and gain
        anew.
        """
        due = t - state.marked >= HINDSIGHT
        return told_from(state.carried, *self._payload(belief)) if due else state.carried

    def _handled(self, state: TrackerState[S]) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """What was carried before the last rest, and since; mean and standard deviation."""
        return self._payload(state.earliest.belief), self._payload(state.belief)

    def _payload(self, belief: S) -> tuple[Array, Array]:
        """What is carried, mean and standard deviation, (10,) each."""
        at = self.currents.places["payload"]
        known = belief if isinstance(belief, QUICK) else self.filter.belief(belief)
        return known.mean[at], known.sd[at]

    def _carrying(self, mean: Array, payload: Array) -> Array:
        """The states (n,) with this payload, (10,)."""
        mean = np.array(mean)
        mean[self.currents.places["payload"]] = payload
        return mean

    def _credible(self, belief: S) -> bool:
        """Whether its drives can be an arm's; data of another arm, or of none, lead astray."""
        low, high = self._limits
        mean = self._mean(belief)
        return bool(((low < mean) & (mean < high)).all())

    @cached_property
    def _limits(self) -> tuple[Array, Array]:
        """What every state is more, and less than, (n,) each."""
        low = np.full(len(self.model.names), -np.inf)
        high = -low
        for group, (least, most) in CREDIBLE.items():
            at = self.currents.places[group]
            low[at], high[at] = self.model.prior.mean[at] + np.log([[least], [most]])
        return low, high

    def _listened(
        self, state: TrackerState[S], reading: Reading
    ) -> tuple[TrackerState[S], Reading]:
        """What the other streams have told up to this instant."""
        lead = self.fit.dynamics.drive.time_offset
        now = replace(reading.instant, t=reading.t + lead)  # where its angles are
        belief, heard = state.belief, []
        for stream, h in zip(self.streams, state.heard, strict=True):
            moment = Moment(now, self.period, state.widened, self._shared[stream.shared])
            belief, h = assimilated(stream, h, moment, self.filter, self.model, belief)
            heard.append(h)
        state = replace(state, belief=belief, heard=tuple(heard))
        believed, told = partial(self.filter.belief, belief), partial(self.told_beside, state)
        return state, replace(reading, believed=believed, told=told)

    def told_beside(self, state: TrackerState[S]) -> tuple[Array, Array]:
        """Means and standard deviations of what the other streams tell of by themselves."""
        told = [s.told(h.state) for s, h in zip(self.streams, state.heard, strict=True)]
        means, sds = zip(*told, strict=True) if told else ((), ())
        return np.concatenate([*means, []]), np.concatenate([*sds, []])

    def _mean(self, belief: S) -> Array:
        """Of the states; a square root need not be squared for it."""
        return belief.mean if isinstance(belief, QUICK) else self.filter.belief(belief).mean

    def _moved(self, state: TrackerState[S], now: Instant, dt: float) -> tuple[Array, Array]:
        """Bristles and travel after the way since the last instant."""
        if dt > INTERRUPTED:
            return np.zeros_like(state.bristles), np.zeros_like(state.travelled)
        drive, way = self.fit.dynamics.drive, 0.5 * (state.v + now.v) * dt
        ahead = way + drive.friction_lead * (now.v - state.v)
        bristles = follow(state.bristles, ahead, drive.presliding_distance)
        return bristles, state.travelled + np.abs(way)

    def _told(self, travelled: Array, held: Array) -> Mask:
        """Joints whose current changes, and that have moved for a while."""
        return np.asarray((travelled > LOOSE) & (held <= max(HELD, REPEATS * self.period)))


def _jumping(u: RobotSlice, what: Befallen | None) -> RobotSlice:
    """The slice at which something befell the arm; None: something else may be carried."""
    if what is None:
        return replace(u, widen=True)
    jolted = what.drives.astype(float) if what.drives.any() else None
    return replace(u, widen=what.payload is not None, jolted=jolted, wears=what.wears)
