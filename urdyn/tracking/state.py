"""What a tracker remembers from sample to sample, and how it forgets."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

from urdyn.estimate import Filter
from urdyn.signal import CausalState
from urdyn.tracking.abrupt_changes import Evidence
from urdyn.tracking.beliefs import shifted
from urdyn.tracking.colour import Colour, unlearnt
from urdyn.tracking.payload.handling import Rest, Weighed
from urdyn.tracking.payload.hypotheses import PayloadHypotheses, no_hypotheses
from urdyn.tracking.streams import Heard
from urdyn.tracking.wear_test import ASKED, PastBelief
from urdyn.types import Array, Mask

S = TypeVar("S")
B = TypeVar("B", bound="RollbackPoint[Any] | PastBelief[Any]")

ROLLBACK = 2.0  # [s] before something else is noticed that is carried, it may have been


@dataclass(frozen=True)
class RollbackPoint(Generic[S]):
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
    unchanged: Array  # (J,) [s] for which that has not changed while the joint slid
    bristles: Array  # (2, J) [-]
    travelled: Array  # (J,) [rad] since they were unknown
    evidence: Evidence  # of what may have befallen the arm in the last seconds
    changed_at: float  # [s] when something was last taken to have befallen it
    widened: float  # [s] and when that was another payload
    colour: Colour  # of the noise
    variance_ratio: Array  # (J,) [-] variance of the last innovation over that of its noise
    lubricant: Array  # (J,) [°C]; NaN while nobody measures the joint's temperature
    next_rollback: RollbackPoint[S]  # at `rollback_marked`
    rollback: RollbackPoint[S]  # and HINDSIGHT or more before: what was not yet surprised
    rollback_marked: float  # [s]
    heard: tuple[Heard[Any], ...]  # of each stream beside the joints' sensors
    wear_reference: PastBelief[S]  # what was believed when drives may since have worn
    recent_reference: PastBelief[S]  # and what was since, which drives are asked of by turns
    carried: Array  # (10,) what is carried, roughly
    changed_drives: Mask  # (J,) drives that something befell since commissioning
    stuck: Array  # (J,) currents that stayed the same while their joint slid, left out
    passed: float = 0.0  # [s] of the run
    moved: float = 0.0  # [s] of its motion
    rest: Rest = field(default_factory=Rest)  # the last one
    weighed: Weighed = field(default_factory=Weighed)  # hold by hold
    load: PayloadHypotheses = field(default_factory=no_hypotheses)  # before it was learnt anew
    undrawn: int = 0  # currents that no motor draws, left out
    restarts: int = 0  # with the commissioned arm, where no arm was believed in any more


def with_rollback_points(
    state: TrackerState[S], t: float, anew: RollbackPoint[S] | None
) -> TrackerState[S]:
    """With what is remembered of earlier beliefs; nothing but `anew`, where it has just begun."""
    if anew is None and t - state.rollback_marked < ROLLBACK:
        return state
    rollback = state.next_rollback if anew is None else anew
    next_rollback = RollbackPoint(state.belief, state.colour) if anew is None else anew
    reference, recent = state.wear_reference, state.recent_reference
    if state.moved - recent.moved > ASKED:  # no rollback goes behind this one
        reference, recent = recent, PastBelief(rollback.belief, state.passed, state.moved)
    return replace(
        state,
        next_rollback=next_rollback,
        rollback=rollback,
        rollback_marked=t,
        wear_reference=reference,
        recent_reference=recent,
    )


def rolled_back(state: TrackerState[S]) -> TrackerState[S]:
    """Without what was learnt since before the surprise."""
    before = state.rollback
    return replace(state, belief=before.belief, colour=unlearnt(state.colour, before.colour))


def with_encoder_jump(
    state: TrackerState[S], filter_: Filter[S], zeros: slice, shift: Array
) -> TrackerState[S]:
    """With encoders whose zeros jumped, (J,) [rad], by now and in hindsight."""

    def moved(of: B) -> B:
        return replace(of, belief=shifted(filter_, of.belief, zeros, -shift))

    return replace(
        state,
        belief=shifted(filter_, state.belief, zeros, -shift),
        next_rollback=moved(state.next_rollback),
        rollback=moved(state.rollback),
        wear_reference=moved(state.wear_reference),
        recent_reference=moved(state.recent_reference),
    )


def restarted(state: TrackerState[S], first: TrackerState[S]) -> TrackerState[S]:
    """With the arm as it is believed in at `first`, and whatever it carries."""
    return replace(
        state,
        belief=first.belief,
        evidence=first.evidence,
        changed_at=state.t,
        widened=state.t,
        colour=unlearnt(state.colour, first.colour),
        variance_ratio=first.variance_ratio,
        carried=first.carried,
        weighed=first.weighed,
        load=first.load,
        wear_reference=replace(first.wear_reference, passed=state.passed, moved=state.moved),
        recent_reference=replace(first.recent_reference, passed=state.passed, moved=state.moved),
        next_rollback=first.next_rollback,
        rollback=first.rollback,
        rollback_marked=state.t,
        restarts=state.restarts + 1,
    )
