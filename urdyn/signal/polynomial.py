"""Local polynomial: least squares on the angles and velocities of one window.

Within a window the angle is a polynomial of time, q(t) = Σ c_k P_k(x), x = (t - centre) / s with
Legendre's P_k and s half the window's nominal length, so that |x| <= 1. It is fitted jointly to

    q_n   = Σ c_k P_k(x_n)      and      s v_n = Σ c_k P_k'(x_n)

Both rows are in radians and have the same weight, for their noises are alike: on a UR10e 50 µrad
and 40 ms times 2 mrad/s. Without velocities on uniform stamps this is the filter of
[Savitzky1964]_.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np
from numpy.polynomial import legendre

from urdyn.errors import InputError
from urdyn.given import given_count, given_number
from urdyn.types import Array, Mask, frozen

REACH, REACH_ALONE = 0.036, 0.1  # [s] to each side, the latter without velocities: `half_window`
REACH_BACK = 0.2  # [s] that the instrument looks back: it follows up to 6 Hz, and none beyond 10
HIGHEST = 12  # degree; rounding in its powers is below 1e-11 of the result
ORDERS = 4  # what is estimated: angle, velocity, acceleration, jerk
# Stamps this close to uniform count as uniform: at 500 Hz and 3 rad/s it makes 6e-9 rad, three
# orders below an encoder's count, and it is above the rounding of an uptime in seconds.
UNIFORM = 1e-6  # [-] of a step


def half_window(step: float, degree: int = 4, velocities: bool = True) -> int:
    """Samples to each side: 2 from 20 to 50 Hz, 4 at 100 and at 125, 18 at 500.

    For point-to-point moves with 15 ms of jerk limit, 2 mrad/s of noise in the velocity and an
    encoder's count in the angle, 30 to 40 ms is about the best for the acceleration at 100, 125
    and 500 Hz alike: .13, .10 and .08 rad/s² RMS. Angles alone, whose noise in recordings is 50
    µrad, take three times as long for as little: 3 to each side at 20 and 25 Hz, 10 at 100.

    It is never so short that nothing is smoothed: the angles alone determine the polynomial, and
    more of them where there are no velocities. Three samples with both would leave one spare
    equation; at 20 Hz, real angles then gave .1 rad/s² of noise, and jerks of noise alone.
    """
    least = (degree + 1) // 2 if velocities else degree // 2 + 1
    return max(least, round((REACH if velocities else REACH_ALONE) / step))


def instrument_half(half: int, degree: int, step: float) -> int:
    """Half the samples of the instrument's window, which ends `half` samples after its row.

    It follows programs, and not vibrations: bodies are rigid only below an arm's first elastic
    mode, and what shakes a real UR10e takes two to three times the current per acceleration. Where
    its shoulder pan alone moves, that passed for 17 to 33 % of health, by 6 to 9 standard
    deviations, and by two of three twins where its lift does, for a load of 1.1 and 1.2 kg; now for
    2 %, and for .3 kg at most.
    """
    return max(half, (degree + 1) // 2, ceil((half + REACH_BACK / step) / 2))


@dataclass(frozen=True)
class LocalPolynomial:
    """How a window becomes an estimate: its half length, the degree, and the usual step."""

    half: int  # [samples] to each side of the window's centre
    degree: int  # of the polynomial in time, 3 to HIGHEST
    step: float  # [s] between samples, as a rule

    def __post_init__(self) -> None:
        takes = f"a whole number from 3, for there is a jerk to tell, to {HIGHEST}"
        orders = np.arange(3.0, HIGHEST + 1.0)
        degree = given_number(self.degree, "degree", takes, lambda x: np.isin(x, orders))
        object.__setattr__(self, "half", given_count(self.half, "half_window"))
        object.__setattr__(self, "degree", int(degree))
        if self.degree >= 2 * self.samples:
            most = f"{self.samples} angles and velocities tell {2 * self.samples - 1} at the most"
            raise InputError(f"degree {self.degree}: {most}; widen half_window {self.half}")

    @property
    def samples(self) -> int:
        """Rows in a full window."""
        return 2 * self.half + 1

    def estimate(self, t: Array, q: Array, v: Array, at: Array) -> Array:
        """Angle, velocity, acceleration and jerk of n windows at `at`, (4, n, J) [rad/s^k].

        t (n, m) [s], q (n, m, J) [rad] and v (n, m, J) [rad/s] are the windows, at (n, J) [s] is
        on the axis of t. Rows that are NaN in the first joint weigh nothing; all joints of one
        window are measured in the same rows. NaN where too little is left.
        """
        s = self.half * self.step
        centre: Array = (t[:, :1] + t[:, -1:]) / 2
        A, y, determined = self._equations((t - centre) / s, q, v * s)
        G = A.mT @ A
        G[~determined] = np.eye(self.degree + 1)
        c = np.where(determined[:, None, None], np.linalg.solve(G, A.mT @ y), np.nan)
        return self._evaluate(c, (at - centre) / s) / s ** np.arange(ORDERS)[:, None, None]

    def _equations(self, x: Array, q: Array, r: Array) -> tuple[Array, Array, Mask]:
        """Design (n, 2m, P), right-hand sides (n, 2m, J), and which windows determine P terms."""
        angles, rates = self._orders(x, 2)
        A, y = np.concatenate([angles, rates], 1), np.concatenate([q, r], 1)
        known = np.isfinite(y)
        if known.all():
            return A, y, np.ones(len(x), dtype=bool)
        has_q, has_r = np.isfinite(q[..., 0]), np.isfinite(r[..., 0])
        A *= np.concatenate([has_q, has_r], 1)[..., None]
        return A, np.where(known, y, 0.0), self._determined(has_q, has_r)

    def _determined(self, has_q: Mask, has_r: Mask) -> Mask:
        """Windows in which enough is measured, (n,).

        Counting equations is not enough: angles at -1 and 1 with a velocity at 0 leave x² - 1
        free. Angles alone, velocities and one angle, or pairs of both always settle it.
        """
        angles, rates, pairs = (m.sum(1) for m in (has_q, has_r, has_q & has_r))
        by_rates = (angles > 0) & (rates >= self.degree)
        enough: Mask = (angles > self.degree) | by_rates | (2 * pairs > self.degree)
        return enough

    def _evaluate(self, c: Array, x: Array) -> Array:
        """Σ c_k P_k(x) and its first derivatives by x, (4, n, J); c (n, P, J), x (n, J)."""
        return np.asarray(np.einsum("knjp,npj->knj", self._orders(x, ORDERS), c))

    def _orders(self, x: Array, count: int) -> Array:
        """P_k and its first derivatives at x (n, m), (count, n, m, P)."""
        powers = np.empty((*x.shape, self.degree + 1))
        powers[..., 0] = 1.0
        for k in range(self.degree):
            np.multiply(powers[..., k], x, out=powers[..., k + 1])
        return np.asarray(powers @ derivatives(self.degree)[:count, None])


@lru_cache(maxsize=16)
def derivatives(degree: int) -> Array:
    """Coefficients of x^j in the k-th derivative of P_i, (4, P, P) by k, j, i."""
    each = [legendre.leg2poly([0] * i + [1]) for i in range(degree + 1)]
    P = np.array([np.pad(c, (0, degree + 1 - len(c))) for c in each]).T
    once = np.diag(np.arange(1.0, degree + 1), 1)
    return frozen([np.linalg.matrix_power(once, k) @ P for k in range(ORDERS)])


@lru_cache(maxsize=64)
def weights(fit: LocalPolynomial, at: float, velocities: bool = True) -> tuple[Array, Array]:
    """What each angle and each velocity of a uniform window weighs in each order: (4, m), (4, m).

    The estimate is linear in the data, so its weights are its answers to unit impulses. `at` [s]
    is the time from the window's centre; without velocities their weights are zero. White noise
    of variance σ² in the angles becomes (weights²).sum(1) σ².
    """
    m = fit.samples
    t = frozen(fit.step * (np.arange(m)[None] - fit.half))
    impulse, silence = np.eye(m)[None], np.zeros((1, m, m))
    when = np.full((1, m), at)
    if not velocities:
        of_q = fit.estimate(t, impulse, silence * np.nan, when)
        return frozen(of_q[:, 0]), frozen(np.zeros((ORDERS, m)))
    of_q, of_v = fit.estimate(t, impulse, silence, when), fit.estimate(t, silence, impulse, when)
    return frozen(of_q[:, 0]), frozen(of_v[:, 0])


@lru_cache(maxsize=64)
def averaging(fit: LocalPolynomial, at: float = 0.0) -> Array:
    """What the true acceleration in each row around a uniform window weighs in the estimate, (n,).

    The window has velocities. `at` [s]: from its centre to where the estimate is, as in `weights`;
    rows are counted from there, to as far beyond the window as it reaches from there. The sum is 1,
    for a constant acceleration is told as it is.
    """
    of_q, of_v = weights(fit, at)
    row, beyond = np.arange(fit.samples, dtype=np.float64), int(np.ceil(abs(at) / fit.step))
    told = np.arange(-beyond, fit.samples + beyond, dtype=np.float64)
    since = row[:, None] - told - at / fit.step + 0.5  # [rows] from where an acceleration sets in
    lasted, gone = np.maximum(since, 0.0), np.maximum(since - 1.0, 0.0)
    angle, rate = 0.5 * fit.step**2 * (lasted**2 - gone**2), fit.step * (lasted - gone)
    return frozen(of_q[2] @ angle + of_v[2] @ rate)


def joint_by_joint(t: Array, q: Array, v: Array, at: Array) -> tuple[Array, Array, Array, Array]:
    """n windows of J joints as n J windows of one joint, each with NaN in rows of its own."""
    n, m, J = q.shape
    q, v = (values.swapaxes(1, 2).reshape(n * J, m, 1) for values in (q, v))
    return np.repeat(t, J, axis=0), q, v, at.reshape(n * J, 1)
