"""Every detector through one protocol, and each against what it is said to be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from urdyn.bench.fault_noises import Noise
from urdyn.errors import UrdynError
from urdyn.faults import (
    GLR,
    Algorithm2,
    Cusum,
    ShiryaevRoberts,
    Whitened,
    cells,
    detect,
    oracle_cusum,
    run,
    stated_baseline,
    tuned_algorithm2,
)
from urdyn.tracking.output.checkpoint import _cells, _filled
from urdyn.types import Array

DETECTORS: list[Any] = [
    ShiryaevRoberts(1000.0),
    Cusum(1000.0),
    GLR(1000.0),
    Algorithm2(3.0, 6.0, 0.05, 0.1, gain=0.2),
    Whitened(stated_baseline(np.zeros(3), np.ones(3)), ShiryaevRoberts(1000.0)),
]


def ramps(steps: int = 160, onset: int = 60, rate: float = 0.1, seed: int = 1) -> Array:
    """Three streams of unit noise; the second one grows."""
    y = np.random.default_rng(seed).standard_normal((steps, 3))
    y[:, 1] += rate * np.maximum(np.arange(steps) - onset, 0.0)
    return y


@pytest.mark.parametrize("detector", DETECTORS)
def test_a_ramp_is_found_where_it_is(detector: Any) -> None:
    found = run(detector, ramps())
    assert found.alarm is not None and found.alarm > 60
    assert found.stream == 1


@pytest.mark.parametrize("detector", DETECTORS)
def test_a_detector_goes_on_from_its_written_state(detector: Any) -> None:
    y = ramps()
    state = detector.init(3)
    for row in y[:80]:
        state, _ = detector.step(state, row)
    again = _filled(detector.init(3), dict(_cells(state, "at")), "at")
    _, one = detector.step(state, y[80])
    _, other = detector.step(again, y[80])
    assert one.evidence == other.evidence
    np.testing.assert_array_equal(one.streams, other.streams)


@pytest.mark.parametrize("detector", DETECTORS)
def test_an_alarm_lasts_until_it_is_acknowledged(detector: Any) -> None:
    state, y = detector.init(3), ramps()
    for row in y:
        state, verdict = detector.step(state, row)
    assert verdict.alarm
    _, verdict = detector.step(detector.acknowledged(state), y[0])
    assert not verdict.alarm


def test_shiryaev_roberts_sums_over_all_onsets() -> None:
    """Against the sum written out, of a step, whose cell is one."""
    grid = cells(rates=(), steps=(0.7,), variances=())
    detector = ShiryaevRoberts(100.0, grid, side=1.0)
    e = np.random.default_rng(2).standard_normal(30)
    L = np.exp(0.7 * np.clip(e, -2.5, 2.5) - grid.psi[0])
    M = sum(np.prod(L[onset:]) for onset in range(30))
    found = run(replace(detector, promise=1e9), e[:, None])
    assert found.evidence[-1] == pytest.approx(M / 1e9, rel=1e-12)


@pytest.mark.parametrize("rate", [0.004, 0.05, 0.8])
def test_a_ramp_passes_its_cells_at_its_rate(rate: float) -> None:
    """But for the last cell, whose mean is clipped."""
    grid = cells(rates=(rate,), steps=(), variances=())
    rising = grid.side > 0.0
    mean, move, stay = (of[rising] for of in (grid.tilt, grid.move, grid.stay))
    np.testing.assert_allclose((np.diff(mean) * move[1:])[:-1], rate, rtol=1e-12)
    np.testing.assert_allclose(stay[:-1] + move[1:], 1.0, rtol=1e-12)


def test_the_likeliest_onset_never_says_more_than_all() -> None:
    y = ramps(rate=0.05)
    for rows in (y, -y, y[::-1]):
        one, all_ = run(Cusum(1e130), rows), run(ShiryaevRoberts(1e130), rows)
        assert (one.evidence <= all_.evidence * (1.0 + 1e-12)).all()


def test_generalised_likelihood_finds_the_onset() -> None:
    found = run(GLR(1000.0), ramps(rate=0.3))
    assert found.onset is not None and abs(found.onset - 60) <= 5  # ages are a grid


@pytest.mark.parametrize("every", [1, 2, 5])
def test_a_likelihood_ratio_judges_by_what_was_measured(every: int) -> None:
    """One sd beyond what is tolerated, n times: sqrt(n), however many rows are missing between."""
    rows = np.full((90, 1), np.nan)
    rows[::-every] = 2.0
    detector = GLR(side=1, tolerance=1.0)
    state = detector.init(1)
    for row in rows:
        state, verdict = detector.step(state, row)
    np.testing.assert_allclose(verdict.evidence, 90 / every / detector._threshold(1) ** 2)


@pytest.mark.parametrize("unmeasured", [[], [3, 20]])
def test_the_oracle_is_the_best_onset_of_the_known_ramp(unmeasured: list[int]) -> None:
    """What was not measured tells of no onset, and the ramp goes on meanwhile."""
    e, rate = np.random.default_rng(3).standard_normal((25, 1)), 0.2
    e[unmeasured] = np.nan
    found = oracle_cusum(e, rate)
    said = []
    for onset in range(25):
        m = rate * np.arange(1, 26 - onset)
        said.append(float(np.nansum(m * e[onset:, 0] - 0.5 * m**2)))
    assert found[-1, 0] == pytest.approx(max(said), rel=1e-12)
    assert np.isfinite(found).all()


def test_algorithm_2_is_as_the_paper_writes_it() -> None:
    detector = Algorithm2(warning=0.2, critical=0.25, slope=0.001, reference_slope=0.004, window=10)
    theta = 0.1 + 0.0025 * np.maximum(np.arange(100) - 20.0, 0.0)
    state, first = detector.init(1), None
    for t, value in enumerate(theta):
        state, verdict = detector.step(state, np.array([value]))
        if verdict.alarm and first is None:
            first = t
            status = detector.status(state)[0]
    assert first == 61  # the first above .2
    assert status.kind == "friction_increase"
    assert status.severity == pytest.approx(0.0025 / 0.05)
    assert status.confidence == pytest.approx(0.0025 / 0.004)
    assert status.time_to_failure == pytest.approx((0.25 - 0.2025) / 0.0025)
    past = detector.status(state)[0]
    assert past.severity > 1.0
    assert past.time_to_failure == pytest.approx((0.25 - theta[-1]) / 0.0025)


def test_algorithm_2_names_its_kind_where_one_parameter_of_two_is_beyond() -> None:
    detector = Algorithm2(warning=0.2, critical=1.0, slope=0.005, reference_slope=0.01)
    found = run(detector, np.stack([0.02 * np.arange(40.0), np.zeros(40)], axis=1))
    assert found.alarm is not None and found.stream == 0
    assert found.verdicts[found.alarm].kind == detector.kind


def test_algorithm_2_turns_its_signs_for_what_falls() -> None:
    detector = Algorithm2(0.8, 0.7, 0.001, 0.005, side=-1.0, kind="health_degradation")
    z = 1.0 - 0.005 * np.maximum(np.arange(80) - 20.0, 0.0)
    found = run(detector, z[:, None])
    assert found.alarm == 61
    assert detect(z, stated_baseline(1.0, 0.01), detector=detector).alarms == found.alarms
    assert found.verdicts[61].kind == "health_degradation"


@pytest.mark.parametrize("steps", [200, 1000])
def test_a_tuned_algorithm_2_keeps_its_promise_on_white_noise(steps: int) -> None:
    """However well its baseline is known: .095 of 6000 runs at most, to three standard errors."""
    rng, runs = np.random.default_rng(4), 6000
    detector = tuned_algorithm2(rng.standard_normal((steps, runs)), 9.0, 10_000.0 / runs)
    state, alarmed = detector.init(runs), np.zeros(runs, dtype=bool)
    for row in rng.standard_normal((1000, runs)):
        state, verdict = detector.step(state, row)
        alarmed |= verdict.streams >= 1.0
    allowed = 1.0 - np.exp(-0.1)
    assert alarmed.mean() < allowed + 3.0 * np.sqrt(allowed * (1.0 - allowed) / runs)


def test_a_tuned_algorithm_2_stands_where_noise_reaches_beyond_the_critical_level() -> None:
    """Its levels are still two, and it still tells a parameter that rises beyond both."""
    rng = np.random.default_rng(6)
    detector = tuned_algorithm2(rng.standard_normal((1000, 2)), 0.6)
    assert (detector.warning > 0.6).all() and (detector.critical > detector.warning).all()
    found = run(detector, rng.standard_normal((200, 2)) + 0.1 * np.arange(200)[:, None])
    assert found.detected


def test_a_change_within_the_tolerance_is_none() -> None:
    rng = np.random.default_rng(5)
    healthy = 10.0 + 0.1 * rng.standard_normal((1000, 1))
    moved = 10.15 + 0.1 * rng.standard_normal((2000, 1))  # 1.5 %
    assert detect(moved, healthy).detected
    assert not detect(moved, healthy, tolerance=0.2).detected
    assert detect(moved + 0.15, healthy, tolerance=0.2).detected


@pytest.mark.parametrize("detector", [GLR(), ShiryaevRoberts()])
def test_what_swings_in_health_is_tolerated_and_outliers_and_gaps_are_no_swing(
    detector: Any,
) -> None:
    rng, t = np.random.default_rng(3), np.arange(2000.0)[:, None]
    white = rng.standard_normal((2000, 40))
    swung = white + 0.5 * np.sin(2.0 * np.pi * t / 700.0 + rng.uniform(0.0, 2.0 * np.pi, 40))
    wild, gaps = swung.copy(), swung.copy()
    wild[::97] = 1e6 * rng.choice([-1.0, 1.0], wild[::97].shape)
    gaps[::5] = np.nan
    still, *told = (np.median(detector.taught(x).tolerance) for x in (white, swung, wild, gaps))
    assert still == 0.0
    # The variance of 40 batch means is known to sqrt(2 / 40); a median of 40 amplitudes, to .022.
    np.testing.assert_allclose(told, 0.5, rtol=0.09)


def test_a_side_that_does_not_matter_raises_nothing() -> None:
    rng = np.random.default_rng(6)
    healthy, fallen = rng.standard_normal((1000, 1)), rng.standard_normal((300, 1)) - 2.0
    assert detect(fallen, healthy, side=-1).detected
    assert not detect(fallen, healthy, side=+1).detected


def test_a_growing_variance_is_found() -> None:
    rng = np.random.default_rng(7)
    series = rng.standard_normal((400, 1))
    series[200:] *= 3.0
    found = detect(series, rng.standard_normal((1000, 1)))
    assert found.alarm is not None and 200 < found.alarm < 240
    only = ShiryaevRoberts(10_000.0, cells(rates=(), steps=()))
    found = run(only, series / 1.1)
    assert found.alarm is not None and 200 < found.alarm < 240
    assert found.verdicts[found.alarm].kind == "variance"


def test_a_spread_that_doubles_is_found_though_a_wrong_one_is_followed() -> None:
    """Beyond LOOSE it is 2 / (1.04 * 1.25): .25 nats a step, of 12 to 13 that the promise asks."""
    rng = np.random.default_rng(9)
    y = Noise().draw(rng, 1600, 40)
    y[1200:] *= 2.0
    found = [detect(y[1000:, i], y[:1000, i]) for i in range(40)]
    late = [np.inf if f.alarm is None else f.alarm - 200.0 for f in found]
    assert np.median(late) < 100.0 and np.isfinite(late).all()
    named = [f.verdicts[f.alarm].kind == "variance" for f in found if f.alarm is not None]
    assert np.mean(named) > 0.5  # .75 of 120


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda: detect(np.zeros((5, 2)), np.random.default_rng(8).normal(size=(200, 3))), "3 str"),
        (lambda: detect(np.zeros(5), np.zeros(1000)), "does not move"),
        (lambda: detect(np.zeros(5), np.ones(50)), "50 measured steps"),
        (lambda: detect(np.zeros(5), stated_baseline(0.0, 1.0), tolerance=-1.0), "tolerance"),
        (lambda: detect(np.zeros(5), stated_baseline(0.0, 1.0), side=5.0), "side"),
        (lambda: detect(np.zeros(5), stated_baseline(0.0, 1.0), side=np.nan), "side"),
        (lambda: ShiryaevRoberts(0.0), "promise"),
        (lambda: ShiryaevRoberts(tolerance=-1.0), "tolerance"),
        (lambda: Algorithm2(1.0, 1.0, 0.1, 0.1), "severity"),
        (lambda: stated_baseline(0.0, -1.0), "positive"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(asked: Any, said: str) -> None:
    with pytest.raises(UrdynError, match=said):
        asked()
