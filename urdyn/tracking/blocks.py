"""The modes that are quicker than the full covariance, and what they assume for it.

*Simplified*: what is believed of the rigid bodies (k, skew, m, payload), what scales their torque
(z, gain) and the one warmth coefficient of all joints (kappa_f), and of each joint's drive, are
independent of one another, in every slice. Each block learns from the currents as if the others'
doubt were noise, which it is not where two explain the same: health stands beside the bodies, for a
load that is held weighs more or its drive gives less. One block of 72 states and J of 9 replace one
of 126.

*Realtime*: besides, a block that hardly changes waits. While an innovation would move it by little,
samples are added up, and it learns from their sum: less often the surer it is, at once where the
currents surprise. What varies within the wait is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import log
from typing import Protocol, runtime_checkable

import numpy as np

from urdyn.dbn.measurement import LinearMeasurement
from urdyn.dbn.robot import BODIES
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.dbn.two_slice import TwoSlice, linearised
from urdyn.estimate import Innovation
from urdyn.estimate.innovation import innovation, measured_rows, whitening
from urdyn.estimate.linearised import propagated
from urdyn.tracking.model import STRIDE
from urdyn.tracking.waiting import Waiting, nothing_waits
from urdyn.types import Array, Gaussian, Index, changed

CALM = 1.5  # [-] of the innovations' average size, where 1 is expected
WILDEST = 10.0  # [-] that one sample counts for at most
LASTING = 2.0  # [s] in which what others are wrong by is the same, until the motion has changed
TINY = 1e-6  # [s] after which there is another sample
MEMORY = 50.0  # samples over which the innovations' size is averaged
SHARED = -1
TOGETHER = (*BODIES, "z", "gain", "kappa_f")  # groups of the block that all joints share


@dataclass(frozen=True, eq=False)
class BlockBelief:
    """Mean of all states, and the covariances of blocks."""

    mean: Array  # (n,)
    bodies: Array  # (b, b)
    drives: Array  # (J, d, d)
    at_bodies: Index  # (b,) states of the bodies
    at_drives: Index  # (J, d) states of each joint's drive
    for_bodies: Waiting
    for_drives: Waiting
    variance_ratio: Array  # (J,) [-] variance by the blocks over the noise's, when last learnt
    surprise: float  # [-]

    @property
    def sd(self) -> Array:
        """Standard deviations, (n,)."""
        variance = np.empty_like(self.mean)
        variance[self.at_bodies] = self.bodies.diagonal()
        variance[self.at_drives] = np.diagonal(self.drives, axis1=1, axis2=2)
        return np.sqrt(variance)

    def with_belief(self, of: Gaussian) -> BlockBelief:
        """With what is believed of all states, but for what is across blocks."""
        bodies, drives, step = self.at_bodies, self.at_drives, of.mean - self.mean
        return replace(
            self,
            mean=of.mean,
            bodies=of.cov[np.ix_(bodies, bodies)],
            drives=of.cov[drives[:, :, None], drives[:, None, :]],
            for_bodies=self.for_bodies.nearer(step),
            for_drives=self.for_drives.nearer(step),
        )


@runtime_checkable
class Delaying(Protocol):
    """A filter that may put off the parameters' process noise, and add it up, by itself."""

    @property
    def delays(self) -> bool:
        """Whether it does."""


