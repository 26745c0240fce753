"""Laws of the causal twin: it is the batch estimate, some samples later."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2
from streams import log_of, play, stacked, swing

from urdyn.errors import InputError
from urdyn.signal import Causal, condition, samples, weights

STEP = 0.01
ORDERS = ("q", "v", "a", "jerk")


def rounding(order: int) -> float:
    """As for the batch: four digits of normal equations, Markov's n²/s for every derivative."""
    return float(1e4 * np.finfo(float).eps * 4.0 * (16 / 0.04) ** order)


@pytest.mark.parametrize("offset", [0.0, (0.006, 0.002, -0.001)])
@pytest.mark.parametrize("stamps", ["even", "uneven"])
@pytest.mark.parametrize("measured", ["all", "holes", "angles"])
def test_half_a_window_late_it_is_the_batch(
    offset: float | tuple[float, ...], stamps: str, measured: str
) -> None:
    rng = np.random.default_rng(2)
    uneven = rng.choice([0.008, STEP, 0.012], 200, p=[0.1, 0.8, 0.1])
    t = np.cumsum(uneven) if stamps == "uneven" else STEP * np.arange(200)
    q, v = swing(t)
    if measured == "holes":
        q[rng.integers(200, size=5), 1] = np.nan
        v[rng.integers(200, size=5)] = np.nan
    if measured == "angles":
        v[:] = np.nan
    log = log_of(t, q, v)
    batch = condition(log, offset=offset, half_window=4)
    _, live = play(Causal(float(np.median(np.diff(t))), half=4, offset=offset), log)
    inner = slice(4, -4)
    assert np.array_equal(stacked(live, "t"), batch.t[inner])
    assert np.array_equal(stacked(live, "current"), batch.current[inner])
    for order, name in enumerate(ORDERS):
        error = np.abs(stacked(live, name) - getattr(batch, name)[inner])
        assert error.max() < rounding(order)
    for k, instant in enumerate(live, start=4):
        assert np.abs(instant.instrumental - batch.instrumental[k]).max() < rounding(2)


def test_a_sample_of_other_joints_is_refused() -> None:
    t = STEP * np.arange(12)
    twin, log = Causal(STEP, half=4), log_of(t, *swing(t))
    state, _ = play(twin, log)
    sample = next(iter(samples(log)))
    fewer = {name: getattr(sample, name)[:2] for name in ("q", "v", "current", "temperature")}
    for wrong in (replace(sample, q=sample.q[:2]), replace(sample, **fewer)):
        with pytest.raises(InputError, match=r"are \(2,\), .* each is to be \(3,\)"):
            twin.step(state, wrong)


@pytest.mark.parametrize("step", [0.054, 0.032, 0.022])
def test_angles_alone_take_the_window_that_they_take_in_a_batch(step: float) -> None:
    t = step * np.arange(100)
    log = log_of(t, swing(t)[0], np.full((100, 3), np.nan))
    twin = Causal(step, velocities=False)
    batch, (_, live) = condition(log), play(twin, log)
    inner = slice(twin.fit.half, -twin.fit.half)
    assert np.array_equal(stacked(live, "t"), batch.t[inner])
    for order, name in enumerate(ORDERS):
        error = np.abs(stacked(live, name) - getattr(batch, name)[inner])
        assert error.max() < rounding(order)


