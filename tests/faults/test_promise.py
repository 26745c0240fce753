"""What is promised about false alarms is kept, on noise that nobody tuned for."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.bench.fault_noises import NOISES, Noise
from urdyn.bench.fault_trials import alarmed, first_alarms
from urdyn.faults import ShiryaevRoberts, Whitened, cells, detect, learn_baseline
from urdyn.faults.mixture import Mixture

PROMISE = 10_000.0


def test_the_likelihood_ratio_of_healthy_noise_averages_one_or_less() -> None:
    """Monte Carlo, to four standard errors; the psi of a variance grants LOOSE more than that."""
    rng = np.random.default_rng(1)
    cell = cells()
    c = np.clip(rng.standard_normal(200_000), -2.5, 2.5)
    for side, tilt, psi in zip(cell.side, cell.tilt, cell.psi, strict=True):
        L = np.exp(tilt * (c**2 if side == 0.0 else side * c) - psi)
        assert L.mean() <= 1.0 + 4.0 * L.std() / np.sqrt(len(c))
        assert side == 0.0 or L.mean() >= 1.0 - 4.0 * L.std() / np.sqrt(len(c))


def test_the_likelihood_ratio_averages_one_on_skewed_noise_as_well() -> None:
    """On what was learnt from, and to four standard errors of 20 of 1000 steps on more of it."""
    rng, streams = np.random.default_rng(8), 20
    draw = Noise(skewed=True).draw
    baseline = learn_baseline(draw(rng, 1000, streams))
    seen = [e for e in baseline.healthy if np.isfinite(e).all()]
    later = baseline.innovations(draw(rng, 4000, streams))[baseline.order :]
    normal, taught = Mixture(), Mixture(healthy=baseline.healthy)
    assert np.mean([normal.likelihood(e) for e in later], axis=(0, 1)).max() > 1.5
    assert np.mean([taught.likelihood(e) for e in seen], axis=0).max() < 1.0 + 1e-9
    L = np.array([taught.likelihood(e) for e in later])
    assert (L.mean(axis=(0, 1)) < 1.0 + 4.0 * L.std(axis=(0, 1)) / np.sqrt(1000 * streams)).all()


def test_normal_noise_pays_nothing_for_what_may_be_skewed() -> None:
    """The inflation pays for it: 40 streams, of 78 cells each."""
    rng = np.random.default_rng(9)
    healthy = learn_baseline(rng.standard_normal((1000, 40))).healthy
    e = rng.standard_normal(40)
    dearer = Mixture(healthy=healthy).likelihood(e) < Mixture().likelihood(e) * (1.0 - 1e-9)
    assert dearer.mean() < 0.02


def test_evidence_less_steps_passed_averages_zero_at_most() -> None:
    """M_t - t is a martingale on exactly standard noise: no threshold needs a simulation."""
    rng = np.random.default_rng(2)
    detector = ShiryaevRoberts(PROMISE, cells(rates=(0.1,), steps=(0.5,), variances=()))
    state, runs = detector.init(4000), 4000
    for _ in range(10):
        state, verdict = detector.step(state, rng.standard_normal(runs))
    M = verdict.streams * runs * PROMISE
    assert abs(M.mean() - 10.0) < 4.0 * M.std() / np.sqrt(runs)


@pytest.mark.slow
@pytest.mark.parametrize("name", NOISES)
def test_one_alarm_in_ten_thousand_steps_means_so(name: str) -> None:
    """At most 1 - exp(-.1) of runs of 1000 steps, to two standard errors."""
    runs, allowed = 240, 1.0 - np.exp(-0.1)
    share = alarmed(NOISES[name], runs, np.random.default_rng(3))
    assert share <= allowed + 2.0 * np.sqrt(allowed * (1.0 - allowed) / runs)


@pytest.mark.slow
@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("steps", [100, 200, 500])
def test_a_short_baseline_is_paid_for(colour: float, steps: int) -> None:
    """At most 1 - exp(-.1) of runs of 1000 steps, to two standard errors."""
    runs, allowed, rng = 400, 1.0 - np.exp(-0.1), np.random.default_rng(6)
    y = Noise(colour).draw(rng, steps + 1000, runs)
    detector = Whitened(learn_baseline(y[:steps]), ShiryaevRoberts(PROMISE / runs))
    share = (first_alarms(detector, y[steps:]) < 1000).mean()
    assert share <= allowed + 2.0 * np.sqrt(allowed * (1.0 - allowed) / runs)


def test_a_short_baseline_is_inflated_and_a_long_one_is_not() -> None:
    """By the doubt of 1 - A: sqrt((1 + A) / (1 - A)) (1 / sqrt(N) - 1 / sqrt(1000)), A about .9."""
    y = Noise(0.9).draw(np.random.default_rng(7), 2000, 12)
    short, long = (np.median(learn_baseline(y[:n]).inflation) for n in (200, 2000))
    doubt = np.sqrt(1.9 / 0.1) * (200.0**-0.5 - 1000.0**-0.5)
    assert short / long == pytest.approx((1.0 + 0.04 * 5.0**0.5) / 1.04 * (1.0 + doubt), rel=0.06)


def test_a_stream_that_is_missing_says_nothing() -> None:
    rng = np.random.default_rng(4)
    healthy, series = rng.standard_normal((1000, 2)), rng.standard_normal((300, 2))
    series[:, 1] = np.nan
    found = detect(series, healthy)
    assert not found.detected
    assert found.verdicts[-1].streams[1] == 0.0


def test_a_ramp_is_found_on_its_stream() -> None:
    rng = np.random.default_rng(5)
    series = rng.standard_normal((300, 6))
    series[:, 2] += 0.05 * np.maximum(np.arange(300) - 200.0, 0.0)
    found = detect(series, rng.standard_normal((1000, 6)))
    assert found.alarm is not None and 200 < found.alarm < 245
    assert found.stream == 2
    assert found.verdicts[found.alarm].kind == "ramp up"
