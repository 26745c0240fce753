"""An arm that a hand moves, of which its stream says nothing."""

import numpy as np
import pytest
from realarm import with_current, worn
from workshop import at_work, commissioned

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.simulate import observe, to_and_fro, typical_sensors
from urdyn.tracking import Tracker
from urdyn.tracking.step.hand_guiding import SURE, log_odds

RATE = 50.0  # [Hz]
D = np.array([2.0, -1.5, 1.0, 0.5])  # [A]
WEIGHT = np.array([3.0, -4.0, 0.0, 1.0])  # [A] the part that bears the arm
NOISE = 0.02 * np.ones(4)  # [A²]


def led(log, dynamics, begin, end):
    """The log of an arm whose drives bear its weight alone for a while."""
    still = np.zeros((len(log), 6))
    weight = dynamics.rigid.torque(log.joint("actual_q"), still, still) / dynamics.drive.gain
    noise = 0.03 * np.random.default_rng(1).standard_normal(weight.shape)
    since = log.t - log.t[0]
    by_hand = ((begin <= since) & (since < end))[:, None]
    return with_current(log, np.where(by_hand, weight + noise, log.joint("actual_current")))


def tracked(log, fit):
    """The last state, and the times [s] at which a hand began to move the arm and ceased to."""
    tracker = Tracker(fit, EKF(), 1.0 / RATE)
    state, turns = tracker.init(), []
    for sample in samples(log):
        before = state.hand.going
        state, _ = tracker.step(state, sample)
        turns += [sample.t - log.t[0]] * (state.hand.going != before)
    return tracker, state, turns


def test_currents_without_all_but_weight_are_of_a_hand():
    assert (log_odds(-D, D, WEIGHT, NOISE, may_be_dead=False) > 0.5).all()


@pytest.mark.parametrize("joint", [0, 5])
def test_a_dead_sensor_of_a_joint_that_bears_nothing_and_moves_alone_is_no_hand(joint):
    dynamics, fit = commissioned(0)
    motion = to_and_fro(dynamics.arm, joint, 4.0, RATE)
    log = observe(dynamics, motion, typical_sensors(dynamics.arm), np.random.default_rng(4))
    current = log.joint("actual_current").copy()
    current[log.t > log.t[0] + 1.5, joint] = 0.0
    _, state, turns = tracked(with_current(log, current), fit)
    assert not turns and state.hand.odds < SURE


@pytest.mark.parametrize("share", [0.0, 0.3, 0.45, -0.5, -1.0, 3.0])
def test_currents_that_lack_another_share_are_of_none(share):
    """Friction that fell or grew in all joints, or a push that did."""
    assert log_odds(-share * D, D, WEIGHT, NOISE, may_be_dead=False).sum() < 0.0


def test_a_sensor_at_fault_does_not_outvote_the_others():
    e = -np.append(np.repeat(D, 2), 100.0)
    predicted, weight = np.append(np.repeat(D, 2), 0.5), 3.0 * np.ones(9)
    odds = log_odds(e, predicted, weight, 0.02 * np.ones(9), may_be_dead=False)
    assert odds[-1] < 0.0 < odds.sum()


def test_nothing_is_learnt_from_an_arm_that_a_hand_moves():
    dynamics, fit = commissioned(0)
    log = at_work(dynamics, 0, 5, 5.0, rate=RATE)
    tracker, state, (begun, ended) = tracked(led(log, dynamics, 2.0, 4.0), fit)
    assert 2.0 < begun < 2.5 and 4.0 < ended < 4.5
    assert 1.5 * RATE < state.hand.samples < 2.5 * RATE
    belief, at = tracker.believed(state), tracker.currents.places
    off = belief.mean[at["f"]] - np.log(dynamics.drive.coulomb)
    assert (np.abs(off) < 4.0 * belief.sd[at["f"]] + 0.05).all()


def test_an_arm_whose_joints_all_lost_friction_moves_itself():
    dynamics, fit = commissioned(0)
    log = at_work(dynamics, 0, 5, 3.0, rate=RATE)
    for joint in range(6):
        log = worn(log, dynamics, joint, -0.4, log.t[0] + 1.0)
    _, state, turns = tracked(log, fit)
    assert not turns and state.hand.odds < SURE
