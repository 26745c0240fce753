"""When levels will be crossed: exact where that can be computed, and intervals that cover."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from urdyn.errors import InputError, UrdynError
from urdyn.faults import forecast, health_index, stated_baseline
from urdyn.faults.courses import RAMP, SHARES, UNEVEN, posterior, stream_of, wandering
from urdyn.faults.futures import PARTS
from urdyn.faults.onset import followed
from urdyn.faults.prognosis import foresee
from urdyn.faults.robust import SQUARE
from urdyn.faults.wander import STEPS
from urdyn.types import Array

ONSET, RATE, LEVEL, WARNING, CRITICAL = 20, 0.0025, 0.1, 0.2, 0.25


def worn(sigma: float, steps: int, runs: int, seed: int) -> Array:
    """Friction by eq. 5, (steps, runs)."""
    t = np.arange(1.0, steps + 1.0)[:, None]
    noise = sigma * np.random.default_rng(seed).standard_normal((steps, runs))
    return np.asarray(LEVEL + RATE * np.maximum(t - ONSET, 0.0) + noise)


def test_a_growth_widens_innovations_by_what_it_adds_in_a_step() -> None:
    state = followed(stated_baseline(0.0, 1.0), np.arange(100.0))
    squares, count = state.stride[:, 0]
    assert squares / count == pytest.approx(0.5 / SQUARE, rel=1e-12)


def test_the_posterior_is_bayes_rule_on_a_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every onset x every stop x a fine grid of rates, from the densities themselves.

    Of noise with the variance that was seen, and a level known as well as the baseline tells. Not
    of ramps that wander, whose share is next to none here.
    """
    monkeypatch.setattr("urdyn.faults.courses.UNEVEN", 1e-12)
    sigma, hazard, n = 0.02, 1e-3, 40
    y = worn(sigma, n, 1, 1)[:, 0]
    baseline = stated_baseline(LEVEL, sigma)
    far, state = (CRITICAL - LEVEL) / sigma, followed(baseline, y)
    known = posterior(baseline, state, 0, 1.0, far, hazard)
    doubt = baseline.inflation[0] ** 2 / baseline.steps
    root = np.linalg.cholesky(stream_of(baseline, state, 0).wide * (np.eye(n) + doubt))
    e = np.linalg.solve(root, (y - LEVEL) / sigma)
    # Neighbours' median marks outliers; here there are none. What stopped began at a whole step.
    first, last = np.nonzero(np.triu(np.ones((n, n)), 1))
    going = np.append((np.arange(n - 1)[:, None] + PARTS).ravel(), n - 1.0)
    share_of = np.append(np.full(len(going) - 1, 1.0 / len(PARTS)), 1.0)
    onset, stop = np.append(first, going), np.append(last, np.full(len(going), n))
    each = np.append(np.ones(len(first)), share_of)
    lasts = np.where(stop == n, np.inf, stop - onset)
    shape = np.minimum(np.maximum(np.arange(1.0, n + 1.0) - onset[:, None], 0.0), lasts[:, None])
    u, rates = np.linalg.solve(root, shape.T), np.arange(5e-4, 4.0, 1e-3)
    log = (e @ u)[:, None] * rates - 0.5 * (u**2).sum(axis=0)[:, None] * rates**2
    prior = SHARES[RAMP] * hazard * np.where(np.isinf(lasts), 1.0, hazard) * 2.0 / far * 1e-3 * each
    weight = np.exp(log) * prior[:, None]
    one = known.smooth
    ramps = replace(one, weight=one.weight * ((one.power == 1.0) & (one.ahead == 1.0)))
    share = ramps.weight.sum()
    odds = share * known.begun / (1.0 - known.begun) * (1.0 - hazard) ** n
    assert weight.sum() == pytest.approx(odds, rel=1e-3)
    assert weight[np.isinf(lasts)].sum() / weight.sum() == pytest.approx(
        known.straight / share, rel=1e-3
    )
    now = shape[:, -1:] * rates
    for x in (0.0, 10.0, 20.0, 40.0):
        there = now + np.where(np.isinf(lasts), x, 0.0)[:, None] * rates >= far
        assert ramps.crossed(far, x) / share == pytest.approx(
            weight[there].sum() / weight.sum(), abs=2e-3
        )


