"""Ramps of eq. 5 in noise: our filter, the paper's, and the bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.bench.paper import LATE
from urdyn.bench.spread import reach, rms, scatter
from urdyn.estimate import follow_ramp, ramp_bound
from urdyn.simulate.paper import FRICTION_RATE, PAPER_GAIN, STEEPEST_FRICTION, WORN, Scenario, live
from urdyn.types import Array, Gaussian, Mask

RATIO = 1.3  # [-] of the bound, within which ramps are to be tracked
BIAS = 1e-3  # [A·s/rad] upper limit of late bias
CLEAR = 0.05  # [A·s/rad] noise up to which that limit applies
ONSETS = (10, 60)  # drawn uniformly between these, unknown to the filter


@dataclass(frozen=True)
class Ramps:
    """Errors over many lives; friction in A·s/rad."""

    sigma: float  # of a reading
    rmse: float
    paper_rmse: float  # of the paper's filter, as reconstructed
    bound: float  # for a filter that is told the onset
    bound_onset: float  # for one that has to estimate it
    bias: float  # mean error from the onset on
    bias_error: float  # its standard error over lives
    late_bias: float  # mean error from `LATE` steps after the onset on
    late_bias_error: float  # its standard error over lives
    paper_bias: float  # late bias of the paper's filter
    pairs: int  # of lives

    @property
    def ratio(self) -> float:
        """Error in units of the stricter bound."""
        return self.rmse / self.bound

    @property
    def honest(self) -> bool:
        """Near the bound, with a late bias not significantly beyond BIAS, at 95 % over lives."""
        sure = reach(self.pairs) * self.late_bias_error
        return self.ratio <= RATIO and (self.sigma > CLEAR or abs(self.late_bias) - sure < BIAS)


def ramps(sigma: float, lives: int, seed: int = 0) -> Ramps:
    """Lives of a joint at constant speed, whose level is known to `sigma` beforehand.

    In the bounds, the rate has the variance of the filter's prior. Every second life mirrors the
    noise of the previous one, so that the remaining mean error is bias.
    """
    rng, steepest = np.random.default_rng(seed), min(STEEPEST_FRICTION, 0.5 * sigma)
    found, theirs, bounds, wide, since = [], [], [], [], []
    for _ in range(lives // 2):
        onset, offset = int(rng.integers(*ONSETS)), sigma * rng.standard_normal()
        life = live(Scenario(sigma=sigma, onset=onset, motion="steady"), rng)
        truth = life.friction[:, WORN]
        noise = life.current[:, WORN] - truth - life.damping[:, WORN]
        for sign in (1.0, -1.0):
            y, believed = truth + sign * noise, truth[0] + sign * offset
            level = Gaussian(np.array([believed]), sigma**2 * np.eye(1))
            found.append(follow_ramp(y, sigma, level=level, steepest=steepest)["f"] - truth)
            theirs.append(_smoothed(y, believed) - truth)
            since.append(life.t - onset)
        known = (sigma, onset, len(truth), sigma, steepest / np.sqrt(12.0))
        bounds.append(ramp_bound(*known))
        wide.append(ramp_bound(*known, FRICTION_RATE, np.ptp(ONSETS) / np.sqrt(12.0)))
    error, paper, after = np.array(found), np.array(theirs), np.array(since)
    bias, bias_error = _mean_error(error, after > 0)
    late, late_error = _mean_error(error, after > LATE)
    return Ramps(
        sigma,
        rms(error),
        rms(paper),
        rms(np.array(bounds)),
        rms(np.array(wide)),
        bias,
        bias_error,
        late,
        late_error,
        float(paper[after > LATE].mean()),
        lives // 2,
    )


def _mean_error(error: Array, counted: Mask) -> tuple[float, float]:
    """Mean over lives (K, N), in mirrored pairs, and its standard error."""
    of_life = [e[c].mean() for e, c in zip(error, counted, strict=True)]
    of_pair = np.reshape(of_life, (-1, 2)).mean(axis=1)
    return float(of_pair.mean()), scatter(of_pair.tolist())


def _smoothed(y: Array, start: float) -> Array:
    """A random-walk filter in its steady state, equivalent to the paper's, (N,)."""
    estimate, found = start, []
    for reading in y:
        estimate += PAPER_GAIN * (reading - estimate)
        found.append(estimate)
    return np.array(found)