@dataclass(frozen=True)
class Blocks:
    """Filter of independent blocks, linearised; `longest` 1: simplified, more: realtime."""

    longest: int = 1  # samples that a block may wait for

    @property
    def delays(self) -> bool:
        """Whether its blocks wait, and move when they learn."""
        return self.longest > 1

    def init(self, model: TwoSlice[RobotSlice]) -> BlockBelief:
        """The model's prior without what is across blocks."""
        bodies, drives = places(model.names)
        P, J = model.prior.cov, len(drives)
        wait = nothing_waits(J, len(model.names))
        return BlockBelief(
            mean=model.prior.mean,
            bodies=P[np.ix_(bodies, bodies)],
            drives=P[drives[:, :, None], drives[:, None, :]],
            at_bodies=bodies,
            at_drives=drives,
            for_bodies=wait,
            for_drives=wait,
            variance_ratio=np.zeros(J),
            surprise=1.0,
        )

    def step(
        self,
        model: TwoSlice[RobotSlice],
        state: BlockBelief,
        u: RobotSlice | LinearMeasurement,
        y: Array,
    ) -> tuple[BlockBelief, Innovation]:
        """Add the sample up, and learn where enough have gathered; from measurements, at once."""
        if isinstance(u, LinearMeasurement):
            return _heard(state, u, y)
        if u.widen:  # what waits is of the payload before
            bodies, drives = replace(state.for_bodies, count=0), replace(state.for_drives, count=0)
            state = replace(state, for_bodies=bodies, for_drives=drives)
        x = model.transition(state.mean, u)
        expected, H = linearised(model, x, u)
        R, residual = model.observe_cov(u).diagonal(), y - expected
        told = _innovation(residual, R * (1.0 + state.variance_ratio))
        if told.measured < len(y):
            known = np.isfinite(y)
            H, R, residual = H * known[:, None], R * known, np.where(known, residual, 0.0)
        size = min(told.nis / max(told.measured, 1), WILDEST)
        surprise = state.surprise + (size - state.surprise) * (told.measured > 0) / MEMORY
        state = changed(
            state,
            mean=x,
            surprise=surprise,
            for_bodies=state.for_bodies.added(H, residual, R, u),
            for_drives=state.for_drives.added(H, residual, R, u),
        )
        return self._learnt(model, state, u, surprise < CALM and not _changes(u)), told

    def _learnt(
        self, model: TwoSlice[RobotSlice], state: BlockBelief, u: RobotSlice, calm: bool
    ) -> BlockBelief:
        """Each block, if it has waited long enough."""
        bodies, drives = state.for_bodies, state.for_drives
        for_bodies = bodies.count >= bodies.interval or not calm
        for_drives = drives.count >= drives.interval or not calm
        if for_bodies and _moves(u, bodies):
            state = _bodies_moved(model, state, u)
        if for_drives and _moves(u, drives):
            state = _drives_moved(model, state, u)
        of_both = None
        if for_bodies:
            of_both = _doubted(state, bodies)
            state = _bodies_learnt(state, of_both, calm, self.longest)
        if for_drives:
            if of_both is None or bodies.count != drives.count:  # not the same samples
                of_both = _doubted(state, drives)
            state = _drives_learnt(state, of_both, calm, self.longest)
        return state

    def belief(self, state: BlockBelief) -> Gaussian:
        """With nothing across blocks."""
        bodies, drives = state.at_bodies, state.at_drives
        P = np.zeros((len(state.mean),) * 2)
        P[np.ix_(bodies, bodies)] = state.bodies
        P[drives[:, :, None], drives[:, None, :]] = state.drives
        return Gaussian(state.mean, P)

    def shifted(self, state: BlockBelief, by: Array) -> BlockBelief:
        """The same about states that have all moved by known amounts, (n,), as of the next sample.

        What waits was measured before, and says of the states then what it said.
        """
        return replace(state, mean=state.mean + by)

    def with_belief(self, state: BlockBelief, belief: Gaussian) -> BlockBelief:
        """With this belief, but for what is across blocks."""
        return state.with_belief(belief)


@lru_cache(maxsize=8)
def places(names: tuple[str, ...]) -> tuple[Index, Index]:
    """States of the bodies (b,), and of each joint's drive (J, d), by their names."""
    of: dict[int, list[int]] = {}
    for k, name in enumerate(names):
        group, _, number = name.removesuffix(".rate").rpartition("_")
        joint = SHARED if group in TOGETHER else int(number)
        of.setdefault(joint, []).append(k)
    return np.array(of.pop(SHARED)), np.array([of[j] for j in sorted(of)])


@dataclass(frozen=True, eq=False)
class Doubted:
    """A sum beside what both blocks leave in doubt of it."""

    HP: Array  # (J, b) its covariance with the bodies
    gain: Array  # (J, d) and with each joint's own drive
    by_bodies: Array  # (J, J) [A²] its variance by the bodies' doubt
    by_drives: Array  # (J,) [A²] and by each drive's
    noise: Array  # (J,) [A²] 1 where there is none, so that it can be inverted
    lasting: float  # of how many such sums the others' doubt is one and the same


def _doubted(state: BlockBelief, wait: Waiting) -> Doubted:
    at = state.at_drives
    Hb, Hd = wait.H.take(state.at_bodies, axis=1), wait.H[np.arange(len(at))[:, None], at]
    HP, gain = Hb @ state.bodies, (state.drives @ Hd[:, :, None])[:, :, 0]
    noise = np.where(wait.R > 0.0, wait.R, 1.0)
    lasting = max(1.0, LASTING / max(wait.dt, TINY))  # which noise is not
    return Doubted(
        HP=HP,
        gain=gain,
        by_bodies=HP @ Hb.T,
        by_drives=np.vecdot(gain, Hd),
        noise=noise,
        lasting=lasting,
    )


