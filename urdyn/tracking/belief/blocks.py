"""The modes that are faster than the full covariance, and what they assume for that.

*Simplified*: joints' drives are independent of one another, given the states they share: the rigid
bodies (k, skew, m, payload), the torque scales (z, gain), the one warmth coefficient of all joints
(kappa_f) and the states of a force sensor. With b for these and d_j for a drive,

    p(b, d) = p(b) prod_j p(d_j | b),    d_j - m_j | b ~ N(G_j (b - m_b), V_j)

A joint's current depends on b and its own drive alone. So a measurement leaves the other drives'
conditionals given b unchanged, and nothing is lost; only the drift of b makes drives dependent,
through what b has forgotten. After each time step the belief is projected onto that form, as in
[Boyen1998]_. For b alone, a current has the regressor H_b + H_d G_j and the noise R + H_d V_j H_dᵀ.
So J blocks of 9 states and one of 72 replace a covariance of 126 by 126.

*Realtime*: besides, a joint whose current tells little waits. While an innovation would move the
belief by little, its samples are summed and learnt from together: less often the surer the belief
is, at once where currents surprise. What varies within the wait is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import log

import numpy as np

from urdyn.dbn.measurement import LinearMeasurement
from urdyn.dbn.robot import BODIES
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.dbn.two_slice import TwoSlice, linearised
from urdyn.estimate import Innovation
from urdyn.estimate.innovation import Rows, innovation, measured_rows, whitening
from urdyn.estimate.linearised import predict
from urdyn.tracking.belief.waiting import Waiting, nothing_waits
from urdyn.types import Array, Gaussian, Index, Mask, changed

CALM = 1.5  # [-] of the innovations' average size, where 1 is expected
WILDEST = 10.0  # [-] what one sample counts for at most
MEMORY = 50.0  # samples over which the innovations' size is averaged
WAIT = 0.16  # [s] for which a joint waits at most: what varies meanwhile is lost
SELDOM = 1.2  # [s] between predictions of the covariance: the memory of slow noise, the fastest
ROUNDING = 1e-10  # [-] of a variance: what is smaller is taken for 0
SHARED = -1
TOGETHER = (*BODIES, "z", "gain", "kappa_f", "sensor")  # groups that all joints share


@dataclass(frozen=True, eq=False)
class BlockBelief:
    """Belief in the shared states, and in each drive given those."""

    mean: Array  # (n,) of all states
    shared: Array  # (b, b) covariance of the shared states
    led: Array  # (J, d, b) G, regression of each drive's states on the shared ones
    drives: Array  # (J, d, d) V, covariance of each drive's states given the shared ones
    at_shared: Index  # (b,)
    at_drives: Index  # (J, d)
    wait: Waiting
    still: float  # [s] since the covariance was last predicted
    variance_ratio: Array  # (J,) [-] of a current by this belief over the noise's, when last learnt
    surprise: float  # [-]

    @property
    def sd(self) -> Array:
        """Standard deviations, (n,)."""
        variance = np.empty_like(self.mean)
        variance[self.at_shared] = self.shared.diagonal()
        own = np.diagonal(self.drives, axis1=1, axis2=2)
        variance[self.at_drives] = own + np.vecdot(self.led @ self.shared, self.led)
        return np.sqrt(variance)

    @property
    def cov(self) -> Array:
        """Covariance of all states, (n, n)."""
        J, d, b = self.led.shape
        G, P = self.led.reshape(-1, b), np.empty((len(self.mean),) * 2)
        GP, each = G @ self.shared, np.arange(J)
        own = GP @ G.T
        own.reshape(J, d, J, d)[each, :, each] += self.drives
        P[:b, :b], P[b:, :b], P[:b, b:], P[b:, b:] = self.shared, GP, GP.T, own
        back = np.argsort(np.concatenate([self.at_shared, self.at_drives.ravel()]))
        return P[back[:, None], back]

    def with_belief(self, of: Gaussian) -> BlockBelief:
        """With this belief, without the dependence between drives beyond the shared states."""
        common, own = self.at_shared, self.at_drives
        P, C = of.cov[common[:, None], common], of.cov[own[:, :, None], common]
        G = _following(P, C)
        V = of.cov[own[:, :, None], own[:, None, :]] + (G @ P - 2.0 * C) @ G.mT
        return replace(
            self,
            mean=of.mean,
            shared=P,
            led=G,
            drives=0.5 * (V + V.mT),
            wait=self.wait.nearer(of.mean - self.mean),
        )


@dataclass(frozen=True)
class Blocks:
    """Filter of drives given the shared states; `longest` 1: simplified, more: realtime."""

    longest: int = 1  # samples that a joint may wait for, where they take no longer than WAIT

    def init(self, model: TwoSlice[RobotSlice]) -> BlockBelief:
        """The model's prior, without the dependence between drives beyond the shared states."""
        shared, drives = places(model.names)
        J, d = drives.shape
        nothing = BlockBelief(
            mean=model.prior.mean,
            shared=np.zeros((len(shared),) * 2),
            led=np.zeros((J, d, len(shared))),
            drives=np.zeros((J, d, d)),
            at_shared=shared,
            at_drives=drives,
            wait=nothing_waits(J, len(model.names)),
            still=0.0,
            variance_ratio=np.zeros(J),
            surprise=1.0,
        )
        return nothing.with_belief(model.prior)

    def step(
        self,
        model: TwoSlice[RobotSlice],
        state: BlockBelief,
        u: RobotSlice | LinearMeasurement,
        y: Array,
    ) -> tuple[BlockBelief, Innovation]:
        """Add the sample up; learn where enough have gathered, from measurements at once."""
        if isinstance(u, LinearMeasurement):
            return _heard(state, u, y)
        if changes := _changes(u):
            state = replace(state, wait=state.wait.hurried())
        if u.widen:  # what waits was measured with the payload before
            state = replace(state, wait=state.wait.emptied())
        x = model.transition(state.mean, u)
        expected, H = linearised(model, x, u)
        R, residual = model.observe_cov(u).diagonal(), y - expected
        told = _innovation(residual, R * (1.0 + state.variance_ratio))
        if told.measured < len(y):
            known = np.isfinite(y)
            H, R, residual = H * known[:, None], R * known, np.where(known, residual, 0.0)
        size = min(told.nis / max(told.measured, 1), WILDEST)
        surprise = state.surprise + (size - state.surprise) * (told.measured > 0) / MEMORY
        wait, still = state.wait.added(H, residual, R), state.still + u.span
        state = changed(state, mean=x, surprise=surprise, wait=wait, still=still)
        calm = surprise < CALM and not changes
        if still >= SELDOM or changes:
            state = _moved(model, state, u)
        due, longest = wait.due(calm), self._longest(u.dt) if calm else 1
        return _learnt(state, due, longest) if due.any() else state, told

    def _longest(self, dt: float) -> int:
        """Samples that a joint may wait for, where they are dt [s] apart."""
        return max(1, int(min(self.longest, WAIT / dt))) if dt else self.longest

    def belief(self, state: BlockBelief) -> Gaussian:
        """Belief in all states."""
        return Gaussian(state.mean, state.cov)

    def shifted(self, state: BlockBelief, by: Array) -> BlockBelief:
        """The belief once all states have moved by known amounts, (n,), as of the next sample.

        Waiting samples were measured before, and their residuals stay as they were.
        """
        return replace(state, mean=state.mean + by)

    def with_belief(self, state: BlockBelief, belief: Gaussian) -> BlockBelief:
        """With this belief, without the dependence between drives beyond the shared states."""
        return state.with_belief(belief)


