"""When levels will be crossed: exact where that can be computed, and intervals that cover."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.errors import UrdynError
from urdyn.faults import forecast, health_index, stated_baseline
from urdyn.faults.onset import followed
from urdyn.faults.prognosis import foresee, posterior
from urdyn.types import Array

ONSET, RATE, LEVEL, WARNING, CRITICAL = 20, 0.0025, 0.1, 0.2, 0.25


def worn(sigma: float, steps: int, runs: int, seed: int) -> Array:
    """Friction by eq. 5, (steps, runs)."""
    t = np.arange(1.0, steps + 1.0)[:, None]
    noise = sigma * np.random.default_rng(seed).standard_normal((steps, runs))
    return np.asarray(LEVEL + RATE * np.maximum(t - ONSET, 0.0) + noise)


def test_the_posterior_is_bayes_rule_on_a_grid() -> None:
    """Every onset x a fine grid of rates, from the densities themselves."""
    sigma, hazard = 0.02, 1e-3
    y = worn(sigma, 40, 1, 1)[:, 0]
    baseline = stated_baseline(LEVEL, sigma)
    far = (CRITICAL - LEVEL) / sigma
    known = posterior(followed(baseline, y), 0, 1.0, far, hazard)
    # Neighbours' median marks outliers; here there are none.
    t, rates = np.arange(1.0, 41.0), np.arange(5e-6, 0.075, 1e-5)
    log = np.empty((40, len(rates)))
    for onset in range(40):
        seen = y[:, None] - LEVEL - rates * np.maximum(t - onset, 0.0)[:, None]
        log[onset] = -0.5 * (seen**2).sum(axis=0) / sigma**2
    nothing = -0.5 * ((y - LEVEL) ** 2).sum() / sigma**2 + 40 * np.log1p(-hazard)
    weight = np.exp(log - nothing) * hazard * 1e-5 / ((CRITICAL - LEVEL) / 2.0)
    assert known.begun == pytest.approx(weight.sum() / (1.0 + weight.sum()), rel=1e-3)
    np.testing.assert_allclose(known.weight, weight.sum(axis=1) / weight.sum(), atol=1e-4)
    crossing = np.arange(40)[:, None] + (CRITICAL - LEVEL) / rates - 40.0
    for x in (10.0, 20.0, 40.0):
        grid = weight[crossing <= x].sum() / weight.sum()
        assert known.crossed(far, x) == pytest.approx(grid, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.01, 0.025, 0.05])
def test_ninety_percent_intervals_cover_ninety_percent(sigma: float) -> None:
    """At the paper's step 60: .87 to .93, which is .9 to two standard errors of 400 lives."""
    share, _ = covered(sigma, 400, 2)
    assert 0.87 <= share <= 0.93


def covered(sigma: float, runs: int, seed: int) -> tuple[float, float]:
    """Coverage, and median error over what remains."""
    baseline = stated_baseline(np.full(runs, LEVEL), np.full(runs, sigma))
    state = followed(baseline, worn(sigma, 60, runs, seed))
    level = np.full(runs, CRITICAL)
    made = [one.critical for one in foresee(baseline, state, level, level)]
    inside = np.mean([one.low <= 20.0 <= one.high for one in made])
    return float(inside), float(np.median([abs(one.median - 20.0) / 20.0 for one in made]))


def test_at_little_noise_the_time_left_is_known_to_an_eighth() -> None:
    """150 lives: coverage to three standard errors of .024 about .9."""
    share, error = covered(0.01, 150, 3)
    assert error < 0.12
    assert abs(share - 0.9) < 0.075


def test_what_falls_is_foreseen_as_what_rises() -> None:
    y = worn(0.01, 60, 1, 4)
    up = forecast(y, stated_baseline(LEVEL, 0.01), WARNING, CRITICAL)[0]
    down = forecast(1.0 - y, stated_baseline(1.0 - LEVEL, 0.01), 1 - WARNING, 1 - CRITICAL)[0]
    assert down.critical.median == pytest.approx(up.critical.median, rel=1e-5)
    assert down.rate.low == pytest.approx(-up.rate.high, rel=1e-5)
    assert down.change.high == pytest.approx(-up.change.low, rel=1e-4)


