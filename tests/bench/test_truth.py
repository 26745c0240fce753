"""Intervals beside the truth: it strays as the twin says, and figures are what they claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, binomtest, chi2

from urdyn.bench.coloured import Coloured
from urdyn.bench.life import HELD, MOVED, STEP, drawn
from urdyn.bench.spread import interval
from urdyn.bench.truth import Trial, Trials, surprise, trials, truths
from urdyn.estimate import EKF
from urdyn.estimate.bound import posterior_bound
from urdyn.identify import Fit, Noise
from urdyn.model.arm import load_arm
from urdyn.signal import Instant
from urdyn.simulate.schedule import course
from urdyn.simulate.sensors import real_sensors, typical_sensors
from urdyn.tracking import tracking_model
from urdyn.tracking.belief.model import DAY

CHANCE = 1e-3
PERIOD = 0.01  # [s]


@pytest.fixture(scope="module")
def model(identified: Fit):
    """Of a twin that knows of no slow noise."""
    noise = identified.noise
    quick = Noise(noise.sd, noise.scale, noise.dof, noise.ar)
    return tracking_model(replace(identified, noise=quick))


@pytest.fixture(scope="module")
def slices(model):
    rng, inputs = np.random.default_rng(0), []
    for _ in range(30):
        q, v, a = rng.uniform(-1.5, 1.5, (3, 6))
        now = Instant(0.0, q, v, a, np.zeros(6), np.zeros(6), np.full(6, np.nan), np.zeros(6))
        inputs.append(replace(model.observation.inputs(now, np.sign(v), PERIOD), blind=False))
    return inputs


def test_nothing_befalls_an_arm_before_its_life_begins(identified: Fit, model) -> None:
    life = drawn(model, 5.0, 10.0, np.random.default_rng(1))
    t = np.array([0.0, 4.9, 5.0, 9.0])
    before, after = course(identified.dynamics, (), t), course(identified.dynamics, (life,), t)
    for name in ("coulomb", "viscous", "health", "encoder_offset"):
        one, other = getattr(before, name), getattr(after, name)
        np.testing.assert_array_equal(one[:2], other[:2], name)
        assert (one[3] != other[3]).all()
    at, x = model.observation.places, life.at(4.0)
    np.testing.assert_allclose(after.health[3], np.exp(x[at["z"]]))
    np.testing.assert_allclose(after.encoder_offset[3], -x[at["k"]])
    softer = x[at["kappa"]] * x[at["lubricant"]]
    np.testing.assert_allclose(after.viscous[3], np.exp(x[at["alpha"]] - softer))


def test_an_arm_is_on_the_day_as_its_life_begins(identified: Fit, model) -> None:
    life = drawn(model, 0.0, 10.0, np.random.default_rng(1))
    was, now = identified.dynamics.drive, life.on_the_day(identified.dynamics).drive
    at, x = model.observation.places, life.at(10.0)
    np.testing.assert_allclose(now.structural, was.structural * np.exp(x[at["beta"]]))
    np.testing.assert_allclose(now.offset, was.offset + x[at["o"]])
    np.testing.assert_array_equal(now.coulomb, was.coulomb)  # by the life's course


def test_lives_stray_as_the_process_says(model) -> None:
    """Variances over many lives, by the process's own F and Q; chi-square of as many."""
    many, duration = 150, 5.0
    lives = [drawn(model, 0.0, duration, np.random.default_rng([2, k])) for k in range(many)]
    found = np.var([life.at(duration) for life in lives], axis=0, ddof=1)
    places = model.observation.places
    moved = np.concatenate([np.r_[places[group]] for group in MOVED])
    rates = np.arange(len(model.observation.names), len(model.names))
    cov = np.zeros_like(model.prior.cov)
    cov[moved, moved] = np.diag(model.prior.cov)[moved]
    for group, sd in DAY.items():
        one = model.observation.reference.drive.coulomb if group == "o" else np.ones(6)
        cov[places[group], places[group]] = np.diag((sd * one) ** 2)
    cov[np.ix_(rates, rates)] = model.prior.cov[np.ix_(rates, rates)]
    still = Instant(0.0, *np.zeros((5, 6)), np.full(6, np.nan), np.zeros(6))
    u = replace(model.observation.inputs(still, np.zeros(6), STEP), blind=False)
    F, Q = model.transition_jacobian(model.prior.mean, u), model.transition_cov(u)
    day = cov
    for _ in range(round(duration / STEP)):
        cov = F @ cov @ F.T + Q
    for group in HELD:
        at = places[group]
        cov[at, at] = day[at, at]
    for group in ("k", "f", "alpha", "beta", "z", "o", "lubricant"):
        at = places[group]
        chi = float(np.sum((many - 1) * found[at] / np.diag(cov)[at]))
        # f and alpha of one joint are alike, joints are not: six of them.
        assert chi2.ppf(CHANCE, 6 * (many - 1)) < chi < chi2.ppf(1 - CHANCE, 6 * (many - 1)), group


