"""An instant's currents compared with the hypothesis about the arm, as the filter's input."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from urdyn.dbn.joined import Joined
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.dbn.two_slice import linearised
from urdyn.estimate import Filter, Innovation
from urdyn.estimate.protocol import S
from urdyn.model.drive import Drive
from urdyn.signal import Instant
from urdyn.tracking.noise import colour, variance_scale
from urdyn.tracking.noise.colour import Colour
from urdyn.tracking.noise.robust_noise import with_robust_noise
from urdyn.tracking.step.abrupt_changes import AbruptChange
from urdyn.tracking.step.change_detection import Hypothesis
from urdyn.tracking.step.joint_motion import JointMotion
from urdyn.types import Array, changed

SURE = 2.0  # [-] variance of an innovation over its noise's, below which it shows the noise
KNOWN = 0.25  # [-] variance due to uncertain motion, over the noise's: likewise


@dataclass(frozen=True, eq=False)
class WhitenedResiduals:
    """An instant's currents minus the model's, (J,) each, whitened."""

    measured: Array  # [A]; NaN where they are not compared
    modelled: Array  # [A] without the noise
    residual: Array  # [A] before whitening
    y: Array  # [A] after it, with the parameters' part added back: the filter's observation
    white: RobotSlice  # the whitened inputs
    robust: RobotSlice  # the same, with more noise where a current is an outlier
    colour: Colour  # of the noise, with this instant in its past


@dataclass(frozen=True, eq=False)
class ResidualWhitener(Generic[S]):
    """Compares currents with a hypothesis, with a tracker's settings."""

    filter: Filter[S]
    model: Joined[RobotSlice]
    currents: RobotCurrents  # the model's observation
    drive: Drive
    period: float  # [s] nominal, between samples

    def inputs(
        self,
        now: Instant,
        motion: JointMotion,
        hypothesis: Hypothesis[S],
        about: Array,
        span: float,
    ) -> RobotSlice:
        """The model's inputs, about the states `about` (n,), which move over `span` [s]."""
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
        """The currents compared with the hypothesis, whitened.

        `variance_ratio` is the last innovations' variance over their noise's, (J,).
        """
        mean, past = hypothesis.mean, hypothesis.start.colour
        measured = np.where(motion.comparable, now.current, np.nan)
        per_unit = self.currents.per_unit(mean, u)
        modelled = np.vecdot(per_unit, u.packed)
        residual = measured - modelled
        packed = self.currents.instrumental(u, now)
        y = residual + np.vecdot(per_unit, packed)
        lost = motion.comparable & np.isnan(now.current)
        packed, y, sd, noise = colour.whitened(past, packed, y, lost)
        if colour.due(noise, self.period):
            noise = colour.giving_back(noise, *self._taken(hypothesis, u), self.period)
        white = u.filtered(packed, sd, noise.slow, noise.variance_scale.scale)
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
        """Next `variance_ratio`, (J,), and the noise's colour, after an innovation."""
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
        """What parameters absorb of slow noise, and the variance of that noise alone, (J,).

        In [A²].
        """
        at, belief = np.r_[self.currents.places["slow"]], self.filter.belief(hypothesis.belief)
        u = self.currents.near(u, hypothesis.mean, hypothesis.payload)
        H, slow = linearised(self.model, belief.mean, u)[1], belief.cov[:, at]
        both, alone = np.vecdot(H, slow.T), slow[at].diagonal()
        return np.maximum(alone - both, 0.0), alone


def _jumping(u: RobotSlice, change: AbruptChange | None) -> RobotSlice:
    """The slice in which a change happens; None: the payload may have changed."""
    if change is None:
        return replace(u, widen=True)
    jolted = change.drives.astype(float) if change.drives.any() else None
    return replace(u, widen=change.payload is not None, jolted=jolted, wears=change.wears)
