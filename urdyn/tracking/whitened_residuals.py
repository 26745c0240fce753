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
from urdyn.tracking import colour, variance_scale
from urdyn.tracking.abrupt_changes import AbruptChange
from urdyn.tracking.change_detection import Hypothesis
from urdyn.tracking.colour import Colour
from urdyn.tracking.joint_motion import JointMotion
from urdyn.tracking.robust_noise import with_robust_noise
from urdyn.types import Array, changed

S = TypeVar("S")

SURE = 2.0  # [-] variance of an innovation over its noise's: less, and it tells of the noise
KNOWN = 0.25  # [-] variance by what nobody knows of the motion, over the noise's: likewise


@dataclass(frozen=True, eq=False)
class WhitenedResiduals:
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
class ResidualWhitener(Generic[S]):
    """Compares currents with what is supposed, by a tracker's settings."""

    filter: Filter[S]
    model: Joined[RobotSlice]
    currents: RobotCurrents  # its observation
    drive: Drive
    period: float  # [s] between samples, as a rule

    def inputs(
        self,
        now: Instant,
        motion: JointMotion,
        hypothesis: Hypothesis[S],
        about: Array,
        span: float,
    ) -> RobotSlice:
        """What the motion makes of the parameters, about these (n,), which move over `span` [s]."""
        s = motion.presliding(self.drive)
        u = self.currents.inputs(now, s, motion.passed, about, motion.lubricant, span)
        if hypothesis.fresh:
            return _jumping(u, hypothesis.what)
        return u if hypothesis.taken is None else replace(u, taken=hypothesis.taken)

    def seen(
        self,
        now: Instant,
        motion: JointMotion,
        hypothesis: Hypothesis[S],
        u: RobotSlice,
        variance_ratio: Array,
    ) -> WhitenedResiduals:
        """The currents beside what is supposed, by the filter that makes their noise white.

        `variance_ratio` is the last innovations' variance over their noise's, (J,).
        """
        mean, past = hypothesis.mean, hypothesis.was.colour
        measured = np.where(motion.comparable, now.current, np.nan)
        per_unit = self.currents.per_unit(mean, u)
        modelled = np.vecdot(per_unit, u.packed)
        left = measured - modelled
        through = self.currents.instrumental(u, now)
        current = left + np.vecdot(per_unit, through)
        through, current, noise = colour.whitened(past, through, current)
        if colour.due(noise, self.period):
            noise = colour.giving_back(noise, *self._taken(hypothesis, u), self.period)
        white = u.filtered(through, noise.scale, noise.slow, noise.variance_scale.scale)
        white = self.currents.near(white, mean, hypothesis.carried)
        variance = white.noise**2 + white.unknown
        wild = left - colour.foreseen(past, mean[self.currents.places["slow"]])
        given = (
            white if hypothesis.anew else with_robust_noise(white, wild, variance, variance_ratio)
        )
        return WhitenedResiduals(
            measured=measured,
            modelled=modelled,
            left=left,
            current=current,
            white=white,
            given=given,
            variance=variance,
            colour=noise,
        )

    def noise(
        self, seen: WhitenedResiduals, innovation: Innovation, variance_ratio: Array
    ) -> tuple[Array, Colour]:
        """The noise after an innovation: next `variance_ratio`, (J,), and the noise's colour."""
        white, residual = seen.white, innovation.residual
        compared, variance = np.isfinite(residual), innovation.cov.diagonal()
        variance_ratio = np.where(compared, variance / seen.variance, variance_ratio)
        sure = compared & (variance_ratio < SURE) & (white.unknown < KNOWN * white.noise**2)
        learnt = colour.learnt(seen.colour, seen.left, white.unknown, sure, self.period)
        if colour.due(learnt, self.period):
            learnt = colour.doubting(learnt, variance - seen.variance, sure, self.period)
        if np.count_nonzero(white.unknown > variance_scale.LITTLE * variance):
            told = variance_scale.updated(
                learnt.variance_scale, white.doubted, residual, variance, self.period
            )
            learnt = changed(learnt, variance_scale=told)
        return variance_ratio, learnt

    def _taken(self, hypothesis: Hypothesis[S], u: RobotSlice) -> tuple[Array, Array]:
        """How far parameters and slow noise are doubted against one another, and that alone, (J,).

        In [A²].
        """
        at, belief = np.r_[self.currents.places["slow"]], self.filter.belief(hypothesis.before)
        u = self.currents.near(u, hypothesis.mean, hypothesis.carried)
        H, slow = linearised(self.model, belief.mean, u)[1], belief.cov[:, at]
        both, alone = np.vecdot(H, slow.T), slow[at].diagonal()
        return np.maximum(alone - both, 0.0), alone


def _jumping(u: RobotSlice, what: AbruptChange | None) -> RobotSlice:
    """The slice at which something befell the arm; None: something else may be carried."""
    if what is None:
        return replace(u, widen=True)
    jolted = what.drives.astype(float) if what.drives.any() else None
    return replace(u, widen=what.payload is not None, jolted=jolted, wears=what.wears)
