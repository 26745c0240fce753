"""Forecasts where rows are missing: all that is regressed is the dense Gaussian's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.signal import lfilter

from urdyn.faults import Baseline, forecast, stated_baseline
from urdyn.faults.courses import RAMP, SHARES, going, stopped, stream_of
from urdyn.faults.onset import followed
from urdyn.faults.prognosis import foresee
from urdyn.faults.shapes import POWERS, TIMES
from urdyn.types import Array

STEPS = 60


def coloured(*a: float, runs: int = 1) -> Baseline:
    """Autoregressions of unit spread, which are known."""
    one = stated_baseline(np.zeros(runs), np.ones(runs))
    return replace(one, coefficients=np.tile(a, (runs, 1)))


@dataclass(frozen=True, eq=False)
class Dense:
    """An autoregression whose first values are known, by the covariances of all that follow."""

    a: Array  # (p,)
    y: Array  # (N,) NaN where missing, but not in the first p

    def white(self, change: Array) -> Array:
        """What a change of the values (..., N) adds to what is white, (..., M measured ones)."""
        p, steps = len(self.a), len(self.y)
        build = sum((-c * np.eye(steps, k=-k) for k, c in enumerate(self.a, 1)), np.eye(steps))
        foreseen, later = build[p:], np.linalg.inv(build[p:, p:])
        told = np.isfinite(self.y[p:])
        root = np.linalg.cholesky((later @ later.T)[np.ix_(told, told)])
        passed = change @ foreseen.T @ later.T
        return np.asarray(passed[..., told] @ np.linalg.inv(root).T)

    def level(self) -> Array:
        """What a level that is off by 1 in innovations adds, (M,)."""
        p, steps = len(self.a), len(self.y)
        lasting = lfilter([1.0], np.r_[1.0, -self.a], np.arange(steps) >= p)
        return self.white(lasting)


def drawn(seed: int, share: float, *a: float) -> Dense:
    """A series of which that share is missing."""
    rng = np.random.default_rng(seed)
    y = lfilter([1.0], np.r_[1.0, -np.array(a)], rng.standard_normal(STEPS))
    y[len(a) :][rng.random(STEPS - len(a)) < share] = np.nan
    return Dense(np.array(a), y)


@pytest.mark.parametrize("a", [(), (0.9,), (1.2, -0.5), (0.4, 0.0, 0.3)])
def test_every_regression_is_the_dense_gaussian(a: tuple[float, ...]) -> None:
    """Of every power and onset, of exponentials, and of the level: all sums, 40 % missing."""
    dense = drawn(1, 0.4, *a)
    state = followed(coloured(*a), dense.y)
    t, e, w = np.arange(1.0, STEPS + 1.0), dense.white(np.nan_to_num(dense.y)), dense.level()
    k = np.maximum(t - np.arange(STEPS)[:, None], 0.0)
    power = np.array(POWERS)[:, None, None]
    h = dense.white(np.where(k > 0.0, k**power, 0.0))
    for found, expected in zip(
        state.S[..., :STEPS, 0], (h @ e, (h**2).sum(axis=-1), h @ w), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)
    grown = dense.white(np.exp((t - STEPS) / TIMES[:, None]))
    for found, expected in zip(
        state.X[..., 0], (grown @ e, (grown**2).sum(axis=-1), grown @ w), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)
    assert state.E[0] == pytest.approx(w @ e) and state.N[0] == pytest.approx(w @ w)


def test_a_stopped_ramp_is_regressed_as_if_it_were_followed() -> None:
    """h_i - h_j itself, of every pair."""
    dense = drawn(11, 0.2, 0.5, 0.3)
    baseline = coloured(0.5, 0.3)
    state = followed(baseline, dense.y)
    found = stopped(stream_of(baseline, state, 0), 1e-3)
    ramp = np.maximum(np.arange(1.0, STEPS + 1.0) - (state.t - found.age)[:, None], 0.0)
    h = dense.white(np.minimum(ramp, found.lasts[:, None]))
    np.testing.assert_allclose(found.S2, (h**2).sum(axis=1), rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(found.H, h @ dense.level(), rtol=1e-8, atol=1e-8)
    assert len(found.S2) == (STEPS - 2) * (STEPS - 1) // 2


@pytest.mark.parametrize("a", [(), (0.9,), (0.5, 0.3)])
def test_a_ramp_between_two_onsets_is_regressed_as_if_it_were_followed(
    a: tuple[float, ...],
) -> None:
    """w h_i + (1 - w) h_j itself, with w by where it lies."""
    dense, baseline = drawn(11, 0.2, *a), coloured(*a)
    state = followed(baseline, dense.y, 20)
    found = going(stream_of(baseline, state, 0))
    ramps = np.maximum(np.arange(1.0, STEPS + 1.0)[:, None] - state.onset, 0.0)
    began = state.t - found.age
    h = dense.white(np.array([np.interp(began, state.onset, ramp) for ramp in ramps]).T)
    np.testing.assert_allclose(found.S1, h @ dense.white(np.nan_to_num(dense.y)), rtol=1e-8)
    np.testing.assert_allclose(found.S2, (h**2).sum(axis=1), rtol=1e-8)
    np.testing.assert_allclose(found.H, h @ dense.level(), rtol=1e-8, atol=1e-8)
    assert found.prior.sum() == pytest.approx(SHARES[RAMP] * STEPS)


def test_pairs_of_ramps_are_thinned_with_their_onsets() -> None:
    """Those of onsets that are still remembered are what they are where all are."""
    dense, baseline = drawn(12, 0.3, 0.5, 0.3), coloured(0.5, 0.3)
    few, all_ = (followed(baseline, dense.y, n) for n in (20, STEPS))
    kept = few.onset.astype(int)
    np.testing.assert_allclose(few.P, all_.P[np.ix_(kept, kept)], rtol=1e-12)
    np.testing.assert_allclose(few.S, all_.S[:, :, kept], rtol=1e-12)


def lives(share: float, runs: int) -> tuple[float, float]:
    """Of 90 % intervals of lives of AR(1.2, -.5) at .7: how many hold, and how wide they are."""
    rng, a = np.random.default_rng(13), (1.2, -0.5)
    noise = lfilter([1.0], [1.0, -1.2, 0.5], rng.standard_normal((530, runs)), axis=0)[400:]
    rate = 0.15 * np.std(noise)
    y = noise + rate * np.maximum(np.arange(130) - 59.0, 0.0)[:, None]
    y[rng.random(y.shape) < share] = np.nan
    baseline, level = coloured(*a, runs=runs), np.full(runs, 100.0 * rate)
    made = [m.critical for m in foresee(baseline, followed(baseline, y), level, level)]
    held = np.mean([m.low <= 30.0 <= m.high for m in made])
    return float(held), float(np.median([m.high - m.low for m in made]))


@pytest.mark.slow
def test_a_fifth_of_the_rows_missing_widens_intervals_by_little() -> None:
    """.9 to three standard errors of 100 lives, .09; by sqrt(1 / .8) = 1.12, and a tenth of chance.

    Of rows with a complete past alone, half are left: by 1.4 and more.
    """
    (_, all_), (held, most) = lives(0.0, 100), lives(0.2, 100)
    assert abs(held - 0.9) < 0.09
    assert most < 1.12 * 1.1 * all_


def test_rows_that_never_follow_one_another_are_forecast() -> None:
    """Three of five are missing, and none has a complete past of three."""
    rng = np.random.default_rng(14)
    y = lfilter([1.0], [1.0, -0.5], rng.standard_normal(400))
    y += 0.1 * np.maximum(np.arange(400) - 200.0, 0.0)
    y[np.arange(400) % 5 % 2 == 0] = np.nan
    made = forecast(y, coloured(0.5, 0.0, 0.01), 25.0, 30.0)[0]
    assert made.probability > 0.99 and made.critical.low < 100.0 < made.critical.high