@pytest.mark.parametrize("lag", [0, 2, 4])
def test_the_error_on_a_sinusoid_is_within_the_taylor_remainder(lag: int) -> None:
    omega, ahead = 3.0, 0.006
    t = STEP * np.arange(300)
    twin = Causal(STEP, half=4, lag=lag, offset=ahead)
    _, live = play(twin, log_of(t, *swing(t, omega=omega)))
    at = stacked(live, "t")[:, None] + ahead
    phase = omega * at + np.arange(3)
    truth = (np.sin(phase), omega * np.cos(phase), -(omega**2) * np.sin(phase))
    of_q, of_v = weights(twin.fit, (4 - lag) * STEP + ahead)
    away = omega * np.abs(STEP * np.arange(-4, 5) - (4 - lag) * STEP - ahead)
    for order in range(3):
        # the estimate is exact on the quartic part of the motion, and linear in what is left
        rest = np.abs(of_q[order]) * away**5 / math.factorial(5)
        rest += np.abs(of_v[order]) * omega * away**4 / math.factorial(4)
        error = np.abs(stacked(live, ORDERS[order]) - truth[order]).max()
        assert error <= rest.sum() + rounding(order)


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"lag": 9}, "lag 9: takes a whole number from 0 to 8"),
        ({"lag": -1}, "lag -1"),
        ({"lag": 2.5}, "lag 2.5"),
        ({"period": 0.0}, "period 0.0: takes a time above 0"),
        ({"period": np.nan}, "period nan"),
    ],
)
def test_a_stamp_that_is_in_no_window_is_refused(settings: dict[str, Any], why: str) -> None:
    with pytest.raises(InputError, match=why):
        Causal(**{"period": STEP, "half": 4, **settings})


def test_the_instrument_knows_nothing_of_the_noise_of_velocities() -> None:
    """At a slow rate too, where it takes more samples than the motion does."""
    rng = np.random.default_rng(4)
    for step in (0.05, 0.01, 0.002):
        t = step * np.arange(200)
        q, v = swing(t)
        noise = 2e-3 * rng.standard_normal(v.shape)
        (_, clean), (_, noisy) = (play(Causal(step), log_of(t, q, w)) for w in (v, v + noise))
        pairs = [(a, b) for a, b in zip(clean, noisy, strict=True) if a.instrument is not None]
        assert len(clean) - len(pairs) == round(0.2 / step) - Causal(step).fit.half  # the first
        for one, other in pairs:
            np.testing.assert_array_equal(one.instrument, other.instrument)
        assert np.abs([one.a - other.a for one, other in pairs]).max() > 0.01


def test_the_instruments_jerk_is_the_slope_of_its_acceleration() -> None:
    """Of a swing, by differences: what both leave out of it is of the second order in the step."""
    omega = 3.0
    _, live = play(
        Causal(STEP), log_of(STEP * np.arange(100), *swing(STEP * np.arange(100), omega=omega))
    )
    told = [instant for instant in live if instant.instrument is not None]
    a = np.array([instant.instrument for instant in told])
    jerk = np.array([instant.instrument_jerk for instant in told])
    slope = (a[2:] - a[:-2]) / (2.0 * STEP)
    assert np.abs(jerk[1:-1] - slope).max() < (omega * 5 * STEP) ** 2 * omega**3


def test_the_instrument_follows_a_program_and_not_what_shakes_it() -> None:
    """However its stamps scatter."""
    t = STEP * (np.arange(400) + np.random.default_rng(7).uniform(-0.2, 0.2, 400))
    told = {}
    for frequency in (1.0, 12.0):
        omega = 2.0 * np.pi * frequency
        q, v = (0.01 * of for of in swing(t, omega=omega))
        _, live = play(Causal(STEP), log_of(t, q, v))
        pairs = [(i.instrument, -(omega**2) * i.q) for i in live if i.instrument is not None]
        a, true = (np.array(of) for of in zip(*pairs, strict=True))
        told[frequency] = float((a * true).sum() / (true * true).sum())
    assert told[1.0] == pytest.approx(1.0, abs=0.02) and abs(told[12.0]) < 0.2


def test_no_lag_is_paid_in_noise_as_the_weights_say() -> None:
    rng, sd_q, sd_v = np.random.default_rng(3), 5e-5, 2e-3
    t = STEP * np.arange(9 * 300)
    noise = rng.normal(size=(2, len(t), 2))
    twin = Causal(STEP, half=4, lag=0)
    _, live = play(twin, log_of(t, sd_q * noise[0], sd_v * noise[1]))
    of_q, of_v = weights(twin.fit, 4 * STEP)
    theory = (of_q**2).sum(1) * sd_q**2 + (of_v**2).sum(1) * sd_v**2
    for order, name in enumerate(ORDERS):
        apart = stacked(live, name)[::9]  # windows that share no sample
        low, high = chi2.ppf([1e-4, 1 - 1e-4], apart.size)
        assert low < (apart**2).sum() / theory[order] < high
