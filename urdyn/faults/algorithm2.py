"""The paper's Algorithm 2 as written: a slope and a level, both beyond their thresholds.

    slope = (theta_t - theta_{t-k}) / k
    detected where slope > threshold_slope and theta_t > tau_w
    severity = (theta_t - tau_w) / (tau_c - tau_w)
    confidence = min(0.9, max(0.5, slope / ref_slope))
    time to failure = (tau_c - theta_t) / slope

It reads parameters as a filter estimates them; for a parameter that falls, such as health, all
signs are reversed. The paper does not say how to choose its thresholds: `tuned_algorithm2` derives
them from the commissioned baseline.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.errors import InputError
from urdyn.faults.detector import Verdict
from urdyn.faults.robust import level_and_spread
from urdyn.faults.whiten import measured
from urdyn.given import (
    fraction,
    given,
    given_count,
    given_number,
    given_promise,
    given_rows,
    given_step,
    given_streams,
    not_negative,
    positive,
)
from urdyn.types import Array, Mask, freeze, frozen

WINDOW = 10  # [steps] k
GAIN = 0.1  # [-] of the average that replaces the paper's filter where parameters are raw
THRESHOLDS = ("warning", "critical", "slope", "reference_slope")
ONE_WAY = "+1 where parameters rise, -1 where they fall"
OVERSHOOT = 0.583  # of a random walk over a boundary [Siegmund1985]_


@dataclass(frozen=True, eq=False)
class History:
    """The last k + 1 estimates."""

    theta: Array  # (k + 1, n) oldest first; NaN before the first

    def __post_init__(self) -> None:
        freeze(self, "theta")


@dataclass(frozen=True)
class Status:
    """Fault status of one parameter, in the paper's words."""

    detected: bool
    stream: int
    kind: str  # "friction_increase" and the like
    severity: float  # [-] 0 at the warning level, 1 at the critical one
    confidence: float  # [-] .5 to .9 by the formula, not a probability; NaN of too few estimates
    time_to_failure: float  # [steps] to the critical level, negative past it; inf: nothing grows


@dataclass(frozen=True, eq=False)
class Algorithm2:
    """Thresholds of n parameters; arrays (n,), or one for all."""

    warning: Array | float  # tau_w [unit]
    critical: Array | float  # tau_c [unit]
    slope: Array | float  # threshold_slope [unit/step]
    reference_slope: Array | float  # ref_slope [unit/step]
    window: int = WINDOW  # [steps] k
    gain: float = 1.0  # [-] of an average taken first; 1: the parameters are filtered already
    side: float = 1.0  # +1 where parameters rise to the critical level, -1 where they fall
    kind: str = "friction_increase"

    def __post_init__(self) -> None:
        for name in THRESHOLDS:
            object.__setattr__(self, name, frozen(given(getattr(self, name), name)))
        given(self.slope, "slope", "finite numbers, 0 or more", not_negative)
        given(self.reference_slope, "reference_slope", "a positive number", positive)
        self._fit_each_other()
        given_number(self.side, "side", ONE_WAY, _one_way)
        object.__setattr__(self, "window", given_count(self.window, "window"))
        given(self.gain, "gain", "a number above 0, and 1 at most", lambda x: (x > 0) & (x <= 1))
        if (self.side * (np.asarray(self.critical) - self.warning) <= 0.0).any():
            raise InputError(
                f"critical level {self.critical} is not beyond the warning level {self.warning}: "
                "severity has no scale"
            )

    def _fit_each_other(self) -> None:
        """InputError unless thresholds are of equally many streams, or of one for all."""
        size = {name: np.size(getattr(self, name)) for name in THRESHOLDS}
        if len(set(size.values()) - {1}) > 1:
            sizes = ", ".join(f"{name} {n}" for name, n in size.items())
            raise InputError(f"thresholds are of different numbers of streams: {sizes}")

    def init(self, streams: int) -> History:
        """No estimate yet."""
        streams = given_streams(streams)
        for name in THRESHOLDS:
            given(getattr(self, name), name, streams=streams)
        return History(np.full((self.window + 1, streams), np.nan))

    def step(self, state: History, observed: Array) -> tuple[History, Verdict]:
        """Judge estimates (n,) [unit]; where one is NaN the previous one is kept."""
        before = state.theta[-1]
        observed = given_step(observed, len(before))
        moved = np.where(np.isfinite(before), before + self.gain * (observed - before), observed)
        theta = np.vstack([state.theta[1:], np.where(np.isfinite(observed), moved, before)])
        after = History(theta)
        streams = self._detected(*self._slope_and_level(after)).astype(np.float64)
        kind = self.kind if streams.any() else ""
        return after, Verdict(float(streams.max()), streams, kind, np.nan)

    def acknowledged(self, state: History) -> History:
        """Keep the last estimate alone: the next alarm needs a new slope."""
        return replace(state, theta=np.vstack([np.full_like(state.theta[1:], np.nan),
                                               state.theta[-1:]]))  # fmt: skip

    @property
    def alone(self) -> str:
        """Its thresholds are in the parameters' units."""
        return "Algorithm 2 judges parameters, not innovations"

    def _slope_and_level(self, state: History) -> tuple[Array, Array]:
        """Slopes and excess over the warning level, (n,) each, positive toward the fault."""
        slope = self.side * (state.theta[-1] - state.theta[0]) / self.window
        return slope, self.side * (state.theta[-1] - np.asarray(self.warning))

    def _detected(self, slope: Array, over: Array) -> Mask:
        return np.asarray((slope > np.asarray(self.slope)) & (over > 0.0))

    def status(self, state: History) -> tuple[Status, ...]:
        """Status of each of the n parameters."""
        slope, over = self._slope_and_level(state)
        detected = self._detected(slope, over)
        severity = over / np.abs(np.asarray(self.critical) - np.asarray(self.warning))
        confidence = np.clip(slope / np.asarray(self.reference_slope), 0.5, 0.9)
        left = self.side * (np.asarray(self.critical) - state.theta[-1])
        time = np.where(slope > 0.0, left / np.where(slope > 0.0, slope, 1.0), np.inf)
        return tuple(
            Status(bool(detected[i]), i, self.kind, *map(float, numbers))
            for i, numbers in enumerate(zip(severity, confidence, time, strict=True))
        )


