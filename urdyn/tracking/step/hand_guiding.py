"""Whether a hand moves an arm whose stream does not say so, as in freedrive.

Drives then bear the arm's weight and no more: what the current of a joint that slides lacks is D,
the predicted part that is not weight. With V the variance of noise and of what friction may be by
itself, what the prediction leaves is

    hand:   e ~ N(-D, V)       drive:  e ~ N(0, V)
    dead:   e ~ N(-D - B, R)   else:   e ~ N(0, V + (REACH D)²)

where B is the weight's part and R the noise's variance: a dead sensor reads 0, as by a hand where a
joint bears nothing, so one sensor at most may be dead. `else` is whatever else happens to an arm: a
push, a piece, a fault. A joint speaks for a hand as far as that is likelier than all others, and
never much against it, for its sensor may be at fault. The log odds of all joints that slide add up
from look to look, between 0 and SURE [Page1954]_. At SURE a hand moves the arm, until they are 0.

The prediction is by what was believed when the arm last surely moved itself: within tenths of a
second a filter learns that joints have lost their friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from urdyn.dbn.robot import RobotCurrents
from urdyn.estimate import Filter
from urdyn.estimate.protocol import S
from urdyn.signal import Instant
from urdyn.tracking.belief import beliefs
from urdyn.tracking.belief.reading import Reading
from urdyn.tracking.step.joint_motion import LOOSE, STANDING
from urdyn.tracking.step.past_beliefs import RollbackPoint
from urdyn.types import Array, Mask, changed

LOOK = 0.08  # [s] between two looks, by which noise is another
SURE = 20.0  # [nats]; sound real arms have been seen to reach 1
REACH = 2.0  # [-] of D, sd of what else may happen
LIKE = 0.15  # [-] of D, sd by which friction differs from day to day, and with warmth
SPOILT = 0.01  # [-] probability that a current tells nothing


@dataclass(frozen=True, eq=False)
class Driven(Generic[S]):
    """What was learnt until the arm last surely moved itself."""

    known: RollbackPoint[S]
    payload: Array  # (10,) approximate payload
    changed_drives: Mask  # (J,)
    widened: float  # [s]


@dataclass(frozen=True, eq=False)
class HandGuiding(Generic[S]):
    """Whether a hand moves the arm."""

    driven: Driven[S]
    odds: float = 0.0  # [nats]
    looked: float = -np.inf  # [s]
    going: bool = False
    samples: int = 0  # in which a hand moved it


@dataclass(frozen=True, eq=False)
class HandTest(Generic[S]):
    """Tells a hand from an arm that moves itself."""

    filter: Filter[S]
    currents: RobotCurrents

    def after(
        self, hand: HandGuiding[S], now: Instant, reading: Reading, driven: Driven[S]
    ) -> HandGuiding[S]:
        """What is known after an instant with its currents.

        Args:
            driven: what is believed by now.
        """
        if (
            hand.going and np.isfinite(now.current).any()
        ):  # others are left out, and counted, anyway
            hand = changed(hand, samples=hand.samples + 1)
        if 0.0 <= now.t - hand.looked < LOOK:
            return hand
        slides = (np.abs(now.v) > STANDING) & (reading.travelled > LOOSE) & np.isfinite(now.current)
        if not np.count_nonzero(slides):
            return hand
        gained = self._gained(hand.driven.known, now, reading, slides)
        odds = min(max(hand.odds + gained, 0.0), SURE)
        going = odds >= SURE or (hand.going and odds > 0.0)
        itself = not (hand.going or going) and odds == 0.0 and gained < 0.0
        last = driven if itself else hand.driven
        return changed(hand, driven=last, odds=odds, looked=now.t, going=going)

    def _gained(
        self, known: RollbackPoint[S], now: Instant, reading: Reading, slides: Mask
    ) -> float:
        """Log odds of a hand [nats] by the currents of the joints that slide, (J,)."""
        u, mean = reading.inputs, beliefs.mean(self.filter, known.belief)
        per_unit = self.currents.per_unit(mean, u)
        driven = np.vecdot(per_unit, u.packed)
        borne = np.vecdot(per_unit, self.currents.weight(u, now))
        noise = known.colour.alike[0] + u.unknown
        e, D = now.current - driven, driven - borne
        of_each = tuple(of[slides] for of in (e, D, borne, noise))
        each = log_odds(*of_each, may_be_dead=False)
        # One joint's sensor may be dead.
        less = log_odds(*of_each, may_be_dead=True) - each
        return float(each.sum() + less.min())


def log_odds(e: Array, D: Array, borne: Array, noise: Array, *, may_be_dead: bool) -> Array:
    """Of a hand against all else, joint by joint, (J,) [nats].

    Args:
        e: measured minus predicted currents, (J,) [A].
        D: predicted ones, without the part that bears the arm's weight, (J,) [A].
        borne: that part, (J,) [A].
        noise: variance, (J,) [A²].
    """
    V = noise + (LIKE * D) ** 2
    anything = _log_density(e, V + (REACH * D) ** 2)
    hand = np.logaddexp(_log_density(e + D, V), np.log(SPOILT) + anything)
    against = np.maximum(_log_density(e, V), anything)
    if may_be_dead:
        against = np.maximum(against, _log_density(e + D + borne, noise))
    return np.asarray(hand - against)


def _log_density(e: Array, V: Array) -> Array:
    """Of N(e; 0, V), without the constant."""
    return np.asarray(-0.5 * (e**2 / V + np.log(V)))