def test_a_ramp_that_wanders_is_a_dense_gaussian() -> None:
    """Paces, where the level is now and evidence, from the covariances of all steps with gaps."""
    y = worn(0.02, 40, 1, 1)[:, 0]
    y[[7, 20, 21]] = np.nan
    baseline, told = stated_baseline(LEVEL, 0.02), np.isfinite(y)
    state, t = followed(baseline, y), np.arange(1.0, 41.0)
    stream = stream_of(baseline, state, 0)
    found, odds = wandering(stream)
    e, noise = ((y - LEVEL) / 0.02)[told], stream.wide
    level = noise * baseline.inflation[0] ** 2 / baseline.steps
    healthy = noise * np.eye(len(e)) + level
    none = multivariate_normal(np.zeros(len(e)), healthy).logpdf(e)
    for i in np.flatnonzero(found.age > 1.0)[::7]:
        k = np.maximum(t - (state.t - found.age[i]), 0.0)
        walked = found.walk[i] * np.minimum(k, k[:, None]) + level
        cov, h = (walked + noise * np.eye(len(t)))[np.ix_(told, told)], k[told]
        assert found.S1[i] == pytest.approx(h @ np.linalg.solve(cov, e), rel=1e-9, abs=1e-9)
        assert found.S2[i] == pytest.approx(h @ np.linalg.solve(cov, h), rel=1e-9)
        odd = multivariate_normal(np.zeros(len(e)), cov).logpdf(e) - none
        share = UNEVEN * SHARES[RAMP] / len(STEPS)
        assert odds[i] == pytest.approx(odd + np.log(share), abs=1e-9)
        gain = np.linalg.solve(cov, walked[-1][told])
        assert found.off[i] == pytest.approx(gain @ e, rel=1e-9, abs=1e-9)
        assert found.shape[i] == pytest.approx(k[-1] - gain @ h, rel=1e-9)
        assert found.var[i] == pytest.approx(walked[-1, -1] - gain @ walked[-1][told], rel=1e-9)


def test_wear_that_comes_in_steps_is_not_foretold_as_if_even() -> None:
    """Steps of .02, one in 20 rows on average, 40 lives at .8: held in two thirds or more.

    By even ramps and what bends or stops it was held in a fifth.
    """
    rng, runs = np.random.default_rng(16), 40
    change = 0.02 * np.cumsum(rng.random((600, runs)) < 0.05, axis=0)
    end = (change >= CRITICAL - LEVEL).argmax(axis=0)
    y = LEVEL + change + 0.01 * rng.standard_normal((600, runs))
    held, straight = [], []
    for i, left in enumerate(np.ceil(0.2 * end)):
        seen = y[: int(end[i] - left) + 1, i]
        made = forecast(seen, stated_baseline(LEVEL, 0.01), WARNING, CRITICAL)[0]
        held.append(made.critical.low <= left <= made.critical.high + 1.0)
        straight.append(made.straight)
    assert np.mean(held) > 0.67 and np.median(straight) < 0.5


def test_what_has_been_crossed_stays_crossed() -> None:
    """Of wear in steps, that wanders, to rounding: from its onset to a thousand times its age."""
    rng = np.random.default_rng(3)
    y = np.cumsum(0.3 * (rng.random(150) < 0.05)) + 0.1 * rng.standard_normal(150)
    made = forecast(y, stated_baseline(0.0, 0.1), 0.8, 1.2)[0]
    x = np.concatenate([np.linspace(-150.0, 300.0, 151), np.geomspace(301.0, 1.5e5, 20)])
    by = np.array([made.posterior.crossed(made.rise, at) for at in x.tolist()])
    assert made.posterior.wandering.weight.sum() > 0.01
    assert np.diff(by).min() > -1e-14 and by[0] >= 0.0 and by[-1] <= 1.0


def test_what_is_flat_never_crosses() -> None:
    """A step and a ramp that stopped, 500 steps ago, 20 lives each: hardly a ramp that goes on."""
    t, rng = np.arange(600), np.random.default_rng(12)
    for change in (0.06 * (t >= 100), RATE * np.clip(t - 100, 0, 20)):
        y = LEVEL + change[:, None] + 0.01 * rng.standard_normal((600, 20))
        for one in forecast(y, stated_baseline(LEVEL, np.full(20, 0.01)), WARNING, CRITICAL):
            assert one.probability > 0.99 and one.straight < 1e-4
            assert one.critical.median == one.critical.high == np.inf
            assert one.health(1000.0) > 0.999
            assert "inf" in str(one.critical)


