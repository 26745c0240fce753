"""The paper's ramp (eq. 5): who lags, who does not, and who is close to the best possible."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from affine_models import ticks

from urdyn.dbn import AffineObservation, Joined, RandomWalk, Trend, jumps
from urdyn.estimate import Bank, Kalman, track
from urdyn.types import Array, Gaussian

RATE = 0.0025  # per step, the paper's
STEPS = 100
ONSETS = (10, 60)  # drawn evenly between

Model = Joined[Any]


def ramp(onset: int) -> Array:
    return RATE * np.maximum(np.arange(1, STEPS + 1) - onset, 0.0)


def observed(process: Any, sigma: float) -> Model:
    return Joined(process, AffineObservation(1, lambda u: np.eye(1), sigma**2 * np.eye(1)))


def walk(sigma: float, diffusion: float) -> Model:
    prior = Gaussian(np.zeros(1), sigma**2 * np.eye(1))
    return observed(RandomWalk(("f",), prior, np.array([diffusion])), sigma)


def trend(sigma: float, rate_sd: float, acceleration: float) -> Model:
    prior = Gaussian(np.zeros(1), sigma**2 * np.eye(1))
    one = np.array([0])
    return observed(
        Trend(("f",), prior, np.zeros(1), one, np.array([rate_sd]), np.array([acceleration])), sigma
    )


def bank(sigma: float) -> Bank:
    """Rates evenly apart, as their posterior's width is the same for slow and for steep ramps."""
    rates = sigma * np.arange(0.01, 0.3, 0.01)
    return Bank(jumps(("f", "f.rate"), ["f.rate"], rates), onsets=STEPS, hazard=1 / 60)


def test_a_random_walk_lags_by_what_its_gain_says() -> None:
    """Steady state: the error that one gain makes good in a step is what the ramp adds in it."""
    model = walk(0.05, 0.01)
    found = track(Kalman(), model, ticks(1000), RATE * np.arange(1, 1001.0)[:, None])
    P = found.sd[-1, 0] ** 2
    gain = P / 0.05**2
    lag = found["f"][-1] - RATE * 1000
    assert lag == pytest.approx(-RATE * (1 - gain) / gain, rel=1e-6)
    assert -lag > 0.01  # four steps of the ramp


def test_a_local_linear_trend_has_no_bias_on_a_ramp() -> None:
    """A linear filter's mean is its answer to data without noise."""
    model = trend(0.05, 0.01, 2e-4)
    found = track(Kalman(), model, ticks(400), RATE * np.arange(1, 401.0)[:, None])
    assert abs(found["f"][-1] - RATE * 400) < 1e-6
    assert found["f.rate"][-1] == pytest.approx(RATE, rel=1e-4)


def test_a_bank_with_one_onset_per_slice_is_bayes_rule() -> None:
    """Against all hypotheses computed one by one from their densities."""
    rng = np.random.default_rng(31)
    sigma, steps, rates = 0.05, 6, np.array([0.02, 0.05])
    y = sigma * rng.standard_normal(steps) + ramp(0)[:steps]
    settings = Bank(jumps(("f", "f.rate"), ["f.rate"], rates), onsets=steps, hazard=0.1)
    found = track(settings, trend(sigma, 0.0, 0.0), ticks(steps), y[:, None])
    noise = sigma**2 * (np.eye(steps) + np.ones((steps, steps)))
    t = np.arange(steps)
    drifts = [np.zeros(steps)] + [r * np.maximum(t + 1 - o, 0) for o in t for r in rates]
    prior = [0.9**steps] + [0.1 * 0.9**o / 2 for o in t for _ in rates]
    density = [
        np.exp(-0.5 * (y - d) @ np.linalg.solve(noise, y - d))
        / np.sqrt(np.linalg.det(2 * np.pi * noise))
        for d in drifts
    ]
    assert found.log_likelihood == pytest.approx(np.log(np.dot(prior, density)), rel=1e-9)
    weight = np.multiply(prior, density) / np.dot(prior, density)
    shrunk = [d[-1] + (y - d).sum() / (steps + 1) for d in drifts]
    assert found["f"][-1] == pytest.approx(weight @ shrunk, rel=1e-9)


def test_merged_onsets_lose_little() -> None:
    """Far fewer candidates than slices, and still no lag at the end of a long ramp."""
    sigma = 0.02
    rates = sigma * np.arange(0.02, 0.3, 0.02)
    few = Bank(jumps(("f", "f.rate"), ["f.rate"], rates), onsets=8, spacing=8, hazard=1 / 60)
    y = ramp(20) + sigma * np.random.default_rng(32).standard_normal(STEPS)
    found = track(few, trend(sigma, 0.0, 5e-4 * sigma), ticks(STEPS), y[:, None])
    assert abs(found["f"][-1] - ramp(20)[-1]) < 3 * found.sd[-1, 0]
    assert found.sd[-1, 0] < 0.6 * sigma


def bound(onset: int, sigma: float) -> Array:
    """Posterior Cramer-Rao bound on the variance of f at every step, (STEPS,) [Tichavsky1998]_.

    Of a line that bends once: level, onset and rate unknown, each with the prior's variance.
    """
    ratio = sigma * np.arange(0.01, 0.3, 0.01)
    spread = np.array([sigma**2, (ONSETS[1] - ONSETS[0]) ** 2 / 12, ratio.var()])
    information, found = np.diag(1 / spread), []
    for t in range(1, STEPS + 1):
        gradient = np.array([1.0, -RATE * (t > onset), max(t - onset, 0.0)])
        information = information + np.outer(gradient, gradient) / sigma**2
        found.append(gradient @ np.linalg.solve(information, gradient))
    return np.array(found)


def against_the_bound(ratio: float, runs: int) -> float:
    """Root mean square error over runs and steps, in units of the bound's."""
    sigma, rng = RATE / ratio, np.random.default_rng(33)
    model, settings = trend(sigma, 0.0, 0.0), bank(sigma)
    squares, bounds = [], []
    for _ in range(runs):
        onset = int(rng.integers(*ONSETS))
        truth = ramp(onset) + sigma * rng.standard_normal()
        y = truth + sigma * rng.standard_normal(STEPS)
        squares.append((track(settings, model, ticks(STEPS), y[:, None])["f"] - truth) ** 2)
        bounds.append(bound(onset, sigma))
    return float(np.sqrt(np.mean(squares) / np.mean(bounds)))


@pytest.mark.parametrize("ratio", [0.05, 0.25])
def test_a_bank_is_near_the_bound_on_a_few_ramps(ratio: float) -> None:
    assert against_the_bound(ratio, 20) < 1.3


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.01, 0.025, 0.05, 0.1, 0.25])
def test_a_bank_is_near_the_bound_on_many_ramps(ratio: float) -> None:
    assert against_the_bound(ratio, 200) < 1.3