def test_noise_in_the_model_is_that_of_the_sensors(model) -> None:
    """It stands still, and is alike at a lag as its bands say."""
    sensors = real_sensors(load_arm("ur10e"))
    true = Coloured(model, model.observation.places["slow"], sensors, PERIOD)
    n, (F, _, seen) = len(model.names), true._noise
    P = true.prior.cov[n:, n:]
    u = model.observation.inputs(
        Instant(0.0, *np.zeros((5, 6)), np.full(6, np.nan), np.zeros(6)), np.zeros(6), PERIOD
    )
    np.testing.assert_allclose(F @ P @ F.T + true.transition_cov(u)[n:, n:], P, atol=1e-15)
    for lag in (0, 3, 40):
        t = lag * PERIOD
        alike = seen @ np.linalg.matrix_power(F, lag) @ P @ seen.T
        bands = (
            b.share * np.exp(-t / b.time) * np.cos(2 * np.pi * b.frequency * t)
            for b in sensors.bands
        )
        np.testing.assert_allclose(
            np.diag(alike), sensors.current_noise**2 * sum(bands), rtol=1e-9, atol=1e-15
        )
    np.testing.assert_allclose(
        true._floor**2 + np.diag(seen @ P @ seen.T), sensors.current_noise**2, rtol=1e-3
    )


def test_the_bound_of_white_noise_is_the_models(model, slices) -> None:
    sensors = typical_sensors(load_arm("ur10e"))
    true = Coloured(model, model.observation.places["slow"], sensors, PERIOD)
    lives = np.tile(model.prior.mean, (len(slices), 1, 1))
    mine = posterior_bound(true, slices, None, lives)
    # What a filter allows for slowly is nothing here, and has no doubt of its own to speak of.
    known = [replace(u, noise=sensors.current_noise) for u in slices]
    theirs = posterior_bound(model, known, None, lives)
    np.testing.assert_allclose(mine.sd, theirs.sd, rtol=2e-3)


def test_figures_of_errors_that_are_made_to_measure() -> None:
    """Errors as large as they are said to be, at a bound that is half of that."""
    rng, arms, shape = np.random.default_rng(3), 200, (5, 6)
    runs = []
    for _ in range(arms):
        error = np.tile(2.0 * rng.standard_normal(shape[1]), (shape[0], 1))
        nees = np.column_stack([np.sum((error / 2.0) ** 2, axis=1), np.full(5, 6)])
        sd = np.full(shape, 2.0)
        runs.append(Trials({"f": Trial(error, sd, 0.5 * sd, nees)}, (99.0, 100)))
    (found,) = truths(runs)
    independent = arms * shape[1]
    low, high = (binom.ppf(p, independent, 0.9) / independent for p in (CHANCE, 1 - CHANCE))
    assert low < found.coverage < high
    exact = binomtest(round(found.coverage * independent), independent).proportion_ci()
    assert found.coverage_high - found.coverage_low == pytest.approx(
        exact.high - exact.low, rel=0.2
    )
    assert abs(found.ratio - 2.0) < 4.0 * found.ratio_sd and found.ratio_sd < 0.1
    assert abs(found.nees - 1.0) < 4.0 * found.nees_sd and found.nees_sd < 0.1
    assert found.honest is False  # it covers, but is far from the bound
    assert surprise(runs)[0] == pytest.approx(0.99)
    assert truths(runs[:1])[0].honest is None
    same = Trials({"k": runs[0].groups["f"]}, (99.0, 100))
    assert truths([same, same])[0].honest is None  # two that agree are no certainty


@pytest.mark.slow
def test_intervals_are_true_under_the_noise_of_real_arms() -> None:
    """Squared errors of joints over their variances: a chi-square of as many, drawn from anew."""
    runs = [trials("ur10e", "real", seed, 15.0, 100.0, EKF()) for seed in (1, 2)]
    few = 6 * len(runs)
    for symbol in ("f", "alpha"):
        chi = sum(run.groups[symbol].nees[-1, 0] for run in runs)
        assert chi2.ppf(CHANCE, few) < chi < chi2.ppf(1.0 - CHANCE, few), symbol
        bound = np.sqrt(np.mean([run.groups[symbol].bound[-1] ** 2 for run in runs]))
        told = np.sqrt(np.mean([run.groups[symbol].sd[-1] ** 2 for run in runs]))
        assert told == pytest.approx(bound, rel=0.1)  # the filter is as sure as can be, no surer
    assert surprise(runs)[0] == pytest.approx(1.0, abs=0.1)


def test_arms_that_agree_have_shown_their_joints_and_no_more() -> None:
    """Two arms of six joints, all covered: twelve of twelve, by Clopper and Pearson."""
    exact = binomtest(12, 12).proportion_ci()
    assert interval([1.0, 1.0], 6) == pytest.approx((exact.low, exact.high))
    assert np.isnan(interval([1.0], 6)).all()  # nobody knows how arms differ


def test_an_interval_of_coverage_holds_it_though_an_arms_joints_go_together() -> None:
    """Arms of which all joints are covered or none: what counts is arms."""
    rng, arms, sets = np.random.default_rng(4), 20, 400
    held = 0
    for _ in range(sets):
        low, high = interval((rng.random(arms) < 0.7).astype(float).tolist(), 6)
        held += low <= 0.7 <= high
    assert held >= binom.ppf(CHANCE, sets, 0.95)


def test_an_interval_of_few_arms_allows_for_how_little_they_tell_of_their_scatter() -> None:
    """Three, each with its own share of so many joints that these add nothing to its scatter."""
    rng, sets, each = np.random.default_rng(4), 400, 60
    held = 0
    for _ in range(sets):
        shares = rng.binomial(each, rng.beta(7.0, 3.0, 3)) / each
        low, high = interval(shares.tolist(), each)
        held += low <= 0.7 <= high
    assert held >= binom.ppf(CHANCE, sets, 0.95)
