"""What a tracker remembers from sample to sample, and how it forgets."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import numpy as np

from urdyn.estimate.square_root import SquareRoot
from urdyn.signal import CausalState
from urdyn.tracking.befallen import Evidence
from urdyn.tracking.blocks import BlockBelief
from urdyn.tracking.colour import Colour, unlearnt
from urdyn.tracking.handling import Rest, Weighed
from urdyn.tracking.streams import Heard
from urdyn.types import Array, Gaussian

S = TypeVar("S")

QUICK = Gaussian | SquareRoot | BlockBelief  # beliefs that tell means and sd without more ado

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
    asked: Array  # (J,) [s] of motion for which each drive is yet asked whether it wore before
    lubricant: Array  # (J,) [°C]; NaN while nobody measures the joint's temperature
    earlier: Learnt[S]  # at `marked`
    earliest: Learnt[S]  # and HINDSIGHT or more before: what was not yet surprised
    marked: float  # [s]
    heard: tuple[Heard[Any], ...]  # of each stream beside the joints' sensors
    carried: Array  # (10,) what is carried, roughly
    rest: Rest = field(default_factory=Rest)  # the last one
    weighed: Weighed = field(default_factory=Weighed)  # hold by hold
    undrawn: int = 0  # currents that no motor draws, left out
    restarts: int = 0  # with the commissioned arm, where no arm was believed in any more


def marked(state: TrackerState[S], t: float, anew: Learnt[S] | None) -> TrackerState[S]:
    """With what is remembered of earlier beliefs; nothing but `anew`, where it has just begun."""
    if anew is not None:
        return replace(state, earlier=anew, earliest=anew, marked=t)
    if t - state.marked < HINDSIGHT:
        return state
    now = Learnt(state.belief, state.colour)
    return replace(state, earlier=now, earliest=state.earlier, marked=t)


def in_hindsight(state: TrackerState[S]) -> TrackerState[S]:
    """Without what was learnt since before the surprise."""
    before = state.earliest
    return replace(state, belief=before.belief, colour=unlearnt(state.colour, before.colour))


def rezeroed(state: TrackerState[S], zeros: slice, shift: Array) -> TrackerState[S]:
    """With encoders whose zeros jumped, (J,) [rad], by now and in hindsight."""

    def moved(belief: Any) -> Any:
        if not isinstance(belief, QUICK):  # particles find out
            return belief
        mean = np.array(belief.mean)
        mean[zeros] -= shift
        return replace(belief, mean=mean)

    known = (replace(of, belief=moved(of.belief)) for of in (state.earlier, state.earliest))
    earlier, earliest = known
    return replace(state, belief=moved(state.belief), earlier=earlier, earliest=earliest)


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
        asked=first.asked,
        carried=first.carried,
        weighed=first.weighed,
        earlier=first.earlier,
        earliest=first.earliest,
        marked=state.t,
        restarts=state.restarts + 1,
    )