def tuned_algorithm2(
    healthy: Array,
    critical: Array | float,
    promise: float = 10_000.0,
    window: int = WINDOW,
    gain: float = GAIN,
    side: float = 1.0,
    kind: str = "friction_increase",
) -> Algorithm2:
    """Algorithm 2 with thresholds from healthy parameters as measured, (N, n) white around a level.

    The warning level is one that their average, an autoregression of 1 - gain, crosses once in
    `promise` steps over all streams [Siegmund1985]_, with a margin for the baseline's uncertainty;
    the slope's threshold is one sd of the slope.
    That promise holds for white noise alone: where .095 of healthy runs may alarm, 1.00 do under
    AR(.9), .92 under AR(.5), .8 with long tails or outliers, .41 where sigma is a fifth wider, .65
    where readings are rounded to steps of four sd.
    Where noise alone reaches `critical`, that level becomes 1 sd of the average past the warning.
    """
    given_promise(promise)
    window = given_count(window, "window")
    given_number(gain, "gain", "a number between 0 and 1", fraction)
    given_number(side, "side", ONE_WAY, _one_way)
    series = given_rows(healthy, "a baseline")
    fits = np.array([level_and_spread(measured(x, i)) for i, x in enumerate(series.T)])
    given(fits[:, 1], "spread of the baseline", "streams that move", positive)
    level, spread = fits.T
    average = spread * np.sqrt(gain / (2.0 - gain))
    kept = (1.0 - gain) ** window
    slope = average * np.sqrt(2.0 * (1.0 - kept)) / window
    reach = _learnt(
        crossing_level(promise * len(fits), gain), gain, np.isfinite(series).sum(axis=0)
    )
    warning = level + side * reach * average
    end = given(critical, "critical level", streams=len(fits))
    if (side * (end - level) <= 0.0).any():
        raise InputError(f"critical level {critical} is not beyond the healthy ones, {level}")
    beyond = side * (end - warning) > 0.0
    end = np.where(beyond, end, warning + side * average)
    return Algorithm2(warning, end, slope, 3.0 * slope, window, gain, side, kind)


def _learnt(z: float, gain: float, steps: Array) -> Array:
    """Level [sd of the average] crossed as rarely as z, when learnt from so many steps.

    The estimation variances of the level, (2 - gain) / (gain steps), and of the spread,
    z² / (2 steps), inflate z²: the rate, as exp(-z² / 2), is averaged over both.
    """
    return np.asarray(z * np.sqrt(1.0 + (2.0 - gain) / (gain * steps) + z**2 / (2.0 * steps)))


def _one_way(side: Array) -> Mask:
    return np.asarray(np.abs(side) == 1.0)


def crossing_level(promise: float, gain: float) -> float:
    """Level [sd] that an exponential average of white noise crosses once in `promise` steps."""

    from scipy.optimize import brentq  # slow to import, and detectors do not need it

    def excess(z: float) -> float:
        density = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
        rate = gain * z * density * np.exp(-OVERSHOOT * z * np.sqrt(2.0 * gain))
        return float(np.log(rate * promise))

    return float(brentq(excess, 1.0, 37.0)) if excess(1.0) > 0.0 else 1.0