@pytest.mark.parametrize("time", [pytest.param(50.0, marks=pytest.mark.slow), 200.0])
def test_what_grows_exponentially_is_not_foretold_as_if_straight(time: float) -> None:
    """40 lives at .7 and .85 of theirs: held by 90 % intervals in two thirds or more, and flagged.

    By an interval of ramps alone it was held in none.
    """
    rng, end = np.random.default_rng(13), 100.0 + time * np.log(1.0 + 15.0)
    for at in (int(100 + part * (end - 100)) for part in (0.7, 0.85)):
        t = np.arange(1.0, at + 1.0)[:, None]
        y = LEVEL + 0.01 * np.expm1(np.maximum(t - 100.0, 0.0) / time)
        y = y + 0.01 * rng.standard_normal((at, 40))
        made = forecast(y, stated_baseline(LEVEL, np.full(40, 0.01)), WARNING, CRITICAL)
        assert np.mean([m.critical.low <= end - at <= m.critical.high for m in made]) > 0.67
        assert np.median([m.straight for m in made]) < 0.5


@pytest.mark.slow
def test_noise_wider_than_the_baseline_is_allowed_for() -> None:
    """A fifth wider: .9 to three standard errors of 600 lives, .037."""
    baseline = stated_baseline(np.full(600, LEVEL), np.full(600, 0.01))
    y = worn(0.012, 50, 600, 14)
    level = np.full(600, CRITICAL)
    made = [m.critical for m in foresee(baseline, followed(baseline, y), level, level)]
    assert abs(np.mean([m.low <= 30.0 <= m.high for m in made]) - 0.9) < 0.037


@pytest.mark.slow
def test_a_level_that_the_baseline_knows_badly_is_no_fault() -> None:
    """5000 healthy steps of 200 streams, each with a level learnt from 1000.

    P(odds > 19) is no more than the prior odds of a fault, .65, over 19: .034, and three standard
    errors of that, .039.
    """
    noise = np.random.default_rng(15).standard_normal((6000, 200))
    made = forecast(noise[1000:], noise[:1000], 10.0, 15.0)
    assert np.mean([m.probability > 0.95 for m in made]) < 0.034 + 0.039


@pytest.mark.slow
@pytest.mark.parametrize("sigma, most", [(0.01, 0.93), (0.025, 0.93), (0.05, 0.95)])
def test_ninety_percent_intervals_cover_ninety_percent(sigma: float, most: float) -> None:
    """At the paper's step 60: .87 to .93, which is .9 to two standard errors of 400 lives.

    Where noise hides whether a ramp is straight, intervals hold more: what bends is in them too.
    """
    share, _ = covered(sigma, 400, 2)
    assert 0.87 <= share <= most


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


def test_a_health_index_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="one forecast or more"):
        health_index([], 20.0)


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


def test_an_onset_between_those_that_are_remembered_is_known_as_well_as_others() -> None:
    """Of 24 lives 90 % intervals hold 17 or more, in all but one of 100 such trials.

    By remembered onsets alone, eight steps apart, they held in a fifth (onset) and a half (rate).
    """
    rng, sigma, rate = np.random.default_rng(17), 0.01, 0.0025
    onset = 300.0 + rng.uniform(0.0, 20.0, 24)
    y = rate * np.maximum(np.arange(1.0, 411.0)[:, None] - onset, 0.0)
    y = y + sigma * rng.standard_normal(y.shape)
    baseline = stated_baseline(np.zeros(24), sigma)
    made = foresee(baseline, followed(baseline, y, 60), 0.2, 0.3)
    began = zip(made, onset - 410.0, strict=True)
    assert sum(one.onset.low <= at <= one.onset.high for one, at in began) >= 17
    assert sum(one.rate.low <= rate <= one.rate.high for one in made) >= 17


def test_a_sensor_that_rounds_coarsely_foretells_with_intervals_that_hold() -> None:
    """Of six streams: three or fewer would be one in 60."""
    rng = np.random.default_rng(14)
    wear = 0.02 * np.maximum(np.arange(110.0) - 50.0, 0.0)
    healthy, y = (
        np.round(x[:, None] + 0.3 * rng.standard_normal((len(x), 6)))
        for x in (np.zeros(1000), wear)
    )
    found = forecast(y, healthy, 1.0, 2.0)
    assert sum(one.critical.low <= 41.0 <= one.critical.high for one in found) >= 4


@pytest.mark.parametrize("step", [1e12, 1e40])
def test_a_change_is_a_number_however_many_spreads_it_is(step: float) -> None:
    y = np.where(np.arange(40) < 20, 0.0, step)
    change = forecast(y, stated_baseline(0.0, 1.0), step, 2.0 * step)[0].change
    assert change.median == pytest.approx(step, rel=1e-3)


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
