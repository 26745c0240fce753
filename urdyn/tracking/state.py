"""What a tracker remembers from sample to sample, and how it forgets."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

from urdyn.estimate import Filter
from urdyn.signal import CausalState
from urdyn.tracking.befallen import Evidence
from urdyn.tracking.beliefs import shifted
from urdyn.tracking.colour import Colour, unlearnt
from urdyn.tracking.handling import Rest, Weighed
from urdyn.tracking.held import Held, nothing_held
from urdyn.tracking.streams import Heard
from urdyn.tracking.worn import ASKED, Then
from urdyn.types import Array, Mask

S = TypeVar("S")
B = TypeVar("B", bound="Learnt[Any] | Then[Any]")

HINDSIGHT = 2.0  # [s] before something else is noticed that is carried, it may have been


@dataclass(frozen=True)
class Learnt(Generic[S]):
    """What was learnt up to some moment."""

    belief: S
    colour: Colour  # of the noise


@dataclass(frozen=True)
class TrackerState(Generic[S]):
    """All that is remembered from sample to sample."""

    causal: CausalState
    belief: S
    t: float  # [s] of the last instant; -inf before the first
    waited: float  # [s] for which parameters have not moved by then
    v: Array  # (J,) [rad/s] then
    current: Array  # (J,) [A] then
    held: Array  # (J,) [s] for which that has not changed while the joint slid
    bristles: Array  # (2, J) [-]
    travelled: Array  # (J,) [rad] since they were unknown
    evidence: Evidence  # of what may have befallen the arm in the last seconds
    befell: float  # [s] when something was last taken to have befallen it
    widened: float  # [s] and when that was another payload
    colour: Colour  # of the noise
    unsure: Array  # (J,) [-] variance of the last innovation over that of its noise
    lubricant: Array  # (J,) [°C]; NaN while nobody measures the joint's temperature
    earlier: Learnt[S]  # at `marked`
    earliest: Learnt[S]  # and HINDSIGHT or more before: what was not yet surprised
    marked: float  # [s]
    heard: tuple[Heard[Any], ...]  # of each stream beside the joints' sensors
    then: Then[S]  # what was believed when drives may since have worn
    lately: Then[S]  # and what was since, which drives are asked of by turns
    carried: Array  # (10,) what is carried, roughly
    fell: Mask  # (J,) drives that something befell since commissioning
    stuck: Array  # (J,) currents that stayed the same while their joint slid, left out
    passed: float = 0.0  # [s] of the run
    moved: float = 0.0  # [s] of its motion
    rest: Rest = field(default_factory=Rest)  # the last one
    weighed: Weighed = field(default_factory=Weighed)  # hold by hold
    load: Held = field(default_factory=nothing_held)  # before it was learnt anew
    undrawn: int = 0  # currents that no motor draws, left out
    restarts: int = 0  # with the commissioned arm, where no arm was believed in any more


def marked(state: TrackerState[S], t: float, anew: Learnt[S] | None) -> TrackerState[S]:
    """With what is remembered of earlier beliefs; nothing but `anew`, where it has just begun."""
    if anew is None and t - state.marked < HINDSIGHT:
        return state
    earliest = state.earlier if anew is None else anew
    earlier = Learnt(state.belief, state.colour) if anew is None else anew
    then, lately = state.then, state.lately
    if state.moved - lately.moved > ASKED:  # hindsight goes back to no belief before this one
        then, lately = lately, Then(earliest.belief, state.passed, state.moved)
    return replace(state, earlier=earlier, earliest=earliest, marked=t, then=then, lately=lately)


def in_hindsight(state: TrackerState[S]) -> TrackerState[S]:
    """Without what was learnt since before the surprise."""
    before = state.earliest
    return replace(state, belief=before.belief, colour=unlearnt(state.colour, before.colour))


def rezeroed(
    state: TrackerState[S], filter_: Filter[S], zeros: slice, shift: Array
) -> TrackerState[S]:
    """With encoders whose zeros jumped, (J,) [rad], by now and in hindsight."""

    def moved(of: B) -> B:
        return replace(of, belief=shifted(filter_, of.belief, zeros, -shift))

    return replace(
        state,
        belief=shifted(filter_, state.belief, zeros, -shift),
        earlier=moved(state.earlier),
        earliest=moved(state.earliest),
        then=moved(state.then),
        lately=moved(state.lately),
    )


def begun_anew(state: TrackerState[S], first: TrackerState[S]) -> TrackerState[S]:
    """With the arm as it is believed in at `first`, and whatever it carries."""
    return replace(
        state,
        belief=first.belief,
        evidence=first.evidence,
        befell=state.t,
        widened=state.t,
        colour=unlearnt(state.colour, first.colour),
        unsure=first.unsure,
        carried=first.carried,
        weighed=first.weighed,
        load=first.load,
        then=replace(first.then, passed=state.passed, moved=state.moved),
        lately=replace(first.lately, passed=state.passed, moved=state.moved),
        earlier=first.earlier,
        earliest=first.earliest,
        marked=state.t,
        restarts=state.restarts + 1,
    )
