"""A link that flies through its gear's gap, while the motor keeps to its path.

Where the load reverses at t0 the link is released, and it meets the other flank at T, when

    integral u dt = 2 b,    u = integral load / M_jj dt        from t0 on

Until then the current lacks the load; then the link strikes, and an impulse M_jj u comes back. How
the loop returns it is unknown, except roughly how long it takes. Nor is the instant known: an error
of the load by a share of its friction shifts its reversal by some hundredths of a second, so each
gap is weighed at several instants. The strike shakes the angles, and with them the estimated load:
shares of the load, its slope and its curvature are uncertain, and what they explain is no gap.

Accelerations are told from some hundredths of a second. Where a program's jumps, the current would
first lack, then exceed the load computed from them, like one whose link flies. So the current is
averaged as they are before it is compared, and so is what a gap would take from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import correlate1d

from urdyn.diagnose.fast.crossing import SHARES, WILD, correlated, white
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.space import Space
from urdyn.signal import Causal
from urdyn.signal.polynomial import averaging
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Array, Mask

FLIGHTS = 2.5e-4 * np.sqrt(2.0) ** np.arange(10)  # [rad] half gaps tested for
BRIEF, LONG = 0.03, 0.3  # [s] of flights: accelerations resolve no briefer, programs no longer
STRIKES = np.array([0.07, 0.03])  # [s] in which the missing impulse comes back: one or the other
STRIKE = float(STRIKES.max())
LATE = 0.005  # [s] after the strike, less an acceleration window's lead, when it begins to
MARGIN = 0.04  # [s] before a flight and after its end, judged with it
# [s] that a reversal is late: two models of a real arm are up to .06 s apart, mostly .01 to .04.
DELAYS = np.array([-0.06, -0.03, 0.0, 0.03, 0.06])
PRIOR = -0.5 * (DELAYS / 0.04) ** 2  # log of their probability
PRIOR -= np.logaddexp.reduce(PRIOR)
REACH = LONG + LATE + STRIKE + MARGIN + DELAYS.max()  # [s] after a reversal
KNOWN = (0.3, 0.01, 1e-3)  # sd of the share of the load [-], its slope [s], its curvature [s²]
FREE = 1e3  # [A] and [A/s], sd of an unknown level and slope
TOGETHER = 0.01  # [s] of rows that count as one: their means' noise is nearly white
# [-] of the current's noise, counted besides: the average is not quite the acceleration's.
UNLIKE = 0.3
ENOUGH, TORN = 10, 3.0  # rows needed; periods that one step may take


@dataclass(frozen=True, eq=False)
class Flight:
    """Likelihood of each gap, if the link flies through it at a reversal."""

    space: Space
    period: float  # [s] between rows

    def weigh(
        self, rows: Rows, after: Array, load: Array, left: Array, j: int, tool: Array
    ) -> tuple[Array, Array]:
        """Log likelihood ratios of the gaps, and their expected values, (gaps,) [nats].

        Args:
            after: time since the reversal, (N,) [s].
            load: of joint j, (N,) [N·m].
            left: residual of its current, (N,) [A].
            tool: inertials carried, (10,).
        """
        nothing = np.zeros(len(FLIGHTS))
        start, stop = (int(i) for i in np.searchsorted(after, [-LONG, REACH]))
        rows = rows.part(start, stop)
        after, load, left = after[start:stop], load[start:stop], left[start:stop]
        row = int(np.searchsorted(after, 0.0, side="right"))
        if len(after) < ENOUGH or np.diff(after).max() > TORN * self.period:
            return nothing, nothing
        side = np.sign(load[row])
        if not _firm(after, side * load):
            return nothing, nothing
        mass = self._mass(rows.q[row], j, tool)
        if not mass > 0.0:
            return nothing, nothing
        left = left - rows.current[:, j] + self.averaged(rows.current[:, j])
        beside = self._beside(rows, load, left, j)
        at_zero = np.interp(DELAYS, after, load)
        each = [
            self._delayed(beside, after - late, side * (load - zero), mass, side)
            for late, zero in zip(DELAYS, at_zero, strict=True)
        ]
        llr, shown = np.swapaxes(each, 0, 1)
        return np.logaddexp.reduce(llr + PRIOR[:, None]), np.exp(PRIOR) @ shown

    @property
    def _many(self) -> int:
        """Number of rows that count as one."""
        return max(1, round(TOGETHER / self.period))

    @cached_property
    def _average(self) -> Array:
        """What each row weighs in an acceleration, (m,)."""
        return averaging(Causal(self.period).fit, self.space.reference.drive.time_offset)

    def averaged(self, x: Array) -> Array:
        """x (..., N), averaged as accelerations are."""
        return np.asarray(correlate1d(x, self._average, mode="nearest"))

    @cached_property
    def _alike(self) -> Array:
        """Autocovariance of means of `_many` averaged rows, 0, 1 .. of them apart, (n, J) [A²]."""
        mean = np.full(self._many, 1.0 / self._many)
        apart = self._many * np.arange(round((REACH + LONG) / TOGETHER))
        reach = apart[-1] + len(self._average) + 2 * self._many
        noise = self.space.covariance(int(reach), self.period)

        def told(weights: Array) -> Array:
            pairs = np.correlate(weights, weights, "full")
            lag = np.arange(len(pairs)) - len(pairs) // 2
            return np.asarray(np.tensordot(pairs, noise[np.abs(lag + apart[:, None])], (0, 1)))

        return told(np.convolve(self._average, mean)) + UNLIKE * told(mean)

    def _mass(self, q: Array, j: int, tool: Array) -> float:
        """Inertia of all that hangs on joint j, about its axis, M_jj [kg·m²]."""
        arm, still = self.space.arm, np.zeros(len(q))
        inertials = arm.inertials.copy()
        inertials[-1] += tool
        return float(arm.torque_derivatives(q, still, still, inertials)[2][j, j])

    def _beside(self, rows: Rows, load: Array, left: Array, j: int) -> Beside:
        """The content of a joint's current around a reversal."""
        K = self.space.reference.drive.gain[j]
        slope = np.gradient(load, self.period)
        known = np.stack([load, slope, np.gradient(slope, self.period)], axis=1) * KNOWN / K
        finite = np.isfinite(left + load)
        return Beside(left, rows.doubt[:, j], known, np.abs(rows.v[:, j]), finite, float(K), j)

    def _delayed(
        self, beside: Beside, after: Array, load: Array, mass: float, side: float
    ) -> tuple[Array, Array]:
        """Log likelihood ratios of the gaps, and their expected values, (gaps,) [nats].

        Args:
            after: time since the load reversed, (N,) [s].
            load: toward the flank that the link flies to, (N,) [N·m].
            mass: inertia of the link [kg·m²].
            side: sign of that flank.
        """
        llr, shown = np.zeros((2, len(FLIGHTS)))
        row = int(np.searchsorted(after, 0.0, side="right"))
        came = _arrived(after[:row], -load[:row])
        u, x = _flown(after, load)
        for k, gap in enumerate(2.0 * FLIGHTS):
            there = int(np.argmax((x >= mass * gap) | (x < 0.0)))
            if not min(came, x[there]) >= mass * gap:  # it never arrived, or fell back
                continue
            T = float(after[there] - (x[there] - mass * gap) / u[there])
            if BRIEF < T < LONG:
                gone = load * ((after > 0.0) & (after < T))
                lacking = u[there] * _strikes(after - T) - gone
                llr[k], shown[k] = self._weigh(beside, after, side * lacking, T=T)
        return llr, shown

    def _weigh(self, beside: Beside, after: Array, lacking: Array, T: float) -> tuple[float, float]:
        """Log likelihood ratio of one gap, and its expected value [nats].

        Args:
            lacking: torque missing in the model, for each strike, (strikes, N) [N·m].
            T: when the link arrives, after its release [s].
        """
        still = (after > 0.0) & ~(beside.speed > STANDING)  # then it is held by friction
        end = min(T + LATE + STRIKE + MARGIN, float(after[still].min(initial=np.inf)))
        at = (after > -MARGIN) & (after < end)
        many = self._many
        if at.sum() < ENOUGH * many or not end > T + LATE + 0.5 * STRIKE:
            return 0.0, 0.0
        if not (beside.speed[at].min() > STANDING and beside.finite[at].all()):
            return 0.0, 0.0
        ways = len(lacking)
        free = FREE * np.stack([np.ones(len(after)), after])
        gone = self.averaged(lacking / beside.gain)
        said = beside.doubt, beside.left, gone, free, beside.known.T
        doubt, *means = _means(np.vstack(said)[:, at].T, many).T
        causes = np.transpose(means[1 + ways :])
        noise = correlated(self._alike[:, beside.joint], len(doubt)) + np.diag(doubt**2)
        rows = white(np.transpose(means[: 1 + ways]), noise + causes @ causes.T).T
        llr, shown = _told(rows[0], rows[1:])
        return float(_mean(llr)), float(shown.mean())