def test_health_is_the_probability_of_no_crossing() -> None:
    healthy = forecast(
        LEVEL + 0.01 * np.random.default_rng(5).standard_normal(60),
        stated_baseline(LEVEL, 0.01), WARNING, CRITICAL,
    )  # fmt: skip
    sick = forecast(worn(0.01, 60, 1, 6), stated_baseline(LEVEL, 0.01), WARNING, CRITICAL)
    assert health_index(healthy, 50.0) > 0.99
    assert health_index(sick, 5.0) > 0.99
    assert health_index(sick, 60.0) < 0.01
    assert health_index([*healthy, *sick], 20.0) == pytest.approx(
        health_index(healthy, 20.0) * health_index(sick, 20.0)
    )


def test_old_onsets_are_thinned_without_loss() -> None:
    """600 steps of a ramp in 160 candidates: the median moves by a tenth of its interval."""
    rng, sigma, rate = np.random.default_rng(7), 1.0, 0.01
    y = rate * np.maximum(np.arange(700) - 100.0, 0.0) + sigma * rng.standard_normal(700)
    few, all_ = (
        foresee(b, followed(b, y, n), np.array([9.0]), np.array([12.0]))[0].critical
        for b in (stated_baseline(0.0, sigma),) for n in (160, 701)
    )  # fmt: skip
    assert abs(few.median - all_.median) < 0.1 * (all_.high - all_.low)
    assert few.high - few.low == pytest.approx(all_.high - all_.low, rel=0.1)


def test_an_outlier_does_not_move_the_forecast() -> None:
    y = worn(0.01, 60, 1, 8)
    baseline = stated_baseline(LEVEL, 0.01)
    before = forecast(y, baseline, WARNING, CRITICAL)[0].critical
    y[50] += 0.2
    after = forecast(y, baseline, WARNING, CRITICAL)[0].critical
    assert abs(after.median - before.median) < 0.2 * (before.high - before.low)


@pytest.mark.parametrize(
    "warning, critical, coverage, said",
    [
        (0.05, CRITICAL, 0.9, "one side"),
        (CRITICAL, WARNING, 0.9, "no nearer"),
        (WARNING, np.inf, 0.9, "finite"),
        (WARNING, np.nan, 0.9, "finite"),
        (np.nan, CRITICAL, 0.9, "finite"),
        (WARNING, CRITICAL, 2.0, "coverage"),
        (WARNING, CRITICAL, -0.5, "coverage"),
    ],
)
def test_levels_and_coverages_that_make_no_sense_are_refused(
    warning: float, critical: float, coverage: float, said: str
) -> None:
    with pytest.raises(UrdynError, match=said):
        forecast(worn(0.01, 60, 1, 9), stated_baseline(LEVEL, 0.01), warning, critical, coverage)


def test_what_rises_is_not_expected_to_fall() -> None:
    """Not even where a fall is so unlikely that its probability is no float."""
    away = forecast(worn(0.0025, 60, 1, 4), stated_baseline(LEVEL, 0.0025), 0.05, 0.02)[0]
    assert away.probability < 1e-3 and away.critical.low > 0.0
    assert away.rate.high < 0.0


@pytest.mark.parametrize("unit", [1e-300, 1e-6, 1e6, 1e300])
def test_a_forecast_does_not_depend_on_the_unit(unit: float) -> None:
    """To the tolerance of a quantile, 1e-9 of the bracket, beside rates of 0.25 sd/step."""
    y, healthy = worn(0.01, 60, 1, 4), worn(0.01, 1000, 1, 10) - worn(0.0, 1000, 1, 10) + LEVEL
    plain = forecast(y, healthy, WARNING, CRITICAL)[0]
    scaled = forecast(unit * y, unit * healthy, unit * WARNING, unit * CRITICAL)[0]
    assert scaled.critical.median == pytest.approx(plain.critical.median, rel=1e-6)
    assert scaled.rate.median == pytest.approx(unit * plain.rate.median, rel=1e-6, abs=0.0)
    assert scaled.change.high == pytest.approx(unit * plain.change.high, rel=1e-6, abs=0.0)