@lru_cache(maxsize=8)
def places(names: tuple[str, ...]) -> tuple[Index, Index]:
    """Indices, by name, of the states that joints share (b,) and of each joint's drive (J, d)."""
    of: dict[int, list[int]] = {}
    for k, name in enumerate(names):
        group, _, number = name.removesuffix(".rate").rpartition("_")
        joint = SHARED if group in TOGETHER else int(number)
        of.setdefault(joint, []).append(k)
    return np.array(of.pop(SHARED)), np.array([of[j] for j in sorted(of)])


def _following(P: Array, C: Array) -> Array:
    """G = C P⁻¹, (J, d, b), of C (J, d, b); exactly known or redundant states are harmless."""
    sd = np.sqrt(P.diagonal())
    scale = np.where(sd > 0.0, sd, 1.0)
    R = P / scale / scale[:, None]
    R.flat[:: len(R) + 1] = 1.0 + ROUNDING
    G = np.linalg.solve(R, (C / scale).reshape(-1, len(P)).T).T / scale
    return np.asarray(G.reshape(C.shape))


def _moved(model: TwoSlice[RobotSlice], state: BlockBelief, u: RobotSlice) -> BlockBelief:
    """The belief with its covariance predicted to now; the mean has moved already."""
    moved = predict(model, Gaussian(state.mean, state.cov), replace(u, span=state.still))
    return replace(state.with_belief(Gaussian(state.mean, moved.cov)), still=0.0)


