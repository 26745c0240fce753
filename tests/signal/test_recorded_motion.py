"""Stories on recordings of a real UR10e; they are read from the folder $URDYN_RECORDINGS."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from urdyn.signal import PAPER, Causal, CausalState, Instant, condition, samples
from urdyn.types import Log

CHANNELS = ("actual_q", "actual_qd", "actual_current", "target_current", "target_moment")


def recording(name: str) -> Log:
    folder = os.environ.get("URDYN_RECORDINGS")
    if not folder:
        pytest.skip("set URDYN_RECORDINGS to the folder of recordings")
    table = np.loadtxt(Path(folder) / "ur10e_dynamics" / name, delimiter=",")
    channels = {channel: table[:, 1 + 6 * k : 7 + 6 * k] for k, channel in enumerate(CHANNELS)}
    return Log(table[:, 0], channels)


@pytest.fixture(scope="module")
def excitation() -> Log:
    """Fourier excitation, about 100 Hz with steps of 8 to 13 ms."""
    return recording("ur-20_02_10-30sec_12harm.csv").slice(635, 3510)


def test_kinematics_agree_with_each_other_and_with_the_recorder(excitation: Log) -> None:
    motion = condition(excitation)
    assert motion.breaks == ()
    assert np.isfinite(motion.a).all()
    # the recorder's own noise: a few counts of the encoder, a few mrad/s
    assert (motion.q - excitation.channels["actual_q"]).std(0).max() < 1e-4
    assert (motion.v - excitation.channels["actual_qd"]).std(0).max() < 4e-3
    # the trapezoid is off by dt² / 12 of the jerk at a time, and its sum by that of the range
    step = motion.step[1:, None]
    gained = (step * (motion.a[1:] + motion.a[:-1]) / 2).sum(0)
    bound = step.max() ** 2 / 12 * np.abs(motion.jerk).mean(0) * np.ptp(motion.t)
    assert (np.abs(gained - (motion.v[-1] - motion.v[0])) < bound + 4e-3).all()


def live(log: Log) -> tuple[CausalState, list[Instant]]:
    twin = Causal(float(np.median(np.diff(log.t))))
    state, out = twin.init(), []
    for sample in samples(log):
        state, instant = twin.step(state, sample)
        out += [instant] if instant else []
    return state, out


def test_the_live_twin_refuses_nothing_that_the_robot_did(excitation: Log) -> None:
    log = excitation.slice(0, 1000)
    state, out = live(log)
    assert (state.refused, state.restarts, state.repeats) == (0, 0, 0)
    batch = condition(log).a[4:-4]
    np.testing.assert_allclose(np.stack([i.a for i in out]), batch, rtol=1e-9, atol=1e-9)


def test_three_sigma_calls_motion_an_outlier_where_one_joint_moves_and_then_another() -> None:
    log = recording("ur-20_01_22-joint_1.csv")
    run = PAPER.run(log)
    assert np.allclose(np.diff(run.result.t), 0.01)
    marked = {defect.kind: defect.count for defect in run.result.defects}
    assert marked["outlier beyond 3 sigma"] > 100  # and none of the angles is one:
    assert live(log)[0].refused == 0
    assert np.isfinite(condition(log).a).all()
