"""What is in a wrong unit is told by angles and velocities that disagree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from urdyn.errors import LogError
from urdyn.io import read
from urdyn.io.effort import Effort
from urdyn.signal import condition
from urdyn.signal.misplaced import misplaced
from urdyn.signal.units import DEGREES, ENOUGH, EXCHANGED, ROWS, STAMPS, unfilled, wrong_unit
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


def six(rate: float) -> Log:
    """Six joints that swing, each at its own pace, but for the last, which stands."""
    rng, t = np.random.default_rng(1), np.arange(0.0, 8.0, 1.0 / rate)
    size, omega = np.array([1.0, 0.7, 0.5, 0.4, 0.3, 0.0]), np.array([0.5, 0.7, 1.1, 1.7, 2.3, 1.0])
    phase = omega * t[:, None] + np.arange(6)
    channels = {
        "actual_q": size * np.sin(phase) + 2e-5 * rng.standard_normal(phase.shape),
        "actual_qd": size * omega * np.cos(phase) + 3e-3 * rng.standard_normal(phase.shape),
        "actual_current": rng.standard_normal(phase.shape),
    }
    return Log(1000.0 + t, channels)


def in_degrees(log: Log, of: str) -> Log:
    """The log whose velocities, or angles, are in degrees."""
    name = {"velocities": "actual_qd", "angles": "actual_q"}[of]
    return replace(log, channels=log.channels | {name: np.degrees(log.channels[name])})


def exchanged(log: Log) -> Log:
    """The log whose velocities stand in the place of its angles, and these in theirs."""
    q, v = log.channels["actual_q"], log.channels["actual_qd"]
    return replace(log, channels=log.channels | {"actual_q": v, "actual_qd": q})


@pytest.mark.parametrize("rate", [10.0, 125.0, 500.0])
@pytest.mark.parametrize("name", ["", *STAMPS])
def test_what_stamps_count_is_told_at_any_rate(name: str, rate: float) -> None:
    log = moved(rate)
    assert wrong_unit(replace(log, t=log.t / STAMPS.get(name, 1.0))) == name


@pytest.mark.parametrize("rate", [10.0, 100.0, 125.0, 500.0])
def test_stamps_that_are_row_numbers_are_told_from_a_unit(rate: float) -> None:
    log = moved(rate)
    assert wrong_unit(replace(log, t=np.arange(float(len(log))))) == ROWS


def test_stamps_of_a_kilohertz_in_milliseconds_are_not_row_numbers() -> None:
    log = moved(1000.0)
    assert wrong_unit(replace(log, t=np.arange(float(len(log))))) == "milliseconds"


def test_velocities_that_nobody_filled_in_are_refused_where_angles_change() -> None:
    log = moved()
    nothing = np.zeros_like(log.channels["actual_qd"])
    log = replace(log, channels=log.channels | {"actual_qd": nothing})
    with pytest.raises(LogError, match="velocities are all zero, and its angles change"):
        condition(log)
    still = np.broadcast_to(log.channels["actual_q"][:1], nothing.shape)
    assert not unfilled(replace(log, channels=log.channels | {"actual_q": still}))


@pytest.mark.parametrize("rate", [10.0, 125.0, 500.0])
@pytest.mark.parametrize("of", DEGREES)
def test_degrees_are_told_at_any_rate(of: str, rate: float) -> None:
    assert wrong_unit(in_degrees(moved(rate), of)) == of


def test_degrees_are_told_of_a_joint_that_moves_for_a_while() -> None:
    """Though noise of what stands is most of the rows: it goes nowhere."""
    log = moved()
    for name in ("actual_q", "actual_qd"):
        still = log.channels[name][:, 1:] + np.zeros(9)
        still += 3e-3 * np.random.default_rng(3).standard_normal(still.shape)
        log = replace(log, channels=log.channels | {name: np.hstack([log.channels[name], still])})
    assert not wrong_unit(log) and wrong_unit(in_degrees(log, "velocities")) == "velocities"


def test_a_few_torn_velocities_are_no_unit() -> None:
    """They make most of the way that velocities tell of, and are fewer than ENOUGH."""
    log = moved()
    v = log.channels["actual_qd"].copy()
    v[10 : 10 + ENOUGH // 4, 0] = 57.0 * v[10 : 10 + ENOUGH // 4, 0] + 1e4
    assert not wrong_unit(replace(log, channels=log.channels | {"actual_qd": v}))


def test_of_what_stands_is_said_to_move_or_has_no_velocity_nothing_is_told() -> None:
    log = moved()
    late = replace(log, t=1e3 * log.t)
    without = {name: x for name, x in log.channels.items() if name != "actual_qd"}
    assert not wrong_unit(replace(late, channels=without))
    q, v = log.channels["actual_q"], log.channels["actual_qd"]
    assert not wrong_unit(replace(late, channels=log.channels | {"actual_qd": 0.0 * v}))
    noise = q[:1] + 1e-5 * np.random.default_rng(2).standard_normal(q.shape)
    assert not wrong_unit(replace(log, channels=log.channels | {"actual_q": noise}))
    assert not wrong_unit(log.slice(0, 2)) and not wrong_unit(log.slice(0, 1))


def test_a_log_in_milliseconds_is_refused_in_one_line() -> None:
    log = moved()
    with pytest.raises(LogError, match=r"stamps are milliseconds: .* 1,000 times .* divide them"):
        condition(replace(log, t=1e3 * log.t))


def test_angles_and_velocities_that_are_exchanged_are_told() -> None:
    with pytest.raises(LogError, match=r"its angles are velocities, .*: exchange their columns"):
        condition(exchanged(moved()))


@pytest.mark.parametrize(("of", "asked"), [("velocities", "deg/s"), ("angles", "degrees")])
def test_a_log_in_degrees_is_refused_in_one_line(of: str, asked: str) -> None:
    log, small = moved(), {}
    for name in ("actual_q", "actual_qd"):  # within two turns, even if those are 12 degrees
        small[name] = 0.2 * log.channels[name]
    log = replace(log, channels=log.channels | small)
    with pytest.raises(LogError, match=rf"velocities do not fit its angles: .*{of} .*{asked}\?"):
        condition(in_degrees(log, of))


@pytest.mark.parametrize("rate", [10.0, 125.0])
def test_velocities_of_the_opposite_sign_are_told_of_each_joint(rate: float) -> None:
    log = six(rate)
    assert not misplaced(log)
    for joints, which in ((slice(6), "0, 1, 2, 3, 4"), ([2], "2"), ([1, 4], "1, 4")):
        turned = log.channels["actual_qd"].copy()
        turned[:, joints] *= -1.0
        with pytest.raises(LogError, match=f"against .* joints {which}: change their sign"):
            condition(replace(log, channels=log.channels | {"actual_qd": turned}))


@pytest.mark.parametrize("order", [[2, 1, 0, 3, 4, 5], [1, 2, 0, 3, 4, 5], [0, 1, 2, 3, 5, 4]])
def test_velocities_in_the_columns_of_other_joints_are_told(order: list[int]) -> None:
    log = six(100.0)
    which = ", ".join(str(j) for j in range(6) if order[j] not in (j, 5))  # the last stands
    swapped = log.channels["actual_qd"][:, order]
    with pytest.raises(LogError, match=f"joints {which} fit the angles of others: exch"):
        condition(replace(log, channels=log.channels | {"actual_qd": swapped}))


@pytest.mark.parametrize("spoilt", ["noisy", "late", "rounded", "stuck", "off", "torn", "a third"])
def test_a_poor_velocity_is_not_misplaced(spoilt: str) -> None:
    log, rng = six(100.0), np.random.default_rng(4)
    v, q = log.channels["actual_qd"].copy(), log.channels["actual_q"].copy()
    match spoilt:
        case "noisy":
            v += 0.1 * rng.standard_normal(v.shape)
        case "late":
            v = np.roll(v, 20, axis=0)
        case "rounded":
            v, q = np.round(v, 1), np.round(q, 3)
        case "stuck":
            v[100:, :2], q[100:, 3] = v[100, :2], q[100, 3]
        case "off":
            v += 0.05
        case "torn":
            v[::7] = rng.standard_normal(v[::7].shape)
        case "a third":
            v *= 1.3
    assert not misplaced(replace(log, channels=log.channels | {"actual_qd": v, "actual_q": q}))


def test_real_recordings_are_in_si(recordings: Path) -> None:
    """And would be refused in anything else, but for those of an arm that stands."""
    logs = {path.stem: read(path, columns=UR10E) for path in recordings.glob("ur10e*/*.csv")}
    logs["ur3e"] = read(recordings / "ur3e_rtde" / "ur3e_payload_1070g.csv")
    bag = recordings / "ur10_dynamics_bag" / "ur10_exciting_trajectory.db3"
    logs["bag"] = read(bag, effort=Effort("A"))
    for name, log in logs.items():
        assert wrong_unit(log) == "", name
        told = wrong_unit(replace(log, t=1e3 * log.t))
        assert told == ("" if name in STAND else "milliseconds"), name
        told = wrong_unit(in_degrees(log, "velocities"))
        assert told == ("" if name in STAND else "velocities"), name
        assert wrong_unit(exchanged(log)) == ("" if name in STAND else EXCHANGED), name
        assert not misplaced(log), name
        v = log.joint("actual_qd")
        for other in (-v, np.roll(v, 1, axis=1)):
            spoilt = replace(log, channels=log.channels | {"actual_qd": other})
            assert bool(misplaced(spoilt)) == (name not in STAND), name
