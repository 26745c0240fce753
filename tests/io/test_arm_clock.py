"""Stamps that scatter are put where the arm's motion says; all others are left alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from urdyn.io import read, write
from urdyn.io.arm_clock import SCATTER, scattered
from urdyn.types import Array, Log, Source

J, ENCODER, SPEED = 6, 5e-5, 2e-3  # joints, noise of angles [rad] and of velocities [rad/s]
LATE = 2e-3  # [s] by which stamps scatter


def arm(t: Array, seed: int = 0) -> tuple[Array, Array]:
    """Angles and velocities (N, J) of an arm that moves as on an excitation, measured at t."""
    rng = np.random.default_rng(seed)
    w, size = rng.uniform(0.5, 4.0, (J, 4)), rng.uniform(0.05, 0.3, (J, 4))
    phase = w * t[:, None, None] + rng.uniform(0.0, 6.0, (J, 4))
    q, v = (size * np.sin(phase)).sum(axis=2), (size * w * np.cos(phase)).sum(axis=2)
    noise = rng.standard_normal((2, *q.shape))
    return q + ENCODER * noise[0], v + SPEED * noise[1]


def even(period: float, rows: int = 1500) -> Array:
    return period * np.arange(rows)


def late(t: Array, by: float = LATE) -> Array:
    return t + by * np.random.default_rng(7).uniform(-1.0, 1.0, len(t)) * np.sqrt(3.0)


def of_steps(put: Array, t: Array) -> float:
    """Error of the time from row to row, sd [s]."""
    return float(np.std(np.diff(put) - np.diff(t)))


@pytest.mark.parametrize("period", [0.02, 0.04, 0.05])
def test_stamps_that_scatter_are_put_where_the_arm_says(period: float) -> None:
    """To what a velocity's noise and the bend of a motion leave: a tenth of a millisecond each."""
    t = even(period)
    stamps = late(t)
    put = scattered(stamps, *arm(t))
    assert put is not None
    assert of_steps(put, t) < 3e-4 < 0.2 * of_steps(stamps, t)
    assert abs(np.mean(put - t)) < 4.0 * LATE / np.sqrt(len(t))  # nothing runs away


def test_rows_that_came_unevenly_keep_stamps_that_say_so() -> None:
    t = late(even(0.02))
    assert np.std(np.diff(t)) > LATE
    assert scattered(t, *arm(t)) is None


def test_both_at_once_are_told_apart() -> None:
    t = late(even(0.05), 4e-3)
    stamps = t + LATE * np.random.default_rng(8).standard_normal(len(t))
    put = scattered(stamps, *arm(t))
    assert put is not None and of_steps(put, t) < 3e-4


def test_velocities_that_lag_are_no_scatter() -> None:
    """A filter of 10 ms makes of 1 rad/s² and 1 rad/s a hundredth of every step, for a while."""
    fine = even(0.001, 60000)
    q, v = arm(fine)
    keep = np.exp(-0.001 / 0.01)
    rows = np.cumsum(np.random.default_rng(9).choice([46, 50, 54], 1000))
    lagging = lfilter([1.0 - keep], [1.0, -keep], v, axis=0)
    assert scattered(fine[rows], q[rows], lagging[rows]) is None


@pytest.mark.parametrize("wrong", ["stuck", "jumps", "silent"])
def test_one_joints_encoder_misleads_nobody(wrong: str) -> None:
    t = even(0.05)
    stamps, (q, v) = late(t), arm(t)
    q[600:, 2] = {"stuck": q[600, 2], "jumps": q[600:, 2] + 0.1, "silent": np.nan}[wrong]
    put = scattered(stamps, q, v)
    assert put is not None and of_steps(put, t) < 4e-4


def test_an_arm_that_stands_tells_no_time() -> None:
    t = even(0.05)
    q, v = (0.001 * x for x in arm(t))
    assert scattered(late(t), q, v) is None


def test_a_tenth_of_what_can_be_told_is_left_alone() -> None:
    t = even(0.05)
    assert scattered(late(t, 0.1 * SCATTER), *arm(t)) is None


def test_who_reads_a_log_is_told(tmp_path: Path) -> None:
    t = even(0.05)
    q, v = arm(t)
    channels = {"actual_q": q, "actual_qd": v, "actual_current": np.ones_like(q)}
    write(Log(late(t), channels, Source("here")), tmp_path / "log.parquet")
    log = read(tmp_path / "log.parquet")
    assert of_steps(log.t, t) < 3e-4 and (np.diff(log.t) > 0.0).all()
    assert [(d.kind, d.remedy) for d in log.defects] == [
        ("stamp that scatters", "put where the arm's motion says")
    ]
