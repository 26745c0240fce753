"""An encoder that slips while the arm works: seen where gravity tells, silent elsewhere.

A zero that jumps between two samples is known at once, by angles against velocities. One that slips
more slowly is told by currents alone, from what else bends them over tens of seconds. Drift's own
spread of zeros is that of arms whose encoders nobody doubts, and lags behind so large a step; told
to expect one, its intervals hold the truth.
"""

from dataclasses import replace

import numpy as np
import pytest
from workshop import at_work, commissioned

from urdyn.estimate import EKF, UKF
from urdyn.signal import samples
from urdyn.tracking import QUICKER, Drift, Tracker

EXPECTED = Drift(zero=0.03)
OFFSET = 0.02  # [rad]
SLIP = (0.04, 8.0), (-0.04, 8.5)  # [rad/s] since [s]: OFFSET in half a second


@pytest.mark.slow
@pytest.mark.parametrize("joint, seen", [(1, True), (2, True), (5, False)])
def test_an_encoder_offset_is_tracked_by_gravity_alone(joint, seen):
    dynamics, fit = commissioned(0)
    slips = [f"encoder_offset:joint={joint},rate={r},onset={at}" for r, at in SLIP]
    tracker = Tracker(fit, EKF(), 0.01, EXPECTED)
    state = tracker.init()
    for sample in samples(at_work(dynamics, 0, 5, 25.0, *slips)):
        state, reading = tracker.step(state, sample)
    at = tracker.currents.places["k"]
    zero, sd = reading.belief.mean[at], reading.belief.sd[at]
    if seen:  # the true angle is less than the told one
        truth = np.where(np.arange(6) == joint, -OFFSET, 0.0)
        assert (np.abs(zero - truth) < 2.0 * sd).all() and sd[joint] < 0.3 * OFFSET
    else:
        assert (np.abs(zero) < 3.0 * sd).all() and np.abs(zero[joint]) < 0.1 * OFFSET


QUICK = QUICKER["realtime"]
OTHERS = [(UKF(), 0), (UKF(), 5), (QUICK, 0), (QUICK, 2), *((EKF(), joint) for joint in (0, 2, 5))]


@pytest.mark.parametrize(
    ("how", "joint"),
    [(UKF(), 2), (QUICK, 5), *(pytest.param(*of, marks=pytest.mark.slow) for of in OTHERS)],
)
def test_a_zero_that_jumps_is_followed_at_once_and_moves_nothing_else(how, joint):
    dynamics, fit = commissioned(0)
    fault = f"encoder_offset:joint={joint},offset={OFFSET},onset=8"
    tracker, beliefs = Tracker(fit, how, 0.01), []
    for log in (at_work(dynamics, 0, 5, 8.3), at_work(dynamics, 0, 5, 8.3, fault)):
        state = tracker.init()
        for sample in samples(log):
            state, reading = tracker.step(state, sample)
        beliefs.append(reading.belief)
    sound, jumped = beliefs
    apart = jumped.mean - sound.mean
    apart[tracker.currents.places["k"]][joint] += OFFSET
    # What waits in a quicker mode is moved some samples sooner or later for it; the skew is told by
    # the instrument alone, which looks a quarter of a second back, and not over a jump.
    least = np.full(len(apart), 0.1 if how is QUICK else 0.05)
    least[tracker.currents.places["skew"]] = 0.2
    assert (np.abs(apart) < least * sound.sd).all()
    assert np.allclose(jumped.sd, sound.sd, rtol=0.02)


def test_a_zero_that_jumps_while_another_angle_is_missing_is_followed():
    """There is no reading then, and the jump is told once only."""
    dynamics, fit = commissioned(0)
    log = at_work(dynamics, 0, 5, 10.0, f"encoder_offset:joint=2,offset={OFFSET},onset=8")
    missing = (np.abs(log.t - 8.0) < 0.5)[:, None] & (np.arange(6) == 4)
    channels = {
        name: np.where(missing, np.nan, log.channels[name]) for name in ("actual_q", "actual_qd")
    }
    tracker = Tracker(fit, EKF(), 0.01)
    state = tracker.init()
    for sample in samples(replace(log, channels={**log.channels, **channels})):
        state, reading = tracker.step(state, sample)
    at = tracker.currents.places["k"]
    zero, sd = reading.belief.mean[at], reading.belief.sd[at]
    assert (np.abs(zero + OFFSET * (np.arange(6) == 2)) < 3.0 * sd).all()
    assert (sd < OFFSET / 6.0).all()  # so that none at all would be seen