@dataclass(frozen=True, eq=False)
class Beside:
    """The content of a joint's current around a reversal, apart from a gap."""

    left: Array  # (N,) [A] residual
    doubt: Array  # (N,) [A] sd of the bristles' unknown part
    known: Array  # (N, 3) [A] sd of shares of the load, its slope and its curvature
    speed: Array  # (N,) [rad/s]
    finite: Mask  # (N,) all of it is known
    gain: float  # [N·m/A]
    joint: int


def _told(r: Array, x: Array) -> tuple[Array, Array]:
    """Log likelihood ratios of each of x (k, n) in r (n,), and their means for a lesser share.

    Against white noise, (k,) both.
    """
    n = len(r) - 2.0  # the level and the slope are free
    power = _power(r - np.reshape([0.0, *SHARES], (-1, 1, 1)) * x)
    each = _likelihood(power, n)
    louder = np.maximum(1.0, power.min(axis=0) / n)  # the model's residual just here
    shown = 0.5 * n * np.log1p(_power(min(SHARES) * x) / (n * louder))
    return _mean(each[1:] - each[0]), np.asarray(shown)


def _mean(llr: Array) -> Array:
    """Log of the mean of likelihood ratios given by logarithms, over the first axis."""
    return np.asarray(np.logaddexp.reduce(llr) - np.log(len(llr)))