def _learnt(state: BlockBelief, due: Mask, longest: int) -> BlockBelief:
    """Kalman update by the waiting samples of the joints that are due, (J,)."""
    rows: Rows = slice(None) if due.all() else np.flatnonzero(due)
    wait, at, P, G = state.wait, state.at_drives[rows], state.shared, state.led
    H, residual = wait.H[rows], wait.residual[rows]
    Hd = H[np.arange(len(at))[:, None], at]
    h = H.take(state.at_shared, axis=1) + (Hd[:, None] @ G[rows])[:, 0]
    VH = (state.drives[rows] @ Hd[:, :, None])[:, :, 0]
    R, own, hP = wait.R[rows], np.vecdot(VH, Hd), h @ P
    S, noise = hP @ h.T, R + own  # covariance, and noise, of currents as the shared states see them
    share = (S.diagonal() + own) / R
    S.flat[:: len(S) + 1] += noise
    K, gain = hP.T @ np.linalg.inv(S), VH / noise[:, None]
    common = K @ residual
    drives = G @ common
    drives[rows] += gain * (residual - h @ common)[:, None]
    step = np.empty_like(state.mean)
    step[state.at_shared], step[state.at_drives] = common, drives
    led, V, ratio = G.copy(), state.drives.copy(), state.variance_ratio.copy()
    led[rows] -= gain[:, :, None] * h[:, None]
    V[rows] -= gain[:, :, None] * VH[:, None]
    ratio[rows] = share / wait.count[rows]
    return changed(
        state,
        mean=state.mean + step,
        shared=P - K @ hP,
        led=led,
        drives=V,
        wait=wait.learnt(rows, share, longest).nearer(step),
        variance_ratio=ratio,
    )


def _heard(state: BlockBelief, u: LinearMeasurement, y: Array) -> tuple[BlockBelief, Innovation]:
    """Kalman update of the shared states by another stream's measurement."""
    if np.count_nonzero(u.jump):  # the drives did not jump with it
        P = state.cov
        P[u.at, u.at] += u.jump**2
        state = state.with_belief(Gaussian(state.mean, P))
    at = np.searchsorted(state.at_shared, u.at)
    HP = u.H @ state.shared[at]
    S = HP[:, at] @ u.H.T + u.R
    W, log_det = whitening(S)
    K, residual = HP.T @ (W.T @ W), y - u.H @ state.mean[u.at]
    step, common = np.empty_like(state.mean), K @ residual
    step[state.at_shared], step[state.at_drives] = common, state.led @ common
    P = state.shared - K @ HP
    P, wait = 0.5 * (P + P.T), state.wait.nearer(step)
    after = replace(state, mean=state.mean + step, shared=P, wait=wait)
    return after, innovation(y, slice(None), residual, S, W, log_det)


def _changes(u: RobotSlice) -> bool:
    """Whether the arm changes abruptly here, or may have."""
    return u.taken is not None or u.widen or u.jolted is not None


def _innovation(residual: Array, variance: Array) -> Innovation:
    """The innovation by each joint's own variance: correlation between joints is left out."""
    rows = measured_rows(residual)
    few = variance[rows]
    W, log_det = np.diag(1.0 / np.sqrt(few)), sum(map(log, few.tolist()))
    return innovation(residual, rows, residual[rows], np.diag(few), W, log_det)
