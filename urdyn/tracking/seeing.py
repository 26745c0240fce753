"""An instant's currents beside what is supposed of the arm, as the filter is given them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from urdyn.dbn.joined import Joined
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.dbn.two_slice import linearised
from urdyn.estimate import Filter, Innovation
from urdyn.model.drive import Drive
from urdyn.signal import Instant
from urdyn.tracking import colour, doubt
from urdyn.tracking.befallen import Befallen
from urdyn.tracking.colour import Colour
from urdyn.tracking.noticing import Supposed
from urdyn.tracking.passage import Passage
from urdyn.tracking.temper import tempered
from urdyn.types import Array, changed

S = TypeVar("S")

SURE = 2.0  # [-] variance of an innovation over its noise's: less, and it tells of the noise
KNOWN = 0.25  # [-] variance by what nobody knows of the motion, over the noise's: likewise


@dataclass(frozen=True, eq=False)
class Seen:
    """An instant's currents beside what is supposed of the arm, (J,) each."""

    measured: Array  # [A]; NaN where they are not compared
    modelled: Array  # [A] whatever the noise does
    left: Array  # [A]
    current: Array  # [A] after the filter that makes noise white
    white: RobotSlice  # inputs after it
    given: RobotSlice  # the same, with more noise where a current is wild
    variance: Array  # [A²] of white noise and of what nobody knows of the motion
    colour: Colour  # of the noise, which has seen them


@dataclass(frozen=True, eq=False)
class Seeing(Generic[S]):
    """Compares currents with what is supposed, by a tracker's settings."""

    filter: Filter[S]
    model: Joined[RobotSlice]
    currents: RobotCurrents  # its observation
    drive: Drive
    period: float  # [s] between samples, as a rule

    def inputs(
        self, now: Instant, way: Passage, supposed: Supposed[S], about: Array, span: float
    ) -> RobotSlice:
        """What the motion makes of the parameters, about these (n,), which move over `span` [s]."""
        s = way.presliding(self.drive)
        u = self.currents.inputs(now, s, way.passed, about, way.lubricant, span)
        if supposed.fresh:
            return _jumping(u, supposed.what)
        return u if supposed.taken is None else replace(u, taken=supposed.taken)

    def seen(
        self, now: Instant, way: Passage, supposed: Supposed[S], u: RobotSlice, unsure: Array
    ) -> Seen:
        """The currents beside what is supposed, by the filter that makes their noise white.

        `unsure` is the last innovations' variance over their noise's, (J,).
        """
        mean, past = supposed.mean, supposed.was.colour
        measured = np.where(way.comparable, now.current, np.nan)
        per_unit = self.currents.per_unit(mean, u)
        modelled = np.vecdot(per_unit, u.packed)
        left = measured - modelled
        through = self.currents.instrumental(u, now)
        current = left + np.vecdot(per_unit, through)
        through, current, noise = colour.whitened(past, through, current)
        if colour.due(noise, self.period):
            noise = colour.giving_back(noise, *self._taken(supposed, u), self.period)
        white = u.filtered(through, noise.scale, noise.slow, noise.doubt.share)
        white = self.currents.near(white, mean, supposed.carried)
        variance = white.noise**2 + white.unknown
        wild = left - colour.foreseen(past, mean[self.currents.places["slow"]])
        given = white if supposed.anew else tempered(white, wild, variance, unsure)
        return Seen(
            measured=measured,
            modelled=modelled,
            left=left,
            current=current,
            white=white,
            given=given,
            variance=variance,
            colour=noise,
        )

    def noise(self, seen: Seen, innovation: Innovation, unsure: Array) -> tuple[Array, Colour]:
        """What an innovation tells of the noise: `unsure` a step later, (J,), and its colour."""
        white, residual = seen.white, innovation.residual
        compared, variance = np.isfinite(residual), innovation.cov.diagonal()
        unsure = np.where(compared, variance / seen.variance, unsure)
        sure = compared & (unsure < SURE) & (white.unknown < KNOWN * white.noise**2)
        learnt = colour.learnt(seen.colour, seen.left, white.unknown, sure, self.period)
        if colour.due(learnt, self.period):
            learnt = colour.doubting(learnt, variance - seen.variance, sure, self.period)
        if np.count_nonzero(white.unknown > doubt.LITTLE * variance):
            told = doubt.learnt(learnt.doubt, white.doubted, residual, variance, self.period)
            learnt = changed(learnt, doubt=told)
        return unsure, learnt

    def _taken(self, supposed: Supposed[S], u: RobotSlice) -> tuple[Array, Array]:
        """How far parameters and slow noise are doubted against one another, and that alone, (J,).

        In [A²].
        """
        at, belief = np.r_[self.currents.places["slow"]], self.filter.belief(supposed.before)
        u = self.currents.near(u, supposed.mean, supposed.carried)
        H, slow = linearised(self.model, belief.mean, u)[1], belief.cov[:, at]
        both, alone = np.vecdot(H, slow.T), slow[at].diagonal()
        return np.maximum(alone - both, 0.0), alone


def _jumping(u: RobotSlice, what: Befallen | None) -> RobotSlice:
    """The slice at which something befell the arm; None: something else may be carried."""
    if what is None:
        return replace(u, widen=True)
    jolted = what.drives.astype(float) if what.drives.any() else None
    return replace(u, widen=what.payload is not None, jolted=jolted, wears=what.wears)
