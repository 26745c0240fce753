"""A run is on another day than commissioning: wear since then is found, not taken for noise."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from realarm import Recorded, with_current, worn

from urdyn.diagnose import read_rules
from urdyn.estimate import EKF
from urdyn.identify import Fit, identify
from urdyn.model.arm import Arm
from urdyn.signal import condition, samples
from urdyn.signal.stretches import median_step
from urdyn.tracking import Tracker, TrackerState
from urdyn.tracking.belief.model import DAY
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Log

MORE = 0.5  # [-] of friction, since commissioning
LOST = 0.2  # [-] of a drive's health
GROWS, BEGINS = 0.01, 12.0  # [1/s] of friction, from that time on [s]
# [-] What its friction differs by as it is, from that of the day that it was commissioned on, and
# an interval of it.
DIFFER = 0.08
MASS = 2.805  # [kg] bolted to the arm's flange for a run


@pytest.fixture(scope="module")
def run(recorded: Recorded) -> Log:
    """Another day's, of the same arm."""
    return recorded("ur-20_02_19_15harm50sec")


def tracked(fit: Fit, run: Log) -> tuple[Tracker[Any], TrackerState[Any]]:
    """A run to its end."""
    tracker = Tracker(fit, EKF(), median_step(run.t))
    state = tracker.init()
    for sample in samples(run):
        state, _ = tracker.step(state, sample)
    return tracker, state


def test_what_shakes_an_arm_is_no_health_that_is_lost(real: Fit, recorded: Recorded) -> None:
    """Where only its shoulder pan moves, nothing else tells an elastic gear from a weak drive."""
    tracker, state = tracked(real, recorded("ur-20_01_22-joint_1", 0, 3000))
    health = tracker.currents.places["z"].start
    mean, sd = state.belief.mean[health], state.belief.sd[health]
    assert abs(mean) < 3.0 * sd < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 2])
def test_what_wore_since_commissioning_is_no_noise(real: Fit, run: Log, joint: int) -> None:
    """Put into a real arm's run, from its first row on; friction as a whole, at its usual speed."""
    drive, speed = real.dynamics.drive, np.sqrt(np.mean(run.joint("actual_qd")[:, joint] ** 2))
    before = drive.coulomb[joint] + drive.viscous[joint] * speed
    tracker, state = tracked(real, worn(run, real.dynamics, joint, MORE))
    at = tracker.currents.places
    f, alpha = (float(np.exp(state.belief.mean[at[g]][joint])) for g in ("f", "alpha"))
    assert abs((f + alpha * speed) / before - 1.0 - MORE) < DIFFER
    assert state.colour.slow[joint] < tracker.currents.noise[joint]


@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 2])
def test_a_drive_that_lost_health_since_commissioning_is_known_at_its_own(
    real: Fit, run: Log, joint: int
) -> None:
    """Where a load shows health; before, a fifth was tracked as half of that, +- 1 %."""
    current = run.joint("actual_current").copy()
    current[:, joint] /= 1.0 - LOST
    tracker, state = tracked(real, with_current(run, current))
    z = np.exp(state.belief.mean[tracker.currents.places["z"]])
    assert abs(z[joint] - (1.0 - LOST)) < 0.2 * LOST
    others = np.delete(z, [0, joint])  # a base bears nothing that would tell its health
    assert (np.abs(others - 1.0) < 0.2 * LOST).all()


@pytest.mark.slow
@pytest.mark.parametrize("joint", [0, 2])
def test_what_wears_on_within_a_minute_is_no_noise(real: Fit, run: Log, joint: int) -> None:
    """Put into a real arm's run, 1 % of its friction in a second: before, tracked as a third.

    It is friction over health that a base's current tells, which bears nothing.
    """
    growing = GROWS * np.maximum(run.t - run.t[0] - BEGINS, 0.0)
    tracker, state = tracked(real, worn(run, real.dynamics, joint, growing))
    at, drive = tracker.currents.places, real.dynamics.drive
    more, grown = state.belief.mean[at["f"]] - np.log(drive.coulomb), np.log1p(growing[-1])
    more -= state.belief.mean[at["z"]]
    unsure = 2.0 * state.belief.sd[at["f"]][joint]  # viscous friction may have grown, too
    assert more[joint] == pytest.approx(grown, abs=max(0.1, unsure))
    assert more[joint] > 0.5 * grown
    others = np.delete(more, joint)
    assert (np.abs(others) < DIFFER).all()


@pytest.mark.slow
def test_a_bulky_piece_is_told_of_once_and_weighed(
    ur10e: Arm, run: Log, recorded: Recorded
) -> None:
    """A story: the same motion, bare and with 2.805 kg bolted on between.

    The arm stood, so something light might be carried. That it was not light was told after three
    seconds, but its inertia went on being that of something light, until it was told for another.
    """
    fit = identify(ur10e, condition(recorded("ur-20_02_12-40sec_12harm", 500, 4460)))
    tracker, state = tracked(fit, run)
    at = tracker.currents.places
    friction, loaded = state.belief.mean[at["f"]], recorded("ur-20_02_19_15harm50secLoad")
    moves = np.abs(loaded.joint("actual_qd")).max(axis=1) > STANDING
    later, begins = run.t[-1] + 1.0 - loaded.t[0], loaded.t[np.argmax(moves)]
    told, weighed = [], []
    for sample in samples(replace(loaded, t=loaded.t + later)):
        state, reading = tracker.step(state, sample)
        since = sample.t - later - begins
        if reading is not None and reading.widened:
            told.append(since)
        if since > 5.0:
            weighed.append(state.belief.mean[at["payload"]][0] / MASS - 1.0)
    assert len(told) == 1 and 0.0 < told[0] < 5.0
    unsure = 0.08 / MASS  # gains that no payload told leave an sd of .08 kg; 2.6 of them, 99 %
    assert abs(weighed[0]) < 0.03 and np.abs(weighed).max() < 2.6 * unsure
    assert np.abs(state.belief.mean[at["f"]] - friction).max() < 0.06


@pytest.mark.parametrize("rows", [2000, pytest.param(None, marks=pytest.mark.slow)])
def test_a_healthy_arm_wears_nothing_from_day_to_day(real: Fit, run: Log, rows: int | None) -> None:
    _, state = tracked(real, run.slice(0, rows))
    assert state.changed_at == -np.inf


def test_a_day_is_no_more_than_the_diagnosis_believes_of_one() -> None:
    healthy = read_rules().healthy
    for group, sd in DAY.items():
        assert 0.0 < sd <= healthy[group]["day"]
