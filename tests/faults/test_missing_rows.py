"""Streams of which rows are missing: bridged exactly, learnt all the same, and the promise kept."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from urdyn.bench.fault_noises import Noise
from urdyn.bench.fault_trials import first_alarms
from urdyn.faults import ShiryaevRoberts, Whitened, learn_baseline, run
from urdyn.faults.gaps import Bridge, bridged
from urdyn.types import Array, Mask

Gaps = Callable[[np.random.Generator, int, int], Mask]
PROMISE, STEPS = 10_000.0, 1000


def at_random(share: float) -> Gaps:
    """So many rows of each stream."""
    return lambda rng, steps, runs: rng.random((steps, runs)) < share


def every(k: int) -> Gaps:
    """Each k-th row."""
    return lambda rng, steps, runs: np.tile(np.arange(steps)[:, None] % k == 0, (1, runs))


def but_every(k: int) -> Gaps:
    """All but each k-th row."""
    return lambda rng, steps, runs: np.tile(np.arange(steps)[:, None] % k != 0, (1, runs))


def in_bursts(rng: np.random.Generator, steps: int, runs: int) -> Mask:
    """Four rows there, four missing."""
    return np.tile(np.arange(steps)[:, None] // 4 % 2 == 1, (1, runs))


GAPS: dict[str, Gaps] = {
    "none": at_random(0.0),
    "every 6th": every(6),
    "every 3rd": every(3),
    "every 2nd": every(2),
    "but every 5th": but_every(5),
    "10 %": at_random(0.1),
    "25 %": at_random(0.25),
    "50 %": at_random(0.5),
    "bursts": in_bursts,
}


def alarmed(colour: float, before: Gaps, later: Gaps, runs: int) -> float:
    """Share of healthy runs with an alarm, each after a baseline of its own."""
    rng, noise = np.random.default_rng(1), Noise(colour)
    healthy, series = noise.draw(rng, STEPS, runs), noise.draw(rng, STEPS, runs)
    healthy[before(rng, *healthy.shape)] = np.nan
    series[later(rng, *series.shape)] = np.nan
    detector = Whitened(learn_baseline(healthy), ShiryaevRoberts(PROMISE / runs))
    return float((first_alarms(detector, series) < STEPS).mean())


def most(runs: int) -> float:
    """1 - exp(-.1) of runs of 1000 steps may alarm, to two standard errors."""
    allowed = 1.0 - np.exp(-STEPS / PROMISE)
    return float(allowed + 2.0 * np.sqrt(allowed * (1.0 - allowed) / runs))


@pytest.mark.parametrize("colour, gaps", [(0.5, "25 %"), (0.9, "every 6th"), (0.9, "every 2nd")])
def test_the_promise_is_kept_where_rows_are_missing(colour: float, gaps: str) -> None:
    assert alarmed(colour, GAPS[gaps], GAPS[gaps], 120) <= most(120)


@pytest.mark.slow
@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("gaps", GAPS)
def test_the_promise_is_kept_wherever_rows_are_missing(colour: float, gaps: str) -> None:
    """In the baseline, later, or both."""
    for before, later in ((gaps, gaps), (gaps, "none"), ("none", gaps)):
        assert alarmed(colour, GAPS[before], GAPS[later], 300) <= most(300)


def test_a_ramp_is_found_through_gaps_nearly_as_soon() -> None:
    """Delays go with the third root of what a row tells: 1.1 times as long with a quarter missing.

    Twice that excess, for a baseline that knows less, and two standard errors of both means.
    """
    rng, runs, noise = np.random.default_rng(2), 120, Noise(0.9)
    healthy, series = noise.draw(rng, STEPS, runs), noise.draw(rng, 300, runs)
    series += 0.05 * np.maximum(np.arange(300) - 99.0, 0.0)[:, None]
    delay = []
    for share in (0.0, 0.25):
        there = [np.where(rng.random(x.shape) < share, np.nan, x) for x in (healthy, series)]
        detector = Whitened(learn_baseline(there[0]), ShiryaevRoberts(PROMISE / runs))
        first = first_alarms(detector, there[1])
        delay.append(first[first >= 100] - 99.0)
    chance = 2.0 * np.hypot(delay[0].std(), delay[1].std()) / np.sqrt(runs)
    assert delay[1].mean() < 1.2 * delay[0].mean() + chance


def test_a_bridge_is_the_dense_gaussian() -> None:
    """Mean and variance of each value, given those before it that were measured."""
    a, c, steps = np.array([1.2, -0.5]), 0.3, 40
    rng = np.random.default_rng(3)
    build = np.eye(steps) - a[0] * np.eye(steps, k=-1) - a[1] * np.eye(steps, k=-2)
    shown = 2  # the bridge begins with values of which nothing is known, dense with these two
    y = np.zeros(steps)
    for t in range(shown, steps):
        y[t] = c + a @ y[t - 2 : t][::-1] + rng.standard_normal()
    y[rng.random(steps) < 0.4] = np.nan
    y[:shown] = 0.0
    e = bridged(Bridge(a[None], np.array([c]), np.zeros(1), np.ones(1)), y[:, None])[:, 0]
    solve = np.linalg.inv(build[shown:, shown:])
    mean, cov = solve @ np.full(steps - shown, c), solve @ solve.T
    z = y[shown:]
    for t in np.flatnonzero(np.isfinite(z)):
        told = np.flatnonzero(np.isfinite(z[:t]))
        gain = np.linalg.solve(cov[np.ix_(told, told)], cov[told, t]) if len(told) else np.zeros(0)
        v = cov[t, t] - gain @ cov[told, t]
        expected = (z[t] - mean[t] - gain @ (z[told] - mean[told])) / np.sqrt(v)
        assert e[shown + t] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert np.isnan(e[shown:][np.isnan(z)]).all()


def test_step_by_step_the_same_as_all_at_once_through_gaps() -> None:
    rng = np.random.default_rng(4)
    y = Noise(0.9).draw(rng, 1300, 3)
    y[rng.random(y.shape) < 0.25] = np.nan
    baseline = learn_baseline(y[:1000])
    past = baseline.bridge.init()
    for row, expected in zip(y[1000:], baseline.innovations(y[1000:]), strict=True):
        past, e = baseline.bridge.step(past, row)
        np.testing.assert_array_equal(e / (baseline.inflation * baseline.spread), expected)


@pytest.mark.parametrize("gaps, lag", [("25 %", 1), ("every 6th", 1), ("every 2nd", 2)])
def test_a_colour_is_learnt_through_gaps(gaps: str, lag: int) -> None:
    """What follows from a value: sd of an estimate .02, in the median of 12 runs."""
    rng = np.random.default_rng(5)
    y = Noise(0.9).draw(rng, 1000, 12)
    y[GAPS[gaps](rng, *y.shape)] = np.nan
    baseline = learn_baseline(y)
    assert (baseline.pace == lag).all()
    learnt = baseline.coefficients.sum(axis=1)
    assert abs(np.median(learnt) - 0.9**lag) < 0.05
    e = baseline.innovations(y)
    np.testing.assert_allclose(np.nanmean(np.clip(e, -2.5, 2.5), axis=0), 0.0, atol=0.01)


def test_values_nearer_than_any_that_were_seen_are_not_judged() -> None:
    rng = np.random.default_rng(6)
    y = Noise(0.9).draw(rng, 1100, 1)
    y[:1000][GAPS["but every 5th"](rng, 1000, 1)] = np.nan
    baseline = learn_baseline(y[:1000])
    told = np.flatnonzero(np.isfinite(baseline.innovations(y[1000:])[:, 0]))
    assert baseline.pace == 5 and (np.diff(told) == 5).all()


@pytest.mark.parametrize("growth", [0.9, 1.02])
def test_a_gap_of_any_length_ends_in_knowing_nothing(growth: float) -> None:
    bridge = Bridge(np.array([[growth]]), np.zeros(1), np.zeros(1), np.ones(1))
    y = np.full((5000, 1), np.nan)
    y[0], y[-1] = 5.0, 1.0
    sd = np.sqrt(1.0 / (1.0 - growth**2)) if growth < 1.0 else 100.0
    assert bridged(bridge, y)[-1, 0] == pytest.approx(1.0 / sd, rel=0.05)


def test_a_wrong_spread_is_followed_where_every_second_row_is_missing() -> None:
    """A fifth more of t noise, and no more alarms than promised."""
    rng, runs, noise = np.random.default_rng(7), 120, Noise(student=True)
    healthy, series = noise.draw(rng, STEPS, runs), 1.2 * noise.draw(rng, STEPS, runs)
    healthy[::2] = series[::2] = np.nan
    baseline = learn_baseline(healthy)
    assert np.isfinite(baseline.stride).all()
    detector = Whitened(baseline, ShiryaevRoberts(PROMISE / runs))
    assert (first_alarms(detector, series) < STEPS).mean() <= most(runs)
    state = detector.init(runs)
    for row in series:
        state, _ = detector.step(state, row)
    assert 1.1 < np.sqrt(np.median(state.square)) < 1.3


def test_streams_without_gaps_do_not_feel_those_of_others() -> None:
    rng = np.random.default_rng(8)
    y = Noise(0.9).draw(rng, 1200, 2)
    alone = learn_baseline(y[:1000, :1])
    y[rng.random(1200) < 0.25, 1] = np.nan
    beside = learn_baseline(y[:1000])
    assert beside.inflation[0] == alone.inflation[0] and beside.spread[0] == alone.spread[0]
    one: Array = run(Whitened(alone, ShiryaevRoberts()), y[1000:, :1]).evidence
    both = run(Whitened(beside, ShiryaevRoberts()), y[1000:])
    np.testing.assert_allclose([v.streams[0] * 2 for v in both.verdicts], one, rtol=1e-12)
