"""Stamps that count anything but seconds are told by angles and velocities that disagree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from urdyn.errors import LogError
from urdyn.io import read
from urdyn.io.effort import Effort
from urdyn.signal import condition
from urdyn.signal.seconds import UNITS, unit
from urdyn.types import Log

UR10E = "timestamp,actual_q*6,actual_qd*6,actual_current*6,target_current*6,target_moment*6"
STAND = ("ur-20_01_17-p1", "ur-20_01_17-p2", "ur-20_01_17-p3", "ur-20_01_22-push_pose_1")


def moved(rate: float = 100.0, seconds: float = 8.0) -> Log:
    """Two joints, the second of which stands, and a real sensor's noise."""
    rng, t = np.random.default_rng(1), np.arange(0.0, seconds, 1.0 / rate)
    q = np.column_stack([0.7 * np.sin(1.3 * t), np.full_like(t, 0.4)])
    v = np.column_stack([0.91 * np.cos(1.3 * t), np.zeros_like(t)])
    channels = {
        "actual_q": q + 2e-5 * rng.standard_normal(q.shape),
        "actual_qd": v + 3e-3 * rng.standard_normal(v.shape),
        "actual_current": rng.standard_normal(q.shape),
    }
    return Log(1000.0 + t, channels)


@pytest.mark.parametrize("rate", [10.0, 125.0, 500.0])
@pytest.mark.parametrize("name", ["", *UNITS])
def test_a_unit_is_told_at_any_rate(name: str, rate: float) -> None:
    log = moved(rate)
    assert unit(replace(log, t=log.t / UNITS.get(name, 1.0))) == name


def test_of_what_stands_is_said_to_move_or_has_no_velocity_nothing_is_told() -> None:
    log = moved()
    late = replace(log, t=1e3 * log.t)
    without = {name: x for name, x in log.channels.items() if name != "actual_qd"}
    assert not unit(replace(late, channels=without))
    q, v = log.channels["actual_q"], log.channels["actual_qd"]
    assert not unit(replace(late, channels=log.channels | {"actual_qd": 0.0 * v}))
    noise = q[:1] + 1e-5 * np.random.default_rng(2).standard_normal(q.shape)
    assert not unit(replace(log, channels=log.channels | {"actual_q": noise}))
    assert not unit(log.slice(0, 2)) and not unit(log.slice(0, 1))


def test_a_log_in_milliseconds_is_refused_in_one_line() -> None:
    log = moved()
    with pytest.raises(LogError, match=r"stamps are milliseconds: .* 1,000 times .* divide them"):
        condition(replace(log, t=1e3 * log.t))


def test_real_recordings_are_in_seconds(recordings: Path) -> None:
    """And would be refused in anything else, but for those of an arm that stands."""
    logs = {path.stem: read(path, columns=UR10E) for path in recordings.glob("ur10e*/*.csv")}
    logs["ur3e"] = read(recordings / "ur3e_rtde" / "ur3e_payload_1070g.csv")
    bag = recordings / "ur10_dynamics_bag" / "ur10_exciting_trajectory.db3"
    logs["bag"] = read(bag, effort=Effort("A"))
    for name, log in logs.items():
        assert unit(log) == "", name
        told = unit(replace(log, t=1e3 * log.t))
        assert told == ("" if name in STAND else "milliseconds"), name
