"""A single angle or velocity that no arm can have had is not measured; nothing else is taken so."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.signal import condition, measured
from urdyn.simulate import simulate
from urdyn.types import Log

RATES = (20.0, 50.0, 125.0, 500.0)


def _with(log: Log, name: str, values: np.ndarray) -> Log:
    return Log(log.t, {**log.channels, name: values})


@pytest.fixture(scope="module", params=RATES)
def log(request) -> Log:
    return simulate(load_arm("ur5e"), 12.0, request.param, 3)[0]


def test_what_an_arm_does_is_left_as_it_is(log: Log) -> None:
    assert measured(log) is log


@pytest.mark.parametrize(
    "name, size",
    [("actual_q", 0.03), ("actual_q", 2.0 * np.pi), ("actual_qd", 29.0)],
)
def test_a_glitch_of_one_row_is_not_measured_and_counted(log: Log, name: str, size: float) -> None:
    rng, truth, sound = np.random.default_rng(2), log.channels[name], condition(log)
    for _ in range(20):
        k, j = rng.integers(4, len(log) - 4), rng.integers(6)
        values = truth.copy()
        values[k, j] += size
        found = measured(_with(log, name, values))
        wrong = np.isnan(found.channels[name])
        assert np.argwhere(wrong).tolist() == [[k, j]]
        (defect,) = found.defects
        assert defect.count == 1 and "out of reach" in defect.kind
        moved = condition(found)
        near = np.nanmax(np.abs(moved.a - sound.a)[:, j])
        assert near < 0.1 * np.abs(sound.a).max()  # a window with one row less


def test_a_row_of_another_time_is_not_measured(log: Log) -> None:
    angles = log.joint("actual_q").copy()
    angles[len(log) // 2] = 0.0
    wrong = np.isnan(measured(_with(log, "actual_q", angles)).joint("actual_q"))
    far = np.abs(log.joint("actual_q")[len(log) // 2]) > 0.03
    assert wrong[len(log) // 2, far].all() and wrong.sum() == wrong[len(log) // 2].sum()


def test_a_zero_that_jumps_is_no_glitch(log: Log) -> None:
    angles = log.joint("actual_q").copy()
    angles[len(log) // 2 :, 2] += 0.05
    jumped = _with(log, "actual_q", angles)
    assert measured(jumped) is jumped
