"""The arm as a clock: stamps that scatter are corrected by the arm's own motion.

A client that polls a robot and stamps rows by a computer's clock is late by a millisecond or two,
now more and now less. Angles, velocities and currents of a row belong together and are right; its
stamp t_n + e_n is not. At 20 Hz, 2 ms are 2 mrad of a joint at 1 rad/s, and accelerations derived
from such stamps are noise. From row to row

    tau_n = median over joints of dq_n / v_n, by weights |v_n|

is the time that passed, to a tenth of a millisecond, and exposes the stamps: where they scatter,
tau minus their step changes sign from step to step, for each e_n makes one step longer and the
next one shorter; a velocity's lag or a curved motion does not. Least squares combine both clocks,

    sum (t'_{n+1} - t'_n - tau_n)² / s_n²  +  sum (t'_n - t_n)² / s²,

in which the stamps prevent drift, and an arm at rest adds nothing.
"""

from __future__ import annotations

import numpy as np

from urdyn.io.clock import gaps
from urdyn.types import MAD_TO_SD, Array, Mask

SCATTER = 3e-4  # [s] sd of a stamp: less is lost in the velocities' noise at 100 Hz
SHARE = 0.5  # [-] of the variance of both clocks' differences per step, that has to be scatter
MOVING = 0.1  # [rad/s] of the quickest joint, below which an arm is no clock
ANGLE, VELOCITY, BENT = 1e-4, 2e-3, 1e-4  # [rad], [rad/s], [s] sd: angle, velocity, curved motion
WILD = 5.0  # [sd] beyond which a step shows a jump of an angle, not of a stamp
FEWEST = 50  # steps needed to judge the stamps
BLOCK = 2**18  # rows at a time: memory never holds the log twice


def scattered(t: Array, q: Array, v: Array) -> Array | None:
    """Stamps (N,) [s] by both clocks; None where there is no sign that those of the log scatter.

    Args:
        t: stamps (N,) [s], increasing.
        q, v: angles and velocities (N, J) [rad], [rad/s]; NaN where not measured.
    """
    dt = np.diff(t)
    usual = float(np.median(dt))
    if _spread(dt - usual) < SCATTER:
        return None
    steps = [slice(k, k + BLOCK + 1) for k in range(0, len(dt), BLOCK)]
    passed, speed = map(np.concatenate, zip(*(_told(q[s], v[s]) for s in steps), strict=True))
    beside = passed - dt
    moves = np.isfinite(beside) & (speed > MOVING) & ~gaps(t)[1:]
    if np.count_nonzero(moves) < FEWEST:
        return None
    off = beside - np.median(beside[moves])
    moves &= np.abs(off) < WILD * _spread(off[moves])
    scatter = _scatter(off, moves)
    if scatter < SCATTER:
        return None
    doubt = np.hypot(
        BENT, np.hypot(np.sqrt(2.0) * ANGLE, VELOCITY * usual) / np.maximum(speed, MOVING)
    )
    put = _together(t, beside, np.where(moves, (scatter / doubt) ** 2, 0.0))
    return put if (np.diff(put) > 0.0).all() else None


def _told(q: Array, v: Array) -> tuple[Array, Array]:
    """Time that passed from row to row [s], and the quickest joint's speed [rad/s]; (N - 1,)."""
    mean, moved = 0.5 * (v[1:] + v[:-1]), np.diff(q, axis=0)
    weight = np.where(np.isfinite(moved * mean), np.abs(mean), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(weight > 0.0, moved / mean, np.inf)
    order = np.argsort(each, axis=1)
    below = np.cumsum(np.take_along_axis(weight, order, axis=1), axis=1)
    middle = np.argmax(below >= 0.5 * below[:, -1:], axis=1)[:, None]
    told = np.take_along_axis(each, np.take_along_axis(order, middle, axis=1), axis=1)
    return np.where(np.isfinite(told), told, np.nan)[:, 0], weight.max(axis=1)


def _scatter(off: Array, moves: Mask) -> float:
    """Standard deviation [s] of errors that alternate; 0 where they are a small part of `off`."""
    both = moves[1:] & moves[:-1]
    alike = -float(np.mean(off[1:][both] * off[:-1][both])) if both.any() else 0.0
    whole = float(np.mean(off[moves] ** 2))
    return float(np.sqrt(alike)) if 2.0 * alike > SHARE * whole else 0.0


def _spread(x: Array) -> float:
    """Standard deviation by the median, robust to outliers."""
    return MAD_TO_SD * float(np.median(np.abs(x)))


def _together(t: Array, beside: Array, weight: Array) -> Array:
    """Least squares of both clocks, (N,).

    Args:
        beside: how much longer each step is by the arm's clock than by stamps, (N - 1,) [s].
        weight: of that relative to a stamp's; 0 where the arm is no clock.
    """
    from scipy.linalg import solveh_banded  # heavy, and seldom needed

    step = np.where(weight > 0.0, beside, 0.0) * weight
    diagonal = 1.0 + np.append(weight, 0.0) + np.append(0.0, weight)
    banded = np.stack([np.append(0.0, -weight), diagonal])
    return np.asarray(t + solveh_banded(banded, np.append(0.0, step) - np.append(step, 0.0)))
