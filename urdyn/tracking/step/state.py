"""What a tracker remembers from sample to sample, and how it rolls back or restarts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Generic

from urdyn.estimate import Filter
from urdyn.estimate.protocol import S
from urdyn.signal import CausalState
from urdyn.tracking.belief.beliefs import shifted
from urdyn.tracking.noise.colour import Colour, unlearnt
from urdyn.tracking.step.abrupt_changes import Evidence, no_evidence
from urdyn.tracking.step.hand_guiding import HandGuiding
from urdyn.tracking.step.joint_motion import JointState
from urdyn.tracking.step.past_beliefs import PastBeliefs, RollbackPoint
from urdyn.tracking.step.payload_handling import ImplausibleLoads, Rest
from urdyn.tracking.step.payload_hypotheses import PayloadHypotheses, no_hypotheses
from urdyn.tracking.streams.stream import Heard
from urdyn.types import Array, Mask


@dataclass(frozen=True, eq=False)
class TrackerState(Generic[S]):
    """All that is remembered from sample to sample."""

    causal: CausalState
    belief: S
    t: float  # [s] of the last instant; -inf before the first
    waited: float  # [s] since parameters were last moved, at that instant
    joints: JointState
    evidence: Evidence  # of abrupt changes in the last seconds
    changed_at: float  # [s] when an abrupt change was last assumed
    widened: float  # [s] when another payload was last reported, or the belief reset
    colour: Colour  # of the noise
    variance_ratio: Array  # (J,) [-] variance of the last innovation over that of its noise
    past: PastBeliefs[S]
    heard: tuple[Heard[Any], ...]  # one per stream beside the joints' sensors
    payload: Array  # (10,) approximate payload
    changed_drives: Mask  # (J,) drives that changed abruptly since commissioning
    stuck: Array  # (J,) number of currents left out, as they stayed the same while the joint slid
    hand: HandGuiding[S]
    passed: float = 0.0  # [s] of the run
    moved: float = 0.0  # [s] of its motion
    rest: Rest = field(default_factory=Rest)  # the last one
    implausible: ImplausibleLoads = field(default_factory=ImplausibleLoads)  # hold by hold
    load: PayloadHypotheses = field(default_factory=no_hypotheses)  # from before learning it anew
    undrawn: int = 0  # number of currents left out, as no motor draws them
    touched: int = 0  # samples in contact by what a stream showed, whose currents were left out
    restarts: int = 0  # resets to the commissioned arm, as the belief was not credible


def rolled_back(state: TrackerState[S]) -> TrackerState[S]:
    """The state without what was learnt since before a change had an effect."""
    before = state.past.rollback
    return replace(state, belief=before.belief, colour=unlearnt(state.colour, before.colour))


def with_driven(state: TrackerState[S], hand: HandGuiding[S]) -> TrackerState[S]:
    """The state as of when the arm last moved itself, in all that is learnt: a hand moves it."""
    known = hand.driven.known
    noise = unlearnt(state.colour, known.colour)
    point = RollbackPoint(known.belief, noise)
    return replace(
        state,
        belief=known.belief,
        evidence=no_evidence(len(state.stuck)),
        colour=noise,
        payload=hand.driven.payload,
        changed_drives=hand.driven.changed_drives,
        widened=hand.driven.widened,
        past=replace(state.past, rollback=point, next_rollback=point, marked=state.t),
        load=no_hypotheses(),
        hand=hand,
    )


def with_encoder_jump(
    state: TrackerState[S], filter_: Filter[S], zeros: slice, shift: Array
) -> TrackerState[S]:
    """The state after encoders' zeros jumped, (J,) [rad], in every belief, past ones included."""

    def moved(belief: S) -> S:
        return shifted(filter_, belief, zeros, -shift)

    driven = state.hand.driven
    known = replace(driven.known, belief=moved(driven.known.belief))
    hand = replace(state.hand, driven=replace(driven, known=known))
    return replace(state, belief=moved(state.belief), past=state.past.each(moved), hand=hand)


def begun_anew(state: TrackerState[S], first: TrackerState[S]) -> TrackerState[S]:
    """The state as at `first`, except for counts over the whole run."""
    return replace(
        first,
        causal=replace(
            first.causal,
            refused=state.causal.refused,
            frozen=state.causal.frozen,
            frozen_since=state.causal.frozen_since,
        ),
        stuck=state.stuck,
        undrawn=state.undrawn,
        touched=state.touched,
        restarts=state.restarts,
        hand=replace(first.hand, samples=state.hand.samples),
    )


def restarted(state: TrackerState[S], first: TrackerState[S]) -> TrackerState[S]:
    """The state with its beliefs reset to those of `first`, whatever the arm carries."""
    known = first.past.rollback
    return replace(
        state,
        belief=first.belief,
        evidence=first.evidence,
        changed_at=state.t,
        widened=state.t,
        colour=unlearnt(state.colour, first.colour),
        variance_ratio=first.variance_ratio,
        payload=first.payload,
        changed_drives=first.changed_drives,
        implausible=first.implausible,
        load=first.load,
        past=PastBeliefs.only(known, state.t, state.passed, state.moved),
        restarts=state.restarts + 1,
        hand=replace(
            first.hand,
            driven=replace(first.hand.driven, widened=state.t),
            samples=state.hand.samples,
        ),
    )
