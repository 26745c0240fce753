"""What is learnt of healthy streams, whatever their colour and their outliers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from urdyn.bench.fault_noises import NOISES, Noise
from urdyn.faults import Whitened, learn_baseline
from urdyn.faults.detector import Verdict
from urdyn.faults.robust import restlessness, swing
from urdyn.types import Array


@pytest.mark.parametrize("noise", [Noise(0.9), Noise(0.9, True), Noise(0.9, False, 0.02)])
def test_an_autoregression_is_learnt_through_outliers(noise: Noise) -> None:
    """What is foreseen from a value is nine tenths of it; sd of an estimate .014, in 12 runs."""
    y = noise.draw(np.random.default_rng(1), 1000, 12)
    learnt = learn_baseline(y).coefficients.sum(axis=1)
    assert abs(np.median(learnt) - 0.9) < 0.05


def test_white_noise_is_taken_for_white() -> None:
    baseline = learn_baseline(np.random.default_rng(2).standard_normal((1000, 20)))
    assert (baseline.coefficients != 0.0).any(axis=1).mean() < 0.3
    np.testing.assert_allclose(baseline.spread, 1.0, atol=4 * 0.025)


@pytest.mark.parametrize("name", NOISES)
def test_healthy_innovations_are_white_and_narrow(name: str) -> None:
    noise, rng = NOISES[name], np.random.default_rng(3)
    baseline = learn_baseline(noise.draw(rng, 1000, 12))
    e = np.clip(baseline.innovations(noise.draw(rng, 2000, 12)), -2.5, 2.5)[30:]
    assert e.std() < 1.0
    lagged = (e[1:] * e[:-1]).mean() / e.var()
    assert abs(lagged) < 0.1


def test_a_swing_and_a_restless_spread_are_told_from_chance() -> None:
    """Of 60 streams: amplitudes to a seventh; a square wave's 1 + .8 sqrt(2) at most."""
    rng = np.random.default_rng(6)
    white, slow, turns = (
        noise.draw(rng, 1000, 60) for noise in (Noise(), Noise(swing=0.5), Noise(restless=0.5))
    )
    assert np.mean([swing(x) > 0.0 for x in white.T]) < 0.05
    assert np.median([swing(x) for x in slow.T]) == pytest.approx(0.5, rel=0.15)
    assert np.mean([restlessness(x) > 1.0 for x in white.T]) < 0.05
    # 1.5² and .5² about 1.25: .8 of it either way, some lost to batches that hold both.
    assert 1.3 < np.median([restlessness(x) for x in turns.T]) < 1.0 + 0.8 * np.sqrt(2.0)


@pytest.mark.parametrize("sd", [0.3, 0.2])
def test_a_sensor_that_rounds_coarsely_has_the_spread_of_its_readings(sd: float) -> None:
    """Of readings that are one number in 90 and 99 % no autoregression, no spread about nothing."""
    y = np.round(sd * np.random.default_rng(8).standard_normal((1000, 6)))
    baseline = learn_baseline(y)
    assert not baseline.coefficients.any()
    np.testing.assert_allclose(baseline.spread, y.std(axis=0), rtol=0.01)
    assert np.clip(baseline.innovations(y), -2.5, 2.5).std() < 1.0


def test_rare_events_that_are_counted_have_a_level_about_which_they_balance() -> None:
    y = np.random.default_rng(9).poisson(0.08, (1000, 6)).astype(float)
    clipped = np.clip(learn_baseline(y).seen, -2.5, 2.5)
    np.testing.assert_allclose(clipped.mean(axis=0), 0.0, atol=1e-6)


class Recorder:
    """A detector that keeps what it is shown."""

    def init(self, streams: int) -> Array:
        return np.zeros((0, streams))

    def step(self, state: Array, observed: Array) -> tuple[Array, Verdict]:
        return np.vstack([state, observed]), Verdict(0.0, np.zeros(len(observed)))

    def acknowledged(self, state: Array) -> Array:
        return state


def test_step_by_step_the_same_innovations_as_all_at_once() -> None:
    rng = np.random.default_rng(4)
    baseline = learn_baseline(Noise(0.9).draw(rng, 1000, 3))
    y = Noise(0.9).draw(rng, 100, 3)
    detector = Whitened(baseline, Recorder(), allowed=1.0)
    state = detector.init(3)
    for row in y:
        state, _ = detector.step(state, row)
    np.testing.assert_allclose(state.inner, baseline.innovations(y), rtol=1e-12)


def test_a_spread_that_is_wrong_is_followed_up_to_what_is_allowed() -> None:
    rng = np.random.default_rng(5)
    baseline = learn_baseline(rng.standard_normal((1000, 8)))
    detector = Whitened(baseline, Recorder())
    for scale, least, most in ((1.0, 0.8, 1.0), (1.2, 0.8, 1.0), (3.0, 1.8, 2.4)):
        state = detector.init(8)
        for row in scale * rng.standard_normal((900, 8)):
            state, _ = detector.step(state, row)
        assert least < state.inner[400:].std() < most


def test_what_is_known_of_a_level_is_what_was_measured_of_it() -> None:
    """Of two thousand rows a tenth is there: they know it to the sd of two hundred."""
    rng, z = np.random.default_rng(1), []
    for _ in range(10):
        rows = np.where(rng.random(2000) < 0.1, rng.standard_normal(2000), np.nan)
        one = learn_baseline(rows)
        assert one.steps[0] == np.isfinite(rows).sum()
        z.append(one.typical[0] / (one.spread[0] / np.sqrt(one.steps[0])))
    lo, hi = np.sqrt(chi2.ppf([1e-3, 1.0 - 1e-3], 10) / 10)
    # a level is a robust mean: of white noise its sd may be up to 1.25 times that of the mean
    assert lo < np.sqrt(np.mean(np.square(z))) < 1.25 * hi
