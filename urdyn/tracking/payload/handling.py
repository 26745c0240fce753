"""Pieces that come and go: a gripper may have opened or closed whenever the arm stood.

What is too light for evidence within a hold would be taken for something between the pieces, ever
more surely, and friction and health would pay for that. So belief in what is carried widens by as
much whenever the arm sets off. Where heavier pieces are handled, it is learnt anew then, whether or
not anything tells of another, and again where something does; once it is known for another,
everything else goes on from before with it, for nothing that multiplies a payload is told rightly
around another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.types import Array

REST = 0.3  # [s] that the arm stands where a gripper opens or closes, at least
HANDLING = 300.0  # [s] after another payload was told, in which more of them may come
LASTING = 0.8  # [-] by which a hold remembers those before it
NONE = 16.0  # [sd²] by which holds together weigh less than nothing: what they weigh is no load
LEARNT = 2.0  # [s] after it set off, what is carried is known as well as need be
APART = 4.0  # [sd] between what is carried and what was: more, and it is something else


@dataclass(frozen=True)
class Rest:
    """Of the arm's last rest, as far as a gripper may have used it."""

    lasted: float = 0.0  # [s] since the last joint was seen to move
    left: float = np.inf  # [s] since when it has carried nobody knows what; inf: it is known
    over: float = -np.inf  # [s] when the arm set off, whatever it carries

    def ends(self, moving: bool) -> bool:
        """Whether the arm sets off now: a gripper may have opened or closed."""
        return moving and self.lasted > REST

    def known(self, t: float) -> bool:
        """Whether the arm set off so long ago that it has shown what it carries."""
        return t - self.left > LEARNT

    def just(self, t: float) -> bool:
        """Whether the arm stood until just now."""
        return t - self.over < LEARNT

    def unseen(self, dt: float) -> Rest:
        """After `dt` [s] of which nobody knows whether the arm stood: a long gap is a rest."""
        return replace(self, lasted=self.lasted + dt) if dt > REST else self

    def after(self, moving: bool, dt: float, left: float, t: float) -> Rest:
        """One instant on, at t [s], dt after the one before."""
        over = t if self.ends(moving) else self.over
        return Rest(0.0 if moving else self.lasted + dt, left, over)


@dataclass(frozen=True)
class ImplausibleLoads:
    """Evidence of loads that cannot be: holds that seemed to weigh less than nothing.

    What wears or breaks in a drive is taken for another load in every move. Its sign turns over
    with the motion's, and so does that of these loads.
    """

    score: float = 0.0  # [sd²]
    told: float = -np.inf  # [s] when it was last sure that they are no loads

    def suspected(self, t: float) -> bool:
        """Whether nothing light is looked for: it was something else that was found."""
        return t - self.told < HANDLING

    def after(self, mass: float, sd: float, t: float) -> ImplausibleLoads:
        """One hold on, of all that was carried [kg], at its end t [s]."""
        score = LASTING * self.score + min(mass / sd, 0.0) ** 2
        return ImplausibleLoads(0.0, t) if score > NONE else ImplausibleLoads(score, self.told)


@dataclass(frozen=True, eq=False)
class HandlingPhase:
    """Where an arm is in a program that may handle pieces."""

    sets_off: bool  # here: a gripper may have opened or closed since it moved
    handles: bool  # pieces have come or gone within HANDLING
    shown: bool  # it has moved for so long since that what it carries is known
    implausible: ImplausibleLoads  # up to here
    suspected: bool  # what was taken for loads was something else

    @property
    def unknown(self) -> bool:
        """Whether nobody knows what is carried from here on."""
        return self.sets_off and self.handles

    @property
    def light(self) -> bool:
        """Whether a piece too light for evidence may be carried from here on."""
        return self.sets_off and not self.suspected


def exchanged(before: tuple[Array, Array], now: tuple[Array, Array]) -> bool:
    """Whether what is carried now is none that it was; mean and standard deviation, (10,) each."""
    return bool((np.abs(now[0] - before[0]) > APART * np.hypot(now[1], before[1])).any())
