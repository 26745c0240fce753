"""On recordings of a real arm: pushes by hand are collisions, healthy days raise nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from urdyn.diagnose import Diagnosis, diagnose
from urdyn.diagnose.diagnosis import Now
from urdyn.identify import Fit, identify
from urdyn.io import read
from urdyn.model.arm import Arm
from urdyn.signal import condition, samples
from urdyn.tracking import Tracker
from urdyn.tracking.blocks import Blocks
from urdyn.types import Log

COLUMNS = "timestamp,actual_q*6,actual_qd*6,actual_current*6,target_current*6,target_moment*6"
LIVE = ("ur-20_02_06-20sec_10harm", "ur-20_02_05-20sec_12harm")
HEALTHY = ("ur-20_02_12-40sec_12harm", "ur-20_01_22-joint_2", "ur-20_01_17-p1")


@pytest.fixture(scope="module")
def fit(ur10e: Arm, recordings: Path) -> Fit:
    path = recordings / "ur10e_dynamics" / "ur-20_02_10-30sec_12harm.csv"
    return identify(ur10e, condition(read(path, columns=COLUMNS, rows=(635, 3510))))


def report(fit: Fit, recordings: Path, name: str):
    return diagnose(fit, read(recordings / "ur10e_dynamics" / f"{name}.csv", columns=COLUMNS))


@pytest.mark.slow
def test_pushes_by_hand_are_collisions_and_nothing_else(fit: Fit, recordings: Path) -> None:
    found = report(fit, recordings, "ur-20_01_22-push_pose_1")
    assert {f.kind for f in found} == {"collision"}
    assert len(found) >= 3


@pytest.mark.slow
def test_a_loaded_run_is_a_payload_with_its_mass(fit: Fit, recordings: Path) -> None:
    (found,) = report(fit, recordings, "ur-20_02_19_15harm50secLoad")
    assert found.kind == "payload_change"
    # Without a known payload the gains keep most of their prior of 10 %, and masses inherit it.
    assert abs(found.size / 2.805 - 1.0) < 0.2
    strongest = fit.dynamics.arm.joint_names[fit.dynamics.drive.strongest]
    gain_sd = fit.belief.sd[fit.names.index(f"{strongest}.gain")]
    assert found.size_sd >= gain_sd * found.size > 0.02 * found.size
    assert abs(found.size - 2.805) < 2.6 * found.size_sd  # once in a hundred


@pytest.mark.slow
@pytest.mark.parametrize("name", HEALTHY)
def test_healthy_days_raise_nothing(fit: Fit, recordings: Path, name: str) -> None:
    assert len(report(fit, recordings, name)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", LIVE)
def test_healthy_days_raise_nothing_sample_by_sample(fit: Fit, recordings: Path, name: str) -> None:
    """A live twin knows no future: its accelerations are noisier, above all where an arm brakes."""
    log = read(recordings / "ur10e_dynamics" / f"{name}.csv", columns=COLUMNS)
    tracker, diagnosis = Tracker(fit, Blocks(8), 0.01), Diagnosis(fit, 0.01)
    state, belief = diagnosis.init(), tracker.init()
    for sample in samples(log):
        belief, reading = tracker.step(belief, sample)
        if reading is not None:
            now = Now(reading.instant, reading.inputs.s, reading.travelled)
            state, _ = diagnosis.step(state, now)
    state, _ = diagnosis.finish(state)
    assert not state.findings


def worn(log: Log, fit: Fit, joint: int, much: float, since: float) -> Log:
    """The recording with so much more of a joint's friction in its current."""
    drive, v = fit.dynamics.drive, log.joint("actual_qd")[:, joint]
    lost = drive.coulomb[joint] * np.tanh(v / 0.01) + drive.viscous[joint] * v
    current = log.joint("actual_current").copy()
    current[:, joint] += (log.t >= since) * much * lost / drive.gain[joint]
    return replace(log, channels={**log.channels, "actual_current": current})


@pytest.mark.slow
@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("begins", ["before", "within"])
def test_friction_that_was_put_into_a_recording_is_found(
    fit: Fit, recordings: Path, joint: int, begins: str
) -> None:
    """By a half, from the first row on: it wore since commissioning. Or while it is recorded."""
    path = recordings / "ur10e_dynamics" / "ur-20_02_19_15harm50sec.csv"
    log = read(path, columns=COLUMNS)
    since = log.t[0] if begins == "before" else log.t[0] + 20.0
    found = diagnose(fit, worn(log, fit, joint, 0.5, since)).findings
    assert [(f.kind, f.joint) for f in found] == [("friction_increase", joint)]
    assert found[0].older == ("before this run" in found[0].text) == (begins == "before")
    assert abs(found[0].size - 0.5) < 0.2
