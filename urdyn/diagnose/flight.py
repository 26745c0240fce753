"""A link that flies through the gap of its gear, while the motor keeps to its path.

Where the load turns over at t0 the link is let go, and the other flank has it again at T, when

    integral u dt = 2 b,    u = integral load / M_jj dt        from t0 on

Until then the current lacks the load; then the link strikes, and M_jj u of it come back at once.
How the loop gives that back is not known, only about how long it takes. The strike shakes the
angles, and with them what the load is thought to be: shares of the load, of its slope and of its
bend are uncertain, and nothing is taken for a gap that they explain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from urdyn.diagnose.crossing import SHARES, WILD
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.space import Space
from urdyn.tracking.passage import STANDING
from urdyn.types import Array

FLIGHTS = 2.5e-4 * np.sqrt(2.0) ** np.arange(10)  # [rad] half gaps that are looked for
BRIEF, LONG = 0.03, 0.3  # [s] that flights last: accelerations tell no briefer, programs no longer
STRIKE = 0.07  # [s] in which what was lacking comes back
LATE = 0.005  # [s] after the strike that it begins to, less what a window of accelerations is early
MARGIN = 0.04  # [s] before a flight and after its end, that are judged with it
REACH = LONG + LATE + STRIKE + MARGIN  # [s] after a reversal
KNOWN = (0.3, 0.01, 1e-3)  # sd of the share of the load [-], its slope [s], its bend [s²]
FREE = 1e3  # [A] and [A/s], sd of a level and a slope of which nothing is known
TOGETHER, CORRELATED = 0.008, 0.2  # [s] of rows that count as one; share of noise that is left
ENOUGH, TORN = 10, 3.0  # rows; periods that one step may take


@dataclass(frozen=True, eq=False)
class Flight:
    """Likelihood of each gap, were it one that the link flies through at a reversal."""

    space: Space
    period: float  # [s] between rows

    def weigh(
        self, rows: Rows, after: Array, load: Array, left: Array, j: int, tool: Array
    ) -> tuple[Array, Array]:
        """Log likelihood ratios of the gaps, and what they would be, (gaps,) [nats].

        Args:
            after: time since the reversal, (N,) [s].
            load: of joint j, (N,) [N·m].
            left: of its current by the model, (N,) [A].
            tool: inertials that are carried, (10,).
        """
        llr, shown = np.zeros((2, len(FLIGHTS)))
        start, stop = (int(i) for i in np.searchsorted(after, [-LONG, REACH]))
        rows = rows.part(start, stop)
        after, load, left = after[start:stop], load[start:stop], left[start:stop]
        row = int(np.searchsorted(after, 0.0, side="right"))
        if len(after) < ENOUGH or np.diff(after).max() > TORN * self.period:
            return llr, shown
        side = np.sign(load[row])
        if not _firm(after, side * load):
            return llr, shown
        mass = self._mass(rows.q[row], j, tool)
        if not mass > 0.0:
            return llr, shown
        came = _arrived(after[:row], -side * load[:row])
        u, x = _flown(after, side * load)
        for k, gap in enumerate(2.0 * FLIGHTS):
            there = int(np.argmax((x >= mass * gap) | (x < 0.0)))
            if not min(came, x[there]) >= mass * gap:  # it never arrived, or fell back
                continue
            T = float(after[there] - (x[there] - mass * gap) / u[there])
            if BRIEF < T < LONG:
                struck = side * u[there] * _strike(after - T)
                lacking = struck - load * ((after > 0.0) & (after < T))
                llr[k], shown[k] = self._weigh(
                    rows, after, load=load, left=left, j=j, T=T, lacking=lacking
                )
        return llr, shown

    def _mass(self, q: Array, j: int, tool: Array) -> float:
        """Inertia of all that hangs on joint j, about its axis, M_jj [kg·m²]."""
        arm, still = self.space.arm, np.zeros(len(q))
        inertials = arm.inertials.copy()
        inertials[-1] += tool
        return float(arm.torque_derivatives(q, still, still, inertials)[2][j, j])

    def _weigh(
        self, rows: Rows, after: Array, load: Array, left: Array, j: int, T: float, lacking: Array
    ) -> tuple[float, float]:
        """Log likelihood ratio of one gap, and what it would show [nats].

        Args:
            T: when the link arrives, after it was let go [s].
            lacking: torque that the model does not know of, (N,) [N·m].
        """
        still = (after > 0.0) & ~(np.abs(rows.v[:, j]) > STANDING)  # then it is held by friction
        end = min(T + LATE + STRIKE + MARGIN, float(after[still].min(initial=np.inf)))
        at = (after > -MARGIN) & (after < end)
        moving = np.abs(rows.v[at, j]).min() > STANDING and end > T + LATE + 0.5 * STRIKE
        if not moving or not np.isfinite(left[at] + load[at]).all():
            return 0.0, 0.0
        many = max(1, round(TOGETHER / self.period))
        if at.sum() < ENOUGH * many:
            return 0.0, 0.0
        K, noise = self.space.reference.drive.gain[j], self.space.noise[j]
        slope = np.gradient(load, self.period)
        known = np.stack([load, slope, np.gradient(slope, self.period)], axis=1)[at] * KNOWN / K
        free = FREE * np.stack([np.ones(at.sum()), after[at]], axis=1)
        columns = np.column_stack([left[at], lacking[at] / K, rows.doubt[at, j], free, known])
        columns = _means(columns, many)
        quiet = noise * np.sqrt(CORRELATED + (1.0 - CORRELATED) / many)
        columns /= np.hypot(quiet, columns[:, 2:3])
        r, x = _whitened(columns[:, 3:], columns[:, 0], columns[:, 1])
        return _told(r, x)


def _told(r: Array, x: Array) -> tuple[float, float]:
    """Log likelihood ratio of x in r beside white noise, and what a lesser share would show."""
    n = len(r) - 2.0  # the level and the slope are free
    power = [_power(r - c * x) for c in (0.0, *SHARES)]
    each = [_likelihood(p, n) - _likelihood(power[0], n) for p in power[1:]]
    louder = max(1.0, min(power) / n)  # what the model leaves just here
    shown = 0.5 * n * np.log1p(_power(min(SHARES) * x) / (n * louder))
    return float(logsumexp(each) - np.log(len(SHARES))), float(shown)


def _means(rows: Array, many: int) -> Array:
    """Of so many rows each, (N // many, ...): what few rows have in common is no news in each."""
    whole = len(rows) // many
    return np.asarray(rows[: whole * many].reshape(whole, many, -1).mean(axis=1))


def _whitened(N: Array, *rows: Array) -> Array:
    """What is white of rows of white noise and of causes with columns N, sd 1: I + N N'."""
    U, d, _ = np.linalg.svd(N, full_matrices=False)
    y = np.array(rows)
    return np.asarray(y - (y @ U * (1.0 - 1.0 / np.hypot(1.0, d))) @ U.T)


def _power(r: Array) -> float:
    return float(np.sum(np.clip(r, -WILD, WILD) ** 2))


def _likelihood(power: float, n: float) -> float:
    """Log of it, where noise is at least as loud as usual, and otherwise as loud as it is."""
    louder = max(1.0, power / n)
    return float(-0.5 * power / louder - 0.5 * n * np.log(louder))


def _firm(after: Array, load: Array) -> bool:
    """Whether the load was on the other side just before: noise about zero is no reversal."""
    before = load[(after > -MARGIN) & (after < 0.0)]
    return len(before) > 1 and bool((before < 0.0).all())


def _arrived(after: Array, load: Array) -> float:
    """How far the link has come since the load last turned over before this, times M [kg·m²·rad].

    Where that is less than a gap the link is on no flank, and nobody knows where.
    """
    since = len(load) - int(np.argmax((load <= 0.0)[::-1])) if (load <= 0.0).any() else 0
    dt = np.diff(after[since:], append=0.0)
    return float(np.sum(np.cumsum(load[since:] * dt) * dt))


def _flown(after: Array, load: Array) -> tuple[Array, Array]:
    """Velocity and way of a link that was let go at 0, (N,), both times its mass."""
    dt = np.diff(np.maximum(after, 0.0), prepend=0.0)
    u = np.cumsum(load * dt)
    return u, np.cumsum(u * dt)


def _strike(after: Array) -> Array:
    """How an impulse of one comes back, (N,) [1/s]."""
    z = (after - LATE) / STRIKE + 0.5
    inside = (z > 0.0) & (z < 1.0)
    return np.where(inside, 2.0 / STRIKE * np.sin(np.pi * z) ** 2, 0.0)
