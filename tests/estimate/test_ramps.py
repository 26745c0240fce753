"""The paper's ramp (eq. 5): who lags, who does not, and who is close to the best possible."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from affine_models import ticks

from urdyn.dbn import AffineObservation, Joined, RandomWalk, Trend, jumps
from urdyn.errors import UrdynError
from urdyn.estimate import Bank, InformationFilter, Kalman, follow_ramp, ramp_bound, track
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


def test_what_moves_without_noise_is_kalmans_in_information_form_too() -> None:
    model, y = trend(0.05, 0.01, 0.0), np.random.default_rng(1).standard_normal((30, 1))
    plain, told = (track(f, model, ticks(30), y) for f in (Kalman(), InformationFilter()))
    np.testing.assert_allclose(told.mean, plain.mean, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(told.sd, plain.sd, rtol=1e-6)


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


def test_a_bank_of_gaussian_sizes_is_bayes_rule() -> None:
    """As above, each hypothesis with a rate of its own Gaussian."""
    rng = np.random.default_rng(34)
    sigma, steps, rates, sd = 0.05, 6, np.array([0.02, 0.05]), 0.01
    y = sigma * rng.standard_normal(steps) + ramp(1)[:steps]
    settings = Bank(jumps(("f", "f.rate"), ["f.rate"], rates, sd), onsets=steps, hazard=0.1)
    found = track(settings, trend(sigma, 0.0, 0.0), ticks(steps), y[:, None])
    t, level = np.arange(steps), np.ones((steps, steps))
    prior, density, expected = [], [], []
    for onset, rate in [(steps, 0.0), *((o, r) for o in t for r in rates)]:
        d = np.maximum(t + 1 - onset, 0.0)
        known = sigma**2 * level + sd**2 * np.outer(d, d)
        S, left = known + sigma**2 * np.eye(steps), y - rate * d
        prior.append(0.9**onset * (0.05 if onset < steps else 1.0))
        density.append(np.exp(-0.5 * left @ np.linalg.solve(S, left)) / np.sqrt(np.linalg.det(S)))
        expected.append(rate * d[-1] + known[-1] @ np.linalg.solve(S, left))
    weight = np.multiply(prior, density) / np.dot(prior, density)
    assert found["f"][-1] == pytest.approx(weight @ expected, rel=1e-9)


def one_of_two_jumps(onsets: int, size: float, sd: float, known: float) -> tuple[Any, Array]:
    """Two states, each with a sensor of its own, of which the first jumps; and what was read."""
    process = RandomWalk(("a", "b"), Gaussian(np.zeros(2), known * np.eye(2)), np.zeros(2))
    model = Joined(process, AffineObservation(2, lambda u: np.eye(2), np.eye(2)))
    y = np.random.default_rng(35).standard_normal((6, 2))
    y[2:, 0] += size
    settings = Bank(jumps(("a", "b"), ["a", "b"], np.array([size]), sd), onsets, hazard=0.1)
    return track(settings, model, ticks(6), y), y


def test_a_bank_of_jumps_of_several_states_is_bayes_rule() -> None:
    """As above: under each hypothesis one state alone has jumped."""
    size, sd, known = 5.0, 2.0, 1e-6
    found, y = one_of_two_jumps(6, size, sd, known)
    t = np.arange(6)
    prior, density, expected = [], [], []
    for onset, state in [(6, 0), *((o, s) for o in t for s in (0, 1))]:
        jumped = (t >= onset)[:, None] * (np.arange(2) == state)
        prior.append(0.9**onset * (0.05 if onset < 6 else 1.0))
        density.append(1.0)
        expected.append([])
        for d, left in zip(jumped.T, (y - size * jumped).T, strict=True):
            P = known + sd**2 * np.outer(d, d)
            S = P + np.eye(6)
            density[-1] *= np.exp(-0.5 * left @ np.linalg.solve(S, left))
            density[-1] /= np.sqrt(np.linalg.det(2.0 * np.pi * S))
            expected[-1].append(size * d[-1] + P[-1] @ np.linalg.solve(S, left))
    assert found.log_likelihood == pytest.approx(np.log(np.dot(prior, density)), rel=1e-9)
    weight = np.multiply(prior, density) / np.dot(prior, density)
    np.testing.assert_allclose(found.mean[-1], weight @ expected, rtol=1e-9)


def test_merged_onsets_are_of_one_state_each() -> None:
    """The other stays as sure as it was, which one that had jumped by two or so would not be."""
    found, _ = one_of_two_jumps(2, 5.0, 2.0, 1e-6)
    assert found.sd[-1, 1] == pytest.approx(1e-3, rel=0.01)


@pytest.mark.parametrize("spread", [0.0, 0.004])
def test_what_is_merged_keeps_the_mean_and_the_spread_of_the_whole(spread: float) -> None:
    """Where the merged onsets lie apart is doubt as well, however sure each of them is."""
    model, y = trend(0.02, 0.0, 0.0), ramp(2)[:10] + 0.02 * np.sin(np.arange(10.0))
    sizes = jumps(("f", "f.rate"), ["f.rate"], np.array([0.005, 0.02]), spread)
    bank, hardly = (Bank(sizes, onsets=2, hazard=hazard) for hazard in (0.2, 1e-15))
    state = bank.init(model)
    for u, row in zip(ticks(10), y[:, None], strict=True):
        state, _ = bank.step(model, state, u, row)
    later, _ = hardly.step(model, state, *ticks(1), np.full(1, np.nan))  # merges all the same
    here, F = state.gaussian, np.array([[1.0, 1.0], [0.0, 1.0]])
    np.testing.assert_allclose(later.gaussian.mean, F @ here.mean, rtol=1e-9)
    np.testing.assert_allclose(later.gaussian.cov, F @ here.cov @ F.T, rtol=1e-9)


@pytest.mark.parametrize("spacing", [1, 3])
def test_how_seldom_onsets_are_tried_does_not_change_how_likely_one_is(spacing: int) -> None:
    sizes = jumps(("f", "f.rate"), ["f.rate"], np.array([0.01]))
    bank, model = Bank(sizes, spacing=spacing, hazard=0.1), trend(0.02, 0.0, 0.0)
    state = bank.init(model)
    for u in ticks(6):
        state, _ = bank.step(model, state, u, np.full(1, np.nan))
    assert state.weight[0] == pytest.approx(0.9**6)


@pytest.mark.parametrize("spread", [0.0, 1e-3])
def test_merged_onsets_lose_little(spread: float) -> None:
    """Far fewer candidates than slices, and still no lag at the end of a long ramp."""
    sigma = 0.02
    rates = sigma * np.arange(0.02, 0.3, 0.02)
    sizes = jumps(("f", "f.rate"), ["f.rate"], rates, spread)
    few = Bank(sizes, onsets=8, spacing=8, hazard=1 / 60)
    y = ramp(20) + sigma * np.random.default_rng(32).standard_normal(STEPS)
    found = track(few, trend(sigma, 0.0, 5e-4 * sigma), ticks(STEPS), y[:, None])
    assert abs(found["f"][-1] - ramp(20)[-1]) < 3 * found.sd[-1, 0]
    assert found.sd[-1, 0] < 0.6 * sigma


def test_merging_sizes_without_a_spread_is_that_of_sizes_with_next_to_none() -> None:
    """Merged onsets are apart in where they have led, and that is doubt in either case."""
    y = ramp(20) + 0.02 * np.random.default_rng(39).standard_normal(STEPS)
    banks = (
        Bank(jumps(("f", "f.rate"), ["f.rate"], np.array([0.001, 0.01]), spread), onsets=2)
        for spread in (0.0, 1e-12)
    )
    none, hardly = (track(b, trend(0.02, 0.0, 0.0), ticks(STEPS), y[:, None]) for b in banks)
    np.testing.assert_allclose(none.mean, hardly.mean, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(none.sd, hardly.sd, rtol=1e-6, atol=1e-9)


def test_a_ramp_that_falls_is_one_that_rises_upside_down() -> None:
    y = ramp(20) + 0.02 * np.random.default_rng(35).standard_normal(STEPS)
    up, down = follow_ramp(y, 0.02), follow_ramp(-y, 0.02, direction=-1)
    np.testing.assert_allclose(down["f"], -up["f"], atol=1e-9)


def test_a_ramp_against_the_direction_is_followed_but_later() -> None:
    y = 0.02 * np.random.default_rng(38).standard_normal(STEPS) - ramp(20)
    told, untold = follow_ramp(y, 0.02, direction=-1), follow_ramp(y, 0.02, direction=1)
    assert untold["f.rate"][-1] == pytest.approx(-RATE, rel=0.2)
    assert (untold["f.rate"][30:] > told["f.rate"][30:]).all()


def test_the_later_an_onset_is_expected_the_less_a_level_is_taken_for_a_ramp() -> None:
    """Noise without a ramp, and its mirror image: what is believed of the rate is false."""
    y = 0.02 * np.random.default_rng(40).standard_normal(STEPS)
    soon, late = (
        np.array([follow_ramp(x, 0.02, expected=e)["f.rate"] for x in (y, -y)])
        for e in (40.0, 350.0)
    )
    # Its hazard is nine times less, and so are the odds of a ramp; of small odds, the belief.
    assert 0.0 < late.mean() < 0.5 * soon.mean()


@pytest.mark.parametrize("sign", [1, -1])
def test_where_no_direction_is_told_a_ramp_is_followed_as_if_it_were(sign: int) -> None:
    y = sign * (ramp(20) + 0.02 * np.random.default_rng(39).standard_normal(STEPS))
    told, untold = (follow_ramp(y, 0.02, direction=way)["f.rate"] for way in (sign, 0))
    # Twenty steps on, the odds of the other way are below 1e-3.
    np.testing.assert_allclose(untold[40:], told[40:], rtol=1e-3)


@pytest.mark.parametrize(
    "settings", [{"sigma": 0.0}, {"sigma": np.nan}, {"dt": 0.0}, {"dt": -1.0}, {"direction": 2}]
)
def test_settings_of_no_ramp_are_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(UrdynError, match=next(iter(settings))):
        follow_ramp(np.zeros(5), **({"sigma": 0.02} | settings))


def test_no_ramp_depends_on_where_its_readings_have_their_zero() -> None:
    """Encoder counts, pressures in Pa; beyond rounding, one part in 1e16 of the shift."""
    y = np.random.default_rng(31).standard_normal(60)
    y[0] = np.nan
    near, far = follow_ramp(y, 1.0), follow_ramp(y + 1e7, 1.0)
    np.testing.assert_allclose(far["f.rate"], near["f.rate"], atol=1e-6)
    np.testing.assert_allclose(far["f"][1:] - 1e7, near["f"][1:], atol=1e-6)


def test_time_may_be_counted_in_seconds_or_in_steps() -> None:
    y = ramp(20) + 0.02 * np.random.default_rng(36).standard_normal(STEPS)
    steps, seconds = follow_ramp(y, 0.02), follow_ramp(y, 0.02, dt=0.01)
    np.testing.assert_allclose(seconds["f"], steps["f"], atol=1e-9)
    np.testing.assert_allclose(seconds["f.rate"], 100.0 * steps["f.rate"], atol=1e-7)


def test_what_is_not_read_is_not_missed_for_long() -> None:
    y = ramp(20) + 0.02 * np.random.default_rng(37).standard_normal(STEPS)
    found = follow_ramp(np.where(np.arange(STEPS) % 3, y, np.nan), 0.02)
    assert np.isfinite(found.mean).all()
    assert abs(found["f"][-1] - ramp(20)[-1]) < 3 * found.sd[-1, 0]


def errors(ratio: float, runs: int) -> tuple[Array, Array, Array]:
    """Errors of the ready-made filter, bounds of one that is told the onset, and onsets.

    Errors and bounds are (runs, STEPS), in units of sigma; the prior of the level is sigma.
    """
    sigma, rng = RATE / ratio, np.random.default_rng(33)
    known = Gaussian(np.zeros(1), sigma**2 * np.eye(1))
    rate_sd = 0.5 * sigma / np.sqrt(12.0)  # of rates that are even up to sigma / 2
    found, bounds, onsets = [], [], rng.integers(*ONSETS, runs)
    for onset in onsets:
        truth = ramp(int(onset)) + sigma * rng.standard_normal()
        y = truth + sigma * rng.standard_normal(STEPS)
        found.append(follow_ramp(y, sigma, level=known)["f"] - truth)
        bounds.append(ramp_bound(sigma, onset, STEPS, sigma, rate_sd))
    return np.array(found) / sigma, np.array(bounds) / sigma, onsets


def against_the_bound(ratio: float, runs: int) -> float:
    """Root mean square error over runs and steps, in units of the bound's."""
    error, bound, _ = errors(ratio, runs)
    return float(np.sqrt(np.mean(error**2) / np.mean(bound**2)))


@pytest.mark.parametrize("ratio", [0.05, 0.25])
def test_a_bank_is_near_the_bound_on_a_few_ramps(ratio: float) -> None:
    assert against_the_bound(ratio, 12) < 1.3


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.01, 0.025, 0.05, 0.1, 0.25])
def test_a_bank_is_near_the_bound_on_many_ramps(ratio: float) -> None:
    assert against_the_bound(ratio, 60) < 1.3


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.05, 0.25])
def test_what_is_left_of_the_papers_bias_is_less_than_a_thousandth(ratio: float) -> None:
    """From 18 steps after the onset, when the paper's filter only just sees the ramp.

    Four standard deviations of the mean over runs are allowed for.
    """
    error, _, onsets = errors(ratio, 60)
    late = np.arange(1, STEPS + 1) > onsets[:, None] + 18
    of_run = np.array([e[m].mean() for e, m in zip(error, late, strict=True)]) * RATE / ratio
    assert abs(of_run.mean()) < 0.001 + 4.0 * of_run.std(ddof=1) / np.sqrt(len(of_run))
