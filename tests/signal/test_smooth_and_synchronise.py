"""Laws of filtering and synchronisation, each from log to log."""

from __future__ import annotations

import numpy as np
import pytest
from plain_logs import clock, counts, log_of
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from urdyn.errors import InputError, LogError
from urdyn.signal import (
    smooth,
    synchronise,
)
from urdyn.types import Log


def streams() -> tuple[Log, Log, Log]:
    """Joint states at 125 Hz, force/torque at 100 Hz, temperatures at 10 Hz, all straight lines."""
    q, f, h = clock(125, 4.0), clock(100, 4.0, 0.003), clock(10, 4.0)
    return (
        log_of(q, actual_q=np.outer(q, [1.0, -2.0]), robot_mode=np.where(q < 2.002, 7.0, 3.0)),
        log_of(f, actual_TCP_force=np.outer(f, np.arange(6.0))),
        log_of(h, joint_temperatures=30 + np.outer(h, [0.1, 0.2])),
    )


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


@pytest.mark.parametrize("origin", [0.0, 1_700_000_000_123_457.0, 1_732_900_000_654_321.0])
def test_a_state_is_held_from_its_own_row_on_whatever_the_clock_began_at(origin: float) -> None:
    """Microseconds since 1970 as seconds are off by a tenth of one."""
    rows = np.arange(500.0)
    out = synchronise(log_of((origin + 1e4 * rows) / 1e6, robot_mode=rows), rate=100.0)
    assert np.array_equal(out.channels["robot_mode"], rows)


def test_a_pose_turns_from_sample_to_sample_through_half_a_turn_too() -> None:
    """Oracle: evenly about an axis, which a rotation vector tells with another sign beyond pi."""
    axis = np.array([0.48, -0.6, 0.64])

    def pose(t: np.ndarray) -> np.ndarray:
        turn = Rotation.from_rotvec(np.outer(3.0 + t, axis)).as_rotvec()
        return np.hstack([np.outer(t, [1.0, 2.0, 3.0]), turn])

    t = clock(125, 1.0)
    seen = pose(t)
    assert (np.abs(np.diff(seen[:, 3:], axis=0)).max(axis=1) > 3.0).sum() == 1
    t, seen = np.delete(t, slice(60, 80)), np.delete(seen, slice(60, 80), axis=0)
    seen[5, 4] = np.nan
    out = synchronise(log_of(t, actual_TCP_pose=seen))
    told, due = out.channels["actual_TCP_pose"], pose(out.t)
    known = (out.t < 0.4721) | (out.t > 0.6399)
    assert (np.isfinite(told).all(axis=1) == known).all()
    np.testing.assert_allclose(told[known, :3], due[known, :3], atol=1e-12)
    turned = Rotation.from_rotvec(told[known, 3:]) * Rotation.from_rotvec(due[known, 3:]).inv()
    assert turned.magnitude().max() < 1e-9


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


@pytest.mark.parametrize("rate", [-5.0, 0.0, np.nan, np.inf])
def test_a_rate_at_which_nothing_comes_is_refused(rate: float) -> None:
    with pytest.raises(InputError, match=r"rate .*: takes a rate above 0"):
        synchronise(*streams(), rate=rate)


@pytest.mark.parametrize(("window", "degree"), [(3, 3), (0, 0), (2.5, 1), (21, -1)])
def test_a_filter_that_determines_nothing_is_refused(window: int, degree: int) -> None:
    with pytest.raises(InputError, match="takes a whole number"):
        smooth(streams()[0], window=window, degree=degree)