def _means(rows: Array, many: int) -> Array:
    """Means of `many` rows each, (N // many, ...): noise that rows share is not counted in each."""
    whole = len(rows) // many
    return np.asarray(rows[: whole * many].reshape(whole, many, -1).mean(axis=1))


def _power(r: Array) -> Array:
    return np.asarray(np.minimum(r * r, WILD**2).sum(axis=-1))


def _likelihood(power: Array, n: float) -> Array:
    """Log-likelihood with the noise variance fitted, but no less than usual."""
    louder = np.maximum(1.0, power / n)
    return np.asarray(-0.5 * power / louder - 0.5 * n * np.log(louder))


def _firm(after: Array, load: Array) -> bool:
    """Whether the load was on the other side just before: noise about zero is no reversal."""
    before = load[(after > -MARGIN) & (after < 0.0)]
    return len(before) > 1 and bool((before < 0.0).all())


def _arrived(after: Array, load: Array) -> float:
    """The link's travel since the load's previous reversal, times M [kg·m²·rad].

    Where that is less than a gap the link is on no flank, but somewhere unknown.
    """
    since = len(load) - int(np.argmax((load <= 0.0)[::-1])) if (load <= 0.0).any() else 0
    dt = np.diff(after[since:], append=0.0)
    return float(np.sum(np.cumsum(load[since:] * dt) * dt))


def _flown(after: Array, load: Array) -> tuple[Array, Array]:
    """Velocity and travel of a link released at 0, (N,), both times its inertia."""
    dt = np.diff(np.maximum(after, 0.0), prepend=0.0)
    u = np.cumsum(load * dt)
    return u, np.cumsum(u * dt)


def _strikes(after: Array) -> Array:
    """Return of a unit impulse within each of STRIKES, (strikes, N) [1/s]."""
    z = (after - LATE) / STRIKES[:, None] + 0.5
    inside = (z > 0.0) & (z < 1.0)
    return np.where(inside, 2.0 / STRIKES[:, None] * np.sin(np.pi * z) ** 2, 0.0)
