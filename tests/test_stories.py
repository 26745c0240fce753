"""Log in, model out: real arms, held-out runs, and the numbers that others reach on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from realarm import Recorded

from urdyn.identify import Fit, PayloadPrior, Run, Score, identify, validate
from urdyn.io import read
from urdyn.model.arm import Arm, load_arm
from urdyn.model.consistency import is_consistent
from urdyn.signal import condition

GAIN = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])  # [N·m/A], often copied for a UR10
PAYLOAD = 2.805  # [kg], weighed

# 100 |i - i_predicted| / |i| [%] on the held-out run, joint by joint.
LEAST_SQUARES = np.array([10.5, 4.9, 5.9, 10.8, 17.0, 13.6])  # weighted, with sign friction
CONTROLLER = np.array([11.4, 4.4, 5.4, 11.8, 15.0, 22.3])  # its own target_current

OTHER_RUNS = (
    "ur-20_02_19_15harm50sec",
    "ur-20_02_10-20sec_7harm",
    "ur-20_02_06-20sec_5harm",
    "ur-20_02_06-20sec_10harm",
)

# A real arm's noise is another on another day: warm-up, and friction that depends on what is not in
# the model. The nominal .90 is no law here; outside this band the intervals would be of no use.
SANE = (0.70, 0.97)


@pytest.fixture(scope="session")
def commissioned(ur10e: Arm, recorded: Recorded) -> Fit:
    """The arm as half a minute of excitation tells it, its gains known."""
    return identify(ur10e, condition(recorded("ur-20_02_10-30sec_12harm", 635, 3510)), gain=GAIN)


@pytest.fixture(scope="session")
def held_out(commissioned: Fit, recorded: Recorded) -> Score:
    return validate(commissioned, recorded("ur-20_02_12-40sec_12harm", 500, 4460))


@pytest.fixture(scope="session")
def weighed(ur10e: Arm, recorded: Recorded) -> Fit:
    """Drive gains from the first half of a run with a payload of known mass."""
    bare, loaded = (condition(recorded(f"ur-20_02_19_15harm50sec{x}")) for x in ("", "Load"))
    half = loaded.slice(0, len(loaded) // 2)
    return identify(ur10e, bare, loaded=[Run(half, PayloadPrior(PAYLOAD))])


def test_held_out_current_is_predicted_better_than_by_anyone(held_out: Score) -> None:
    assert (held_out.rre_percent < LEAST_SQUARES).all(), held_out.rre_percent
    assert (held_out.rre_percent < CONTROLLER).all(), held_out.rre_percent
    assert np.mean(held_out.rre_percent / LEAST_SQUARES) <= 0.70


def test_the_controller_is_scored_as_others_scored_it(held_out: Score) -> None:
    np.testing.assert_allclose(held_out.target_rre_percent, CONTROLLER, atol=0.05)


@pytest.mark.parametrize("run", OTHER_RUNS)
def test_every_other_run_is_predicted_better_than_by_the_controller(
    run: str, commissioned: Fit, recorded: Recorded
) -> None:
    score = validate(commissioned, recorded(run))
    assert (score.rre_percent < score.target_rre_percent).all(), score.rre_percent


def test_intervals_on_real_current_are_about_as_wide_as_they_say(held_out: Score) -> None:
    low, high = SANE
    assert ((held_out.coverage90 > low) & (held_out.coverage90 < high)).all(), held_out.coverage90


def test_a_real_arm_is_a_possible_one(commissioned: Fit) -> None:
    assert is_consistent(commissioned.dynamics.inertials).all()
    assert commissioned.informed("shoulder_link.mass") < 0.02  # it turns about the vertical only


@pytest.mark.slow  # it takes two fits of minutes of data
def test_a_known_payload_tells_the_gains_and_they_weigh_it_again(
    ur10e: Arm, weighed: Fit, recorded: Recorded
) -> None:
    bare, loaded = (condition(recorded(f"ur-20_02_19_15harm50sec{x}")) for x in ("", "Load"))
    half = loaded.slice(len(loaded) // 2)
    gain = weighed.dynamics.drive.gain
    fit = identify(ur10e, bare, loaded=[Run(half, PayloadPrior())], gain=gain)
    assert fit.value("payload_0.mass") == pytest.approx(PAYLOAD, rel=0.02)


@pytest.mark.slow
def test_a_slow_recording_with_every_rtde_column_identifies(recordings: Path) -> None:
    log = read(recordings / "ur3e_rtde" / "ur3e_payload_1070g.csv")
    fit = identify(load_arm("ur3e"), condition(log))
    score = validate(fit, log)
    assert is_consistent(fit.dynamics.inertials).all()
    assert (score.rre_percent < score.target_rre_percent).all(), score.rre_percent
    assert np.isnan(score.floor_percent).all()  # 25 Hz are too few to tell the sensor's noise
