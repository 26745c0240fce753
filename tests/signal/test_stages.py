"""Laws of features and scaling, and the paper's pipeline as a whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from plain_logs import clock, counts, log_of

from urdyn.errors import InputError
from urdyn.signal import (
    PAPER,
    Pipeline,
    Scaling,
    add_features,
    features,
    hampel,
    normalise,
    reject_outliers,
    smooth,
    stream,
)
from urdyn.types import Log


def driven() -> Log:
    """Two seconds forward, one at rest, one back, at constant current."""
    t = clock(100, 4.0)
    v = np.select([t < 2.0, t < 3.0], [0.5, 0.0], -0.5)[:, None]
    return log_of(t, actual_qd=v, actual_current=np.full_like(v, 2.0))


def test_features_of_a_joint_that_goes_rests_and_returns() -> None:
    found = features(driven())
    assert found.power[[0, 250, 350], 0].tolist() == [1.0, 0.0, -1.0]
    assert found.current_velocity_ratio[[0, 350], 0].tolist() == [4.0, -4.0]
    assert np.isnan(found.current_velocity_ratio[200:300]).all()
    assert found.standstill.sum() == 100
    assert np.flatnonzero(found.reversal).tolist() == [300]
    # one A rad forward a second and one back; half a step is lost and one half is won at corners
    assert found.energy[-1, 0] == pytest.approx(2.0 - 1.0 - 0.01)


def test_energy_gains_nothing_in_a_gap_or_where_nothing_was_measured() -> None:
    log = driven().slice(0, 200)
    t, v = log.t.copy(), log.channels["actual_qd"].copy()
    t[100:] += 60.0
    v[50] = np.nan
    energy = features(log_of(t, actual_qd=v, actual_current=log.channels["actual_current"])).energy
    assert energy[-1, 0] == pytest.approx(1.0 * (199 - 3) / 100)


def test_temperature_rises_from_its_first_value() -> None:
    heat = np.array([[np.nan, 30.0], [25.0, np.nan], [26.0, 29.0]])
    rise = features(log_of(clock(10, 0.2), joint_temperatures=heat, actual_q=heat)).temperature_rise
    assert np.array_equal(rise, [[np.nan, 0.0], [0.0, np.nan], [1.0, -1.0]], equal_nan=True)


def test_scaling_is_undone_by_its_inverse() -> None:
    log = add_features(driven())
    scaling = Scaling.standard(log)
    back = scaling.invert(scaling.apply(log))
    for name, values in log.channels.items():
        np.testing.assert_allclose(back.channels[name], values, rtol=1e-14, atol=1e-14)


def test_standard_channels_have_mean_zero_and_deviation_one() -> None:
    x = np.random.default_rng(7).normal(5.0, 3.0, size=(400, 3))
    x[:, 1], x[:, 2], x[7, 0] = 0.1, np.nan, np.nan
    out = normalise(log_of(clock(100, 3.99), actual_q=x, robot_mode=x)).channels
    assert np.nanmean(out["actual_q"][:, 0]) == pytest.approx(0.0, abs=1e-13)
    assert np.nanstd(out["actual_q"][:, 0]) == pytest.approx(1.0)
    assert np.abs(out["actual_q"][:, 1]).max() < 1e-15
    assert np.isnan(out["actual_q"][:, 2]).all()
    assert np.array_equal(out["robot_mode"], x, equal_nan=True)


def test_limits_become_minus_one_and_one() -> None:
    log = log_of(clock(1, 2.0), actual_q=np.array([[-6.0, 0.0], [0.0, 1.0], [6.0, 2.0]]))
    out = normalise(log, limits={"actual_q": ([-6.0, 0.0], [6.0, 2.0]), "actual_qd": (0.0, 1.0)})
    assert out.channels["actual_q"].tolist() == [[-1, -1], [0, 0], [1, 1]]


@pytest.mark.parametrize("limits", [(1.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (0.0, np.inf)])
def test_limits_that_bound_nothing_are_refused(limits: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="actual_q"):
        normalise(driven(), limits={"actual_q": limits})


def test_a_scaling_can_be_undone_or_is_none() -> None:
    with pytest.raises(InputError, match="no scale of 0"):
        Scaling({"actual_q": np.zeros(2)}, {"actual_q": np.array([1.0, 0.0])})
    with pytest.raises(InputError, match="different channels"):
        Scaling({}, {"actual_q": np.ones(2)})


SETTINGS = (
    ("window 0: takes a whole number, 3 or more", lambda log: hampel(log, window=0)),
    ("window 5.5", lambda log: reject_outliers(log, window=5.5)),
    ("sigma -1", lambda log: reject_outliers(log, sigma=-1)),
    ("sigma nan", lambda log: reject_outliers(log, sigma=np.nan)),
    ("'actual_Q' is not in the log; there is actual_current", partial(smooth, channels="actual_Q")),
    ("'nope' is not in the log", partial(reject_outliers, channels=["actual_qd", "nope"])),
    ("'nope' is not in the log", partial(normalise, limits={"nope": (0.0, 1.0)})),
    ("standstill -1: takes a velocity", partial(features, standstill=-1)),
    ("rows -1: takes a whole number, 1 or more", lambda log: next(stream(log, -1))),
)


@pytest.mark.parametrize(("why", "stage"), SETTINGS)
def test_a_setting_that_leaves_a_stage_nothing_to_do_is_refused(
    why: str, stage: Callable[[Log], object]
) -> None:
    with pytest.raises(InputError, match=why):
        stage(driven())


def test_one_channel_is_a_choice_too_and_no_rows_have_no_features() -> None:
    one = smooth(driven(), channels="actual_qd").channels["actual_qd"]
    np.testing.assert_array_equal(one, smooth(driven()).channels["actual_qd"])
    assert not np.array_equal(one, driven().channels["actual_qd"])
    assert features(driven().slice(0, 0)).temperature_rise.shape == (0, 6)


def test_every_stage_of_the_paper_can_be_looked_at() -> None:
    t, rng = clock(125, 20.0), np.random.default_rng(8)
    v = np.cos(np.outer(t, [1.0, 2.0]))
    current = 2 * v + rng.normal(scale=0.05, size=v.shape)
    current[700] = 400.0
    raw = log_of(t, actual_q=np.sin(np.outer(t, [1.0, 2.0])), actual_qd=v, actual_current=current)
    run = PAPER.run(raw)
    names = [name for name, _ in run.stages]
    assert names == ["raw", "filter", "synchronise", "outliers", "features", "normalise"]
    assert run["raw"] is raw
    assert np.allclose(np.diff(run["synchronise"].t), 0.01)
    assert np.isnan(run["outliers"].channels["actual_current"]).any()
    assert "power" in run["features"]
    again = Scaling.standard(run["features"]).invert(run.result)
    np.testing.assert_allclose(again.channels["power"], run["features"].channels["power"])
    assert set(counts(run.result)) == {"outlier beyond 3 sigma"}


def test_without_a_stage_nothing_is_done() -> None:
    log = driven()
    assert Pipeline().run(log).result is log


def test_a_stage_takes_its_settings_by_partial() -> None:
    log = replace(driven(), source=driven().source)
    own = Pipeline((("filter", partial(smooth, window=11)), ("outliers", hampel)))
    assert len(own.run(log).stages) == 3
