"""An arm that a hand moves, or without power, has no currents: it says so itself."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.signal import condition, measured, samples
from urdyn.simulate import simulate
from urdyn.types import Log

HAND = slice(40, 70)


@pytest.fixture(scope="module")
def log() -> Log:
    return simulate(load_arm("ur5e"), 2.0, 50.0, 3)[0]


def _with(log: Log, **status: tuple[float, float]) -> Log:
    """With a channel that is one value, and another under the hand."""
    channels = dict(log.channels)
    for name, (usual, there) in status.items():
        channels[name] = np.full(len(log), float(usual))
        channels[name][HAND] = there
    return Log(log.t, channels)


@pytest.mark.parametrize(
    "status",
    [
        {"robot_mode": (7, 6)},  # backdrive
        {"robot_mode": (7, 3)},  # power off
        {"robot_status_bits": (3, 7)},  # freedrive: power, program, and the teach button
        {"robot_mode": (7, 7), "robot_status_bits": (1, 5)},
        {"robot_mode": (np.nan, 5)},
    ],
)
def test_its_rows_are_without_currents_and_counted(log: Log, status) -> None:
    log = _with(log, **status)
    told = measured(log)
    (defect,) = told.defects
    assert defect.count == 30 and "by hand or without power" in defect.kind
    for currents in (condition(log).current, [s.current for s in samples(log)]):
        assert np.isnan(currents[HAND]).all() and np.isfinite(currents).sum() == 6 * (len(log) - 30)
    without = np.isnan(told.joint("actual_current")).all(axis=1)
    assert [s.undriven for s in samples(log)] == without.tolist()
    np.testing.assert_array_equal(condition(log).q, condition(_with(log)).q)


@pytest.mark.parametrize(
    "status",
    [
        {},
        {"runtime_state": (2, 1)},  # jogged: no program runs
        {"robot_status_bits": (3, 1)},
        {"robot_status_bits": (3, 9)},  # the power button
        {"robot_mode": (7, np.nan), "robot_status_bits": (3, np.nan)},
    ],
)
def test_an_arm_that_moves_itself_keeps_them(log: Log, status) -> None:
    log = _with(log, **status)
    assert measured(log) is log
    assert not any(s.undriven or np.isnan(s.current).any() for s in samples(log))


def test_what_is_no_mode_says_nothing(log: Log) -> None:
    """Two columns of that name, say."""
    wide = Log(log.t, {**log.channels, "robot_mode": np.zeros((len(log), 2))})
    assert measured(wide) is wide