def _bodies_moved(model: TwoSlice[RobotSlice], state: BlockBelief, u: RobotSlice) -> BlockBelief:
    """The bodies' doubt after the time since it was last moved."""
    wait, at = state.for_bodies, state.at_bodies
    passed, block = replace(u, span=wait.still), (at[:, None], at)
    F = model.transition_jacobian(state.mean, passed)[block]
    P = propagated(F, state.bodies) + model.transition_cov(passed)[block]
    return replace(state, bodies=P, for_bodies=replace(wait, still=0.0))


def _drives_moved(model: TwoSlice[RobotSlice], state: BlockBelief, u: RobotSlice) -> BlockBelief:
    """The same of every joint's drive."""
    wait, at = state.for_drives, state.at_drives
    passed, block = replace(u, span=wait.still), (at[:, :, None], at[:, None, :])
    F = model.transition_jacobian(state.mean, passed)[block]
    P = F @ state.drives @ F.swapaxes(1, 2) + model.transition_cov(passed)[block]
    return replace(state, drives=P, for_drives=replace(wait, still=0.0))


def _bodies_learnt(state: BlockBelief, of: Doubted, calm: bool, longest: int) -> BlockBelief:
    """Kalman's correction of the bodies by all that waits for them."""
    wait, own = state.for_bodies, of.by_bodies.diagonal()
    K = of.HP.T @ np.linalg.inv(of.by_bodies + np.diag(of.lasting * of.by_drives + of.noise))
    mean = state.mean.copy()
    mean[state.at_bodies] += K @ wait.residual
    return changed(
        state,
        mean=mean,
        bodies=state.bodies - K @ of.HP,
        for_bodies=wait.done(own, calm, longest),
        variance_ratio=(own + of.by_drives) / of.noise,
    )


def _drives_learnt(state: BlockBelief, of: Doubted, calm: bool, longest: int) -> BlockBelief:
    """The same of every joint's drive."""
    wait, gain = state.for_drives, of.gain
    W = np.linalg.inv(of.lasting * of.by_bodies + np.diag(of.by_drives + of.noise))
    mean = state.mean.copy()
    mean[state.at_drives] += gain * (W @ wait.residual)[:, None]
    P = state.drives - (W.diagonal()[:, None] * gain)[:, :, None] * gain[:, None, :]
    return changed(state, mean=mean, drives=P, for_drives=wait.done(of.by_drives, calm, longest))


def _heard(state: BlockBelief, u: LinearMeasurement, y: Array) -> tuple[BlockBelief, Innovation]:
    """Kalman's correction of the bodies by what somebody else tells of them."""
    P, at = state.bodies.copy(), np.searchsorted(state.at_bodies, u.at)
    P[at, at] += u.jump**2
    HP = u.H @ P[at]
    S = HP[:, at] @ u.H.T + u.R
    W, log_det = whitening(S)
    K, residual = HP.T @ (W.T @ W), y - u.H @ state.mean[u.at]
    step = np.zeros_like(state.mean)
    step[state.at_bodies] = K @ residual
    P = P - K @ HP
    after = replace(
        state,
        mean=state.mean + step,
        bodies=0.5 * (P + P.T),
        for_bodies=state.for_bodies.nearer(step),
        for_drives=state.for_drives.nearer(step),
    )
    return after, innovation(y, slice(None), residual, S, W, log_det)


def _moves(u: RobotSlice, wait: Waiting) -> bool:
    """Whether it is time that a block moved."""
    return wait.still >= STRIDE or _changes(u)


def _changes(u: RobotSlice) -> bool:
    """Whether the arm changes abruptly here, or may have."""
    return u.taken is not None or u.widen or u.jolted is not None


def _innovation(residual: Array, variance: Array) -> Innovation:
    """As each joint's current alone expects it: what they have in common is left out."""
    rows = measured_rows(residual)
    few = variance[rows]
    W, log_det = np.diag(1.0 / np.sqrt(few)), sum(map(log, few.tolist()))
    return innovation(residual, rows, residual[rows], np.diag(few), W, log_det)
