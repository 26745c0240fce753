"""What cannot be used is refused where it enters, by its name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.faults import (
    GLR,
    Algorithm2,
    Costs,
    ShiryaevRoberts,
    Whitened,
    calibrated,
    cells,
    decide,
    detect,
    follow,
    forecast,
    foresee,
    health_index,
    kinks,
    learn_baseline,
    oracle_cusum,
    outlook,
    run,
    stated_baseline,
    tuned_algorithm2,
)
from urdyn.faults.onset import followed

ONE, TWO = stated_baseline(0.0, 1.0), stated_baseline(np.zeros(2), np.ones(2))
Y = np.random.default_rng(0).standard_normal(200)
LEARNT = learn_baseline(Y)
FOLLOWED = followed(ONE, Y[:20])
AHEAD = forecast(Y[:20], ONE, 3.0, 6.0)[0]
TIMES, FAILED = outlook(Costs(), 1.0, 500.0, 250.0, 1000.0)

WRONG: list[tuple[str, Callable[[], Any]]] = [
    ("side: 2 for 1", lambda: detect(Y, ONE, side=[1.0, 1.0])),
    ("tolerance: 3 for 2", lambda: detect(np.zeros((5, 2)), TWO, tolerance=[0.1, 0.1, 0.1])),
    ("tolerance", lambda: detect(Y, ONE, tolerance="much")),
    ("promise", lambda: detect(Y, ONE, promise="10000")),
    ("promise", lambda: detect(Y, ONE, promise=np.inf)),
    ("the detector's own", lambda: detect(Y, ONE, 500.0, detector=GLR())),
    ("the detector's own", lambda: detect(Y, ONE, side=1.0, detector=GLR())),
    ("the detector's own", lambda: detect(Y, ONE, tolerance=0.1, detector=GLR())),
    ("a series", lambda: detect(["a", "b"], ONE)),
    ("a series", lambda: detect([[1.0], [1.0, 2.0]], ONE)),
    ("a series holds text", lambda: run(GLR(), ["a", "b"])),
    ("a series holds complex numbers", lambda: detect(Y + 1j, ONE)),
    ("a series holds objects", lambda: detect([None, *Y], ONE)),
    ("a series holds dates", lambda: detect(np.array(["2026-01-01"], dtype="datetime64[D]"), ONE)),
    ("a baseline holds text", lambda: learn_baseline(["a"] * 200)),
    ("a step holds objects", lambda: GLR().step(GLR().init(1), np.array([None]))),
    ("a series is .* the shape [(][)]", lambda: run(GLR(), np.array(1.0))),
    ("promise True", lambda: detect(Y, ONE, promise=True)),
    ("whitens already", lambda: detect(Y, ONE, detector=Whitened(ONE, GLR()))),
    ("parameters, not inn", lambda: Whitened(ONE, Algorithm2(3.0, 6.0, 0.1, 0.1))),
    ("3 streams", lambda: run(Whitened(TWO, GLR()), np.zeros((5, 3)))),
    ("side: 2 for 3", lambda: run(ShiryaevRoberts(side=np.ones(2)), np.zeros((5, 3)))),
    ("side: 2 for 3", lambda: run(GLR(side=np.ones(2)), np.zeros((5, 3)))),
    ("tolerance: 3 for 1", lambda: run(Whitened(LEARNT, GLR(tolerance=np.zeros(3))), Y)),
    ("side: 3 for 1", lambda: run(Whitened(LEARNT, ShiryaevRoberts(side=np.ones(3))), Y)),
    ("of 1 streams, not 2", lambda: ShiryaevRoberts(healthy=Y).init(2)),
    ("healthy innovations", lambda: ShiryaevRoberts(healthy=["a"])),
    ("one is needed", lambda: ShiryaevRoberts(healthy=np.array([[0.1, np.nan]]))),
    ("one is needed", lambda: ShiryaevRoberts(healthy=np.zeros((0, 1)))),
    ("tolerance", lambda: GLR(tolerance=-3.0)),
    ("side", lambda: GLR(side=2.0)),
    ("ages", lambda: GLR(ages=())),
    ("ages", lambda: GLR(ages=(2, 1))),
    ("ages", lambda: GLR(ages=(0, 1))),
    ("nothing to look for", lambda: cells((), (), ())),
    ("rates", lambda: cells(rates=(0.1, 0.0))),
    ("steps", lambda: cells(steps=(-1.0,))),
    ("variances", lambda: cells(variances=(0.0,))),
    ("the series is", lambda: forecast(np.zeros((5, 2)), ONE, 3.0, 6.0)),
    ("the series is", lambda: forecast(np.zeros(5), TWO, 3.0, 6.0)),
    ("warning level: 3 for 2", lambda: forecast(np.ones((5, 2)), TWO, [1.0, 1.0, 1.0], 6.0)),
    ("critical level", lambda: forecast(Y, ONE, 3.0, "high")),
    ("critical level: 2 for 1", lambda: foresee(ONE, FOLLOWED, 3.0, [6.0, 6.0])),
    ("baseline: takes a Baseline", lambda: foresee(Y, FOLLOWED, 3.0, 6.0)),
    ("state: takes a Kinks", lambda: foresee(ONE, Y, 3.0, 6.0)),
    ("baseline: takes a Baseline", lambda: kinks(Y)),
    ("alternatives: takes a Cells", lambda: ShiryaevRoberts(alternatives=3)),
    ("costs: takes a Costs", lambda: decide(TIMES, FAILED, costs=3)),
    ("costs: takes a Costs", lambda: outlook(None, 0.5)),
    ("hazard", lambda: foresee(ONE, FOLLOWED, 3.0, 6.0, hazard=0.0)),
    ("hazard", lambda: foresee(ONE, FOLLOWED, 3.0, 6.0, hazard=2.0)),
    ("horizon", lambda: AHEAD.health(np.nan)),
    ("candidates", lambda: kinks(ONE, 2)),
    ("inflation", lambda: learn_baseline(Y, inflation=0.0)),
    ("inflation", lambda: learn_baseline(Y, inflation=np.nan)),
    ("inflation 0.1: takes a number, 1 or more", lambda: learn_baseline(Y, inflation=0.1)),
    ("inflation", lambda: stated_baseline(0.0, 1.0, inflation=0.9)),
    ("inflation", lambda: learn_baseline(Y, inflation=[1.1, 1.2])),
    ("level: 2 for 3", lambda: stated_baseline(np.zeros(2), np.ones(3))),
    ("level", lambda: stated_baseline(np.zeros((2, 2)), 1.0)),
    ("0 measured steps", lambda: tuned_algorithm2(np.full(200, np.nan), 9.0)),
    ("3 measured steps", lambda: tuned_algorithm2(Y[:3], 9.0)),
    ("spread", lambda: tuned_algorithm2(np.ones(200), 9.0)),
    ("critical level nan", lambda: tuned_algorithm2(Y, np.nan)),
    ("critical level -5.0 is not beyond", lambda: tuned_algorithm2(Y, -5.0)),
    ("critical level 5.0 is not beyond", lambda: tuned_algorithm2(Y, 5.0, side=-1.0)),
    ("critical level: 2 for 1", lambda: tuned_algorithm2(Y, [5.0, 6.0])),
    ("side up", lambda: tuned_algorithm2(Y, 5.0, side="up")),
    ("slope .*0 or more", lambda: Algorithm2(2.0, 3.0, -0.1, 0.1)),
    ("window", lambda: Algorithm2(2.0, 3.0, 0.1, 0.1, window=2.5)),
    ("critical level", lambda: Algorithm2(3.0, 2.0, 0.1, 0.1)),
    ("critical level", lambda: Algorithm2(0.7, 0.8, 0.1, 0.1, side=-1.0)),
    ("slope", lambda: Algorithm2(2.0, 3.0, "steep", 0.1)),
    ("rate", lambda: oracle_cusum(Y[:, None], 0.0)),
    ("rate", lambda: oracle_cusum(Y[:, None], [0.1, 0.2])),
    ("promise", lambda: calibrated(Y[:, None], 0.0)),
    ("service", lambda: Costs(service="1.0")),
    ("failed", lambda: decide(TIMES, np.full(len(TIMES), np.nan))),
    ("times", lambda: decide(np.full(len(TIMES), np.nan), FAILED)),
    ("probabilities", lambda: decide(TIMES, FAILED[1:])),
    ("times", lambda: decide(np.zeros(0), np.zeros(0))),
    ("notice", lambda: decide(np.array([0.0, 1.0]), np.array([0.0, 1.0]))),
    ("do not fall", lambda: decide(TIMES, FAILED[::-1])),
    ("median", lambda: outlook(Costs(), 1.0, np.nan)),
    ("median -1.0", lambda: outlook(Costs(), 1.0, -1.0)),
    ("ascend", lambda: outlook(Costs(), 1.0, 500.0, 1000.0, 250.0)),
    ("ascend", lambda: outlook(Costs(), 1.0, 500.0, 600.0, 1000.0)),
    ("ascend", lambda: outlook(Costs(), 1.0, 500.0, 250.0, 400.0)),
    ("median", lambda: outlook(Costs(), 1.0, "a", 1.0, 2.0)),
    ("Forecast.failed", lambda: outlook(Costs(), 1.0, np.inf, 50.0, np.inf)),
    ("Forecast.failed", lambda: outlook(Costs(), 1.0, np.inf, 50.0)),
    ("Forecast.failed", lambda: outlook(Costs(), 1.0, 100.0, 50.0, np.inf)),
    ("steps", lambda: AHEAD.failed([1.0, np.nan])),
    ("detector 'x'", lambda: detect(Y, ONE, detector="x")),
    ("detector", lambda: detect(Y, ONE, detector=ShiryaevRoberts)),
    ("detector", lambda: run("x", Y)),
    ("detector", lambda: Whitened(ONE, "x")),
    ("baseline: takes a Baseline", lambda: Whitened(Y, GLR())),
    ("allowed", lambda: Whitened(ONE, GLR(), 0.5)),
    ("warning 2, critical 3", lambda: Algorithm2([1.0, 1.0], [2.0, 2.0, 2.0], 0.1, 0.1)),
    ("reference_slope", lambda: Algorithm2(2.0, 3.0, 0.1, -1.0)),
    ("several forecasts", lambda: health_index(AHEAD, 10.0)),
    ("several forecasts", lambda: health_index(["a"], 10.0)),
    ("horizon", lambda: AHEAD.health([1.0, 2.0])),
    ("statistics", lambda: calibrated(np.zeros((0, 5)), 1e4)),
    ("statistics", lambda: calibrated(np.full((5, 5), np.nan), 1e4)),
    ("1e[+]200 spreads", lambda: forecast([0.0, 1e200], ONE, 3.0, 6.0)),
    ("streams", lambda: GLR().init(0)),
    ("streams", lambda: ShiryaevRoberts().init(2.5)),
    ("each of 1 streams", lambda: follow(ONE, kinks(ONE), np.zeros(3))),
    *(
        ("each of 1 streams", lambda of=of: of.step(of.init(1), np.zeros(3)))
        for of in (ShiryaevRoberts(), GLR(), Algorithm2(2.0, 3.0, 0.1, 0.1), Whitened(ONE, GLR()))
    ),
    ("confidence", lambda: outlook(Costs(), 2.0, 500.0, 250.0, 1000.0)),
]


@pytest.mark.parametrize("said, asked", WRONG)
def test_what_cannot_be_used_is_named(said: str, asked: Callable[[], Any]) -> None:
    with pytest.raises(InputError, match=said):
        asked()


@pytest.mark.filterwarnings("error")
def test_a_baseline_with_one_absurd_row_is_learnt_as_without() -> None:
    absurd = np.where(np.arange(len(Y)) == 5, 1e300, Y)
    np.testing.assert_allclose(learn_baseline(absurd).spread, LEARNT.spread, rtol=0.05)


def test_one_setting_stands_for_all_streams() -> None:
    y = np.random.default_rng(1).standard_normal((40, 2))
    one, each = (detect(y, TWO, side=s, tolerance=0.1) for s in (1.0, [1.0, 1.0]))
    np.testing.assert_array_equal(one.evidence, each.evidence)
    assert forecast(y, TWO, 3.0, 6.0)[1].rise == foresee(TWO, followed(TWO, y), 3.0, 6.0)[1].rise


def test_health_is_a_probability() -> None:
    assert all(0.0 <= AHEAD.health(x) <= 1.0 for x in (-100.0, 0.0, 1.0, 1e3, 1e12))


def test_what_is_masked_was_not_measured() -> None:
    """Neither in a series nor in a baseline, nor in a step."""
    rng = np.random.default_rng(2)
    y, wild = rng.standard_normal(1200), np.arange(1200) % 7 == 0
    wrong = np.ma.masked_array(np.where(wild, 1e6, y), wild)
    as_nan = np.where(wild, np.nan, y)
    found, expected = detect(wrong[1000:], wrong[:1000]), detect(as_nan[1000:], as_nan[:1000])
    np.testing.assert_array_equal(found.evidence, expected.evidence)
    _, verdict = GLR().step(GLR().init(1), wrong[:1])
    assert wild[0] and not verdict.alarm


def test_a_forecast_that_is_printed_is_a_line_of_numbers_not_its_posterior() -> None:
    assert "critical=" in repr(AHEAD) and "posterior" not in repr(AHEAD)
    assert "\n" not in repr(AHEAD)


def test_whole_numbers_may_be_written_with_a_point() -> None:
    paper = Algorithm2(1.0, 2.0, 0.1, 0.2, window=10.0)  # type: ignore[arg-type]
    tuned = tuned_algorithm2(Y, 5.0, window=10.0)  # type: ignore[arg-type]
    assert paper.init(1).theta.shape == tuned.init(1).theta.shape == (11, 1)
    glr = GLR(ages=(1.0, 4.0))  # type: ignore[arg-type]
    assert len(run(glr, Y).verdicts) == len(Y)
    assert kinks(ONE, 160.0).onset.shape == (160,)  # type: ignore[arg-type]
