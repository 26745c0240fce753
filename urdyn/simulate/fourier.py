"""Fourier excitation: all joints move all the time, over the whole band, periodically.

q(t) = middle + sum_k  A_k sin(k w t) + B_k cos(k w t)        [Swevers1997]_
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.simulate.limits import Limits, comfortable
from urdyn.simulate.trajectory import Trajectory, blocks, grid
from urdyn.types import Array, freeze

HARMONICS = 12
PERIOD = 20.0  # [s] approximate period of a run: gives 1 to 2 rad/s, up to 4 rad/s²
OVERSAMPLING = 64  # rows per period of the highest harmonic, at which limits are verified
BETWEEN = np.cos(np.pi / OVERSAMPLING)  # least share of a peak that such rows show [Ehlich1964]_
SHRINK, SHRINKS = 0.85, 12  # [-] of the excursion, and tries, until the torque is low enough


@dataclass(frozen=True, eq=False)
class Series:
    """A finite Fourier series of joint angles."""

    middle: Array  # (J,) [rad]
    sine: Array  # (H, J) [rad], A
    cosine: Array  # (H, J) [rad], B
    period: float  # [s]

    def __post_init__(self) -> None:
        freeze(self, "middle", "sine", "cosine")

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """q, v, a at times (N,) [s], each (N, J)."""
        w = 2.0 * np.pi / self.period * np.arange(1, len(self.sine) + 1)
        s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        return (
            self.middle + s @ self.sine + c @ self.cosine,
            (c * w) @ self.sine - (s * w) @ self.cosine,
            -(s * w**2) @ self.sine - (c * w**2) @ self.cosine,
        )

    @property
    def lasting(self) -> float:
        """Time after which it repeats [s]."""
        return self.period

    def peaks(self) -> tuple[Array, Array, Array]:
        """Bounds of |v|, |a| and |jerk|, (J,) each: [Ehlich1964]_, and Bernstein's inequality."""
        _, v, a = (np.abs(x).max(axis=0) / BETWEEN for x in self.one_period())
        return v, a, 2.0 * np.pi / self.period * len(self.sine) * a

    def one_period(self) -> tuple[Array, Array, Array]:
        """q, v, a over a period, finely enough to miss little between the rows."""
        rows = OVERSAMPLING * len(self.sine)
        return self.at(np.linspace(0.0, self.period, rows, endpoint=False))

    def scaled(self, share: Array | float) -> Series:
        """Excursions about the middle times `share`, (J,) or one for all [-]."""
        return replace(self, sine=self.sine * share, cosine=self.cosine * share)


def fourier(
    arm: Arm,
    duration: float,
    rate: float,
    rng: np.random.Generator,
    period: float = PERIOD,
) -> Trajectory:
    """Random excitation of `duration` [s] at `rate` [Hz] that keeps `comfortable` limits.

    The period is adjusted to divide the run, which starts and ends at rest; `arm` includes its
    payload (`with_inertials`) where torque limits are to count it.
    """
    t = grid(duration, rate)
    repeats = max(1, round(float(t[-1]) / period))
    series = series_within(arm, draw(arm.joints, float(t[-1]) / repeats, rng, HARMONICS))
    motion = np.empty((3, len(t), arm.joints))
    for rows in blocks(len(t)):
        motion[:, rows] = series.at(t[rows])
    return Trajectory(t, *motion)


def draw(joints: int, period: float, rng: np.random.Generator, harmonics: int) -> Series:
    """A random series about zero, with zero velocity and acceleration at whole periods."""
    if harmonics < 2:
        raise InputError(f"{harmonics} harmonics cannot start from rest; ask for two or more")
    k = np.arange(1.0, harmonics + 1.0)[:, None]
    # Amplitudes fall as 1/k: every harmonic has the same share of the velocity.
    sine, cosine = rng.standard_normal((2, harmonics, joints)) / k
    return Series(np.zeros(joints), *at_rest(sine, cosine), period)


def at_rest(sine: Array, cosine: Array) -> tuple[Array, Array]:
    """The closest coefficients, (H, ...) each, with zero initial velocity and acceleration."""
    k = np.arange(1.0, len(sine) + 1.0).reshape(-1, *[1] * (sine.ndim - 1))
    # v(0) = w sum k A_k and a(0) = -w² sum k² B_k.
    return (
        sine - k * (k * sine).sum(axis=0) / (k**2).sum(),
        cosine - k**2 * (k**2 * cosine).sum(axis=0) / (k**4).sum(),
    )


def series_within(arm: Arm, shape: Series, limits: Limits | None = None) -> Series:
    """`shape` about the middle of the limits, each joint scaled until it reaches one of them."""
    limits = comfortable(arm) if limits is None else limits
    q, v, a = (np.abs(x).max(axis=0) for x in shape.one_period())
    share = np.minimum.reduce([limits.room / q, limits.velocity / v, limits.acceleration / a])
    series = replace(shape, middle=limits.middle).scaled(BETWEEN * share)
    for _ in range(SHRINKS):
        if limits.hold(arm, *series.one_period()):
            return series
        series = series.scaled(SHRINK)
    raise InputError(
        f"{arm.name} cannot hold itself around its middle pose; take a lighter payload"
    )
