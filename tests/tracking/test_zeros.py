"""An encoder that slips while the arm works: seen where gravity tells, silent elsewhere."""

import numpy as np
import pytest
from workshop import at_work, commissioned

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.tracking import Tracker

OFFSET = 0.02  # [rad]


@pytest.mark.slow
@pytest.mark.parametrize("joint, seen", [(1, True), (5, False)])
def test_an_encoder_offset_is_tracked_by_gravity_alone(joint, seen):
    dynamics, fit = commissioned(0)
    fault = f"encoder_offset:joint={joint},offset={OFFSET},onset=5"
    tracker = Tracker(fit, EKF(), 0.01)
    state = tracker.init()
    for sample in samples(at_work(dynamics, 0, 5, 25.0, fault)):
        state, reading = tracker.step(state, sample)
    at = tracker.currents.places["k"]
    zero, sd = reading.belief.mean[at], reading.belief.sd[at]
    if seen:  # the true angle is less than the told one
        assert -1.3 * OFFSET < zero[joint] < -0.5 * OFFSET
        assert np.abs(np.delete(zero, [joint, joint + 1])).max() < 0.3 * OFFSET
    else:
        assert (np.abs(zero) < 3.0 * sd).all() and np.abs(zero[joint]) < 0.1 * OFFSET
