"""Laws of the paper's stages, each from log to log."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.signal import savgol_filter
from scipy.stats import binom, norm

from urdyn.errors import LogError
from urdyn.signal import (
    DEFAULT,
    PAPER,
    Pipeline,
    Scaling,
    add_features,
    features,
    hampel,
    normalise,
    reject_outliers,
    smooth,
    synchronise,
)
from urdyn.types import Array, Log


def log_of(t: Array, **channels: Array) -> Log:
    return Log(t, channels)


def clock(rate: float, seconds: float, start: float = 0.0) -> Array:
    return start + np.arange(round(seconds * rate) + 1) / rate


def counts(log: Log) -> dict[str, int]:
    return {defect.kind: defect.count for defect in log.defects}


def test_smoothing_is_savitzky_golay_between_gaps() -> None:
    t = clock(125, 1.0)
    t[60:] += 1.0
    x = np.random.default_rng(1).normal(size=(126, 2))
    out = smooth(log_of(t, actual_current=x, robot_mode=x)).channels
    for part in (slice(None, 60), slice(60, None)):
        theirs = savgol_filter(x[part], 21, 3, axis=0)
        np.testing.assert_allclose(out["actual_current"][part], theirs, atol=1e-14)
    assert np.array_equal(out["robot_mode"], x)


def test_smoothing_serves_every_stream_at_its_own_rate() -> None:
    x = np.full((1001, 1), np.nan)
    x[::10, 0] = np.random.default_rng(2).normal(size=101)
    out = smooth(log_of(clock(100, 10.0), joint_temperatures=x)).channels["joint_temperatures"]
    assert np.array_equal(out[::10, 0], savgol_filter(x[::10, 0], 21, 3))
    assert np.isnan(out).sum() == np.isnan(x).sum()


def test_what_is_too_short_to_smooth_is_kept_and_counted() -> None:
    log = log_of(clock(100, 0.1), actual_q=np.random.default_rng(3).normal(size=(11, 6)))
    out = smooth(log)
    assert np.array_equal(out.channels["actual_q"], log.channels["actual_q"])
    assert sum(counts(out).values()) == 66


def streams() -> tuple[Log, Log, Log]:
    """Joint states at 125 Hz, force/torque at 100 Hz, temperatures at 10 Hz, all straight lines."""
    q, f, h = clock(125, 4.0), clock(100, 4.0, 0.003), clock(10, 4.0)
    return (
        log_of(q, actual_q=np.outer(q, [1.0, -2.0]), robot_mode=np.where(q < 2.002, 7.0, 3.0)),
        log_of(f, actual_TCP_force=np.outer(f, np.arange(6.0))),
        log_of(h, joint_temperatures=30 + np.outer(h, [0.1, 0.2])),
    )


def test_straight_lines_survive_synchronisation_at_every_rate() -> None:
    out = synchronise(*streams())
    np.testing.assert_allclose(out.t, clock(100, 4.0), atol=1e-12)
    np.testing.assert_allclose(out.channels["actual_q"], np.outer(out.t, [1, -2]), atol=1e-12)
    heat = 30 + np.outer(out.t, [0.1, 0.2])
    np.testing.assert_allclose(out.channels["joint_temperatures"], heat, rtol=1e-13)
    force = out.channels["actual_TCP_force"]
    assert np.isnan(force[0]).all()  # before its first sample: never extrapolated
    np.testing.assert_allclose(force[1:], np.outer(out.t[1:], np.arange(6.0)), atol=1e-12)


def test_a_state_is_held_never_averaged() -> None:
    assert set(np.unique(synchronise(*streams()).channels["robot_mode"])) == {3.0, 7.0}


def test_synchronisation_says_what_it_filled() -> None:
    found = counts(synchronise(*streams()))
    # of ten rows between two temperatures one is on a sample and none of the others is near one
    assert found == {"joint_temperatures not measured within half a period": 360}


def test_several_logs_are_one_log_with_rows_left_empty() -> None:
    states, _, heat = streams()
    t = np.union1d(states.t, heat.t)
    channels = {}
    for log in (states, heat):
        for name, values in log.channels.items():
            channels[name] = np.full((len(t), *values.shape[1:]), np.nan)
            channels[name][np.isin(t, log.t)] = values
    together, apart = synchronise(Log(t, channels)), synchronise(states, heat)
    assert np.array_equal(together.t, apart.t)
    for name, values in apart.channels.items():
        assert np.array_equal(together.channels[name], values, equal_nan=True)


def test_nothing_is_interpolated_across_a_gap() -> None:
    t = clock(125, 2.0)
    t = t[(t < 0.5) | (t > 1.5)]
    x = np.stack([t, t], axis=1)
    other = log_of(clock(100, 2.0), actual_current=np.ones((201, 2)))
    out = synchronise(log_of(t, actual_q=x), other)
    inside = (out.t > 0.501) & (out.t < 1.499)
    assert inside.sum() == 99
    assert np.isnan(out.channels["actual_q"][inside]).all()
    assert np.isfinite(out.channels["actual_current"]).all()
    assert counts(out)["gap in actual_q"] == 1


def test_a_night_is_not_a_million_rows() -> None:
    day = clock(125, 1.0)
    t = np.concatenate([day, day + 36000.0])
    out = synchronise(log_of(t, actual_q=np.ones((len(t), 6))))
    assert len(out) == 202
    assert np.isfinite(out.channels["actual_q"]).all()


def test_synchronising_nothing_and_twice_the_same_are_refused() -> None:
    states, *_ = streams()
    with pytest.raises(LogError, match="two logs have actual_q"):
        synchronise(states, states)
    with pytest.raises(LogError, match="nothing to synchronise"):
        synchronise(states.slice(0, 0))


@pytest.mark.parametrize("robust", [False, True])
def test_three_sigma_marks_as_many_as_a_normal_variable_has(robust: bool) -> None:
    n = 60000
    x = np.random.default_rng(4).normal(size=(n, 1))
    marked = np.isnan(
        reject_outliers(log_of(clock(100, n / 100)[:-1], actual_current=x), robust=robust).channels[
            "actual_current"
        ]
    ).sum()
    # a spread that is 1 % wrong (MAD at this length) moves the rate by 10 %
    rate, slack = 2 * norm.sf(3), 1.1 if robust else 1.0
    assert binom.ppf(1e-4, n, rate / slack) <= marked <= binom.ppf(1 - 1e-4, n, rate * slack)


def test_outliers_are_counted_and_only_marked() -> None:
    x = np.random.default_rng(5).normal(size=(500, 2))
    x[100, 1] = 50.0
    log = log_of(clock(100, 4.99), actual_q=x, robot_mode=x[:, 1])
    out = reject_outliers(log, sigma=6)
    assert np.argwhere(np.isnan(out.channels["actual_q"])).tolist() == [[100, 1]]
    assert counts(out) == {"outlier beyond 6 sigma": 1}
    assert out.channels["robot_mode"][100] == 50.0


def test_three_sigma_finds_nothing_among_ten_and_the_median_does() -> None:
    x = np.zeros((10, 1))
    x[:, 0] = np.arange(10) / 10
    x[5] = 1e6
    log = log_of(clock(100, 0.09), actual_q=x)
    assert np.isfinite(reject_outliers(log).channels["actual_q"]).all()
    marked = reject_outliers(log, robust=True).channels["actual_q"]
    assert np.flatnonzero(np.isnan(marked)).tolist() == [5]


def test_hampel_finds_the_spikes_of_a_moving_joint_and_nothing_else() -> None:
    t = clock(100, 10.0)
    x = np.sin(t)[:, None]
    x[[0, 300, 301, 700]] += 0.5
    out = hampel(log_of(t, actual_q=x), sigma=5)
    assert np.flatnonzero(np.isnan(out.channels["actual_q"])).tolist() == [0, 300, 301, 700]


def test_a_moving_window_does_not_see_across_a_gap() -> None:
    t = clock(100, 1.0)[:100]
    t[50:] += 9.0
    x = np.random.default_rng(6).normal(size=(100, 1))
    x[50:] += 100.0
    out = reject_outliers(log_of(t, actual_q=x), window=41, sigma=5)
    assert np.isfinite(out.channels["actual_q"]).all()


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("window", [None, 21])
def test_rest_and_silence_hold_no_outliers(robust: bool, window: int | None) -> None:
    rest, silence = np.full((200, 1), 0.1), np.full((200, 1), np.nan)
    log = log_of(clock(100, 1.99), actual_q=rest, actual_qd=silence)
    out = reject_outliers(log, robust=robust, window=window)
    assert np.array_equal(out.channels["actual_q"], rest)
    assert np.isnan(out.channels["actual_qd"]).all()
    assert not out.defects


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
    out = normalise(log, limits={"actual_q": ([-6.0, 0.0], [6.0, 2.0]), "not_there": (0.0, 1.0)})
    assert out.channels["actual_q"].tolist() == [[-1, -1], [0, 0], [1, 1]]


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


def test_by_default_nothing_is_done() -> None:
    log = driven()
    assert DEFAULT.run(log).result is log


def test_a_stage_takes_its_settings_by_partial() -> None:
    log = replace(driven(), source=driven().source)
    own = Pipeline((("filter", partial(smooth, window=11)), ("outliers", hampel)))
    assert len(own.run(log).stages) == 3
