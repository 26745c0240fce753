"""Handling of pieces: a gripper may have opened or closed whenever the arm stood.

Pieces too light for evidence within a hold would be averaged into one payload, ever more surely, at
the expense of friction and health. So the belief in the payload widens by a light piece whenever
the arm sets off. Where heavier pieces are handled, the payload is then learnt anew, with or without
evidence of another, and again upon evidence; once it is known to be another, everything else
continues with it from before, because a wrong payload biases whatever multiplies it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.types import Array

REST = 0.3  # [s] that the arm stands at least while a gripper opens or closes
HANDLING = 300.0  # [s] after another payload was reported, in which more may come
LASTING = 0.8  # [-] weight of earlier holds, per hold
NONE = 16.0  # [sd²] by which holds together weigh less than 0: then what they weigh is no load
LEARNT = 2.0  # [s] after the arm sets off, by which the payload is known well enough
APART = 4.0  # [sd] between payloads, beyond which they are different


@dataclass(frozen=True)
class Rest:
    """The arm's last rest, in which a gripper may have opened or closed."""

    lasted: float = 0.0  # [s] since the last joint was seen to move
    left: float = np.inf  # [s] since when the payload has been unknown; inf: it is known
    over: float = -np.inf  # [s] when the arm last set off, whatever it carries

    def ends(self, moving: bool) -> bool:
        """Whether the arm sets off now: a gripper may have opened or closed."""
        return moving and self.lasted > REST

    def known(self, t: float) -> bool:
        """Whether the arm set off long enough ago to have shown what it carries."""
        return t - self.left > LEARNT

    def just(self, t: float) -> bool:
        """Whether the arm stood until just now."""
        return t - self.over < LEARNT

    def unseen(self, dt: float) -> Rest:
        """The rest after `dt` [s] without samples: a long gap counts as standing."""
        return replace(self, lasted=self.lasted + dt) if dt > REST else self

    def after(self, moving: bool, dt: float, left: float, t: float) -> Rest:
        """The rest after one more instant, at t [s], dt after the one before."""
        over = t if self.ends(moving) else self.over
        return Rest(0.0 if moving else self.lasted + dt, left, over)


@dataclass(frozen=True)
class ImplausibleLoads:
    """Evidence of impossible loads: holds that seemed to weigh less than 0.

    Wear or damage of a drive is mistaken for another load in every move. Its sign reverses with
    the motion, and so does that of these loads.
    """

    score: float = 0.0  # [sd²]
    told: float = -np.inf  # [s] when it was last sure that they were no loads

    def suspected(self, t: float) -> bool:
        """Whether apparent loads were something else, so that no light piece is looked for."""
        return t - self.told < HANDLING

    def after(self, mass: float, sd: float, t: float) -> ImplausibleLoads:
        """The evidence after a hold of this total mass [kg], which ends at t [s]."""
        score = LASTING * self.score + min(mass / sd, 0.0) ** 2
        return ImplausibleLoads(0.0, t) if score > NONE else ImplausibleLoads(score, self.told)


@dataclass(frozen=True, eq=False)
class HandlingPhase:
    """Where an arm is in a program that may handle pieces."""

    sets_off: bool  # at this instant: a gripper may have opened or closed in the rest before
    handles: bool  # pieces have come or gone within HANDLING
    shown: bool  # it has moved long enough since to show what it carries
    implausible: ImplausibleLoads  # up to this instant
    suspected: bool  # apparent loads were something else

    @property
    def unknown(self) -> bool:
        """Whether the payload is unknown from here on."""
        return self.sets_off and self.handles

    @property
    def light(self) -> bool:
        """Whether a piece too light for evidence may be carried from here on."""
        return self.sets_off and not self.suspected


def exchanged(before: tuple[Array, Array], now: tuple[Array, Array]) -> bool:
    """Whether the payload now differs from that before; mean and standard deviation, (10,) each."""
    return bool((np.abs(now[0] - before[0]) > APART * np.hypot(now[1], before[1])).any())
