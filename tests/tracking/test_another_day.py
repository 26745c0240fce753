"""A run is on another day than commissioning: wear since then is found, not taken for noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from urdyn.diagnose import read_rules
from urdyn.estimate import EKF
from urdyn.identify import Fit, identify
from urdyn.io import read
from urdyn.model.arm import Arm
from urdyn.signal import condition, samples
from urdyn.tracking import Tracker
from urdyn.tracking.model import DAY

COLUMNS = "timestamp,actual_q*6,actual_qd*6,actual_current*6,target_current*6,target_moment*6"
MORE = 0.5  # [-] of friction, since commissioning


@pytest.fixture(scope="module")
def fit(ur10e: Arm, recordings: Path) -> Fit:
    path = recordings / "ur10e_dynamics" / "ur-20_02_10-30sec_12harm.csv"
    return identify(ur10e, condition(read(path, columns=COLUMNS, rows=(635, 3510))))


@pytest.mark.parametrize("joint", [1, 2])
def test_what_wore_since_commissioning_is_no_noise(fit: Fit, recordings: Path, joint: int) -> None:
    """Put into a real arm's run, from its first row on; friction as a whole, at its usual speed."""
    log = read(recordings / "ur10e_dynamics" / "ur-20_02_19_15harm50sec.csv", columns=COLUMNS)
    drive, v = fit.dynamics.drive, log.joint("actual_qd")[:, joint]
    speed = np.sqrt(np.mean(v**2))
    before = drive.coulomb[joint] + drive.viscous[joint] * speed
    lost = drive.coulomb[joint] * np.tanh(v / 0.01) + drive.viscous[joint] * v
    current = log.joint("actual_current").copy()
    current[:, joint] += MORE * lost / drive.gain[joint]
    tracker = Tracker(fit, EKF(), 0.0105)
    state, at = tracker.init(), tracker.currents.places
    for sample in samples(replace(log, channels={**log.channels, "actual_current": current})):
        state, _ = tracker.step(state, sample)
    f, alpha = (float(np.exp(state.belief.mean[at[g]][joint])) for g in ("f", "alpha"))
    assert MORE - 0.15 < (f + alpha * speed) / before - 1.0 < MORE + 0.1
    assert state.colour.slow[joint] < tracker.currents.noise[joint]


def test_a_day_is_no_more_than_the_diagnosis_believes_of_one() -> None:
    healthy = read_rules().healthy
    for group, sd in DAY.items():
        assert 0.0 < sd <= healthy[group]["day"]
