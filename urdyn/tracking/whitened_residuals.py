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
    """An instant's currents less what the model expects, (J,) each, with their noise made white."""

    measured: Array  # [A]; NaN where they are not compared
    modelled: Array  # [A] whatever the noise does
    residual: Array  # [A] before the noise is made white
    y: Array  # [A] after that: the filter's observation, the parameters' part added again
    white: RobotSlice  # the inputs that belong to it
    robust: RobotSlice  # the same, with more noise where a current is an outlier
    colour: Colour  # of the noise, which has seen them


@dataclass(frozen=True, eq=False)
class ResidualWhitener(Generic[S]):
    """Compares currents with a hypothesis, by a tracker's settings."""

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
        u = self.currents.inputs(now, s, motion.passed, about, motion.end.lubricant, span)
        if hypothesis.resets:
            return _jumping(u, hypothesis.change)
        wider = hypothesis.widening
        return u if wider is None else replace(u, taken=wider)

    def whitened(
        self,
        now: Instant,
        motion: JointMotion,
        hypothesis: Hypothesis[S],
        u: RobotSlice,
        variance_ratio: Array,
    ) -> WhitenedResiduals:
        """The currents beside the hypothesis, by the filter that makes their noise white.

        `variance_ratio` is the last innovations' variance over their noise's, (J,).
        """
        mean, past = hypothesis.mean, hypothesis.start.colour
        measured = np.where(motion.comparable, now.current, np.nan)
        per_unit = self.currents.per_unit(mean, u)
        modelled = np.vecdot(per_unit, u.packed)
        residual = measured - modelled
        packed = self.currents.instrumental(u, now)
        y = residual + np.vecdot(per_unit, packed)
        packed, y, noise = colour.whitened(past, packed, y)
        if colour.due(noise, self.period):
            noise = colour.giving_back(noise, *self._taken(hypothesis, u), self.period)
        white = u.filtered(packed, noise.scale, noise.slow, noise.variance_scale.scale)
        white = robust = self.currents.near(white, mean, hypothesis.payload)
        unforeseen = residual - colour.foreseen(past, mean[self.currents.places["slow"]])
        if hypothesis.change is None:
            robust = with_robust_noise(white, unforeseen, variance_ratio)
        return WhitenedResiduals(
            measured=measured,
            modelled=modelled,
            residual=residual,
            y=y,
            white=white,
            robust=robust,
            colour=noise,
        )

    def noise(
        self, of: WhitenedResiduals, innovation: Innovation, variance_ratio: Array
    ) -> tuple[Array, Colour]:
        """The noise after an innovation: next `variance_ratio`, (J,), and the noise's colour."""
        white, residual = of.white, innovation.residual
        compared, variance = np.isfinite(residual), innovation.cov.diagonal()
        variance_ratio = np.where(compared, variance / white.variance, variance_ratio)
        sure = compared & (variance_ratio < SURE) & (white.unknown < KNOWN * white.power)
        learnt = colour.learnt(of.colour, of.residual, white.unknown, sure, self.period)
        if colour.due(learnt, self.period):
            learnt = colour.doubting(learnt, variance - white.variance, sure, self.period)
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
        at, belief = np.r_[self.currents.places["slow"]], self.filter.belief(hypothesis.belief)
        u = self.currents.near(u, hypothesis.mean, hypothesis.payload)
        H, slow = linearised(self.model, belief.mean, u)[1], belief.cov[:, at]
        both, alone = np.vecdot(H, slow.T), slow[at].diagonal()
        return np.maximum(alone - both, 0.0), alone


def _jumping(u: RobotSlice, change: AbruptChange | None) -> RobotSlice:
    """The slice at which a change happens; None: something else may be carried."""
    if change is None:
        return replace(u, widen=True)
    jolted = change.drives.astype(float) if change.drives.any() else None
    return replace(u, widen=change.payload is not None, jolted=jolted, wears=change.wears)
