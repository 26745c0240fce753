"""An encoder that slips while the arm works: seen where gravity tells, silent elsewhere.

By currents alone a slip is told from what else bends them over tens of seconds. Drift's own spread
of zeros is that of arms whose encoders nobody doubts, and lags behind so large a step; told to
expect one, its intervals hold the truth.
"""

import numpy as np
import pytest
from workshop import at_work, commissioned

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.tracking import Drift, Tracker

EXPECTED = Drift(zero=0.03)
OFFSET = 0.02  # [rad]


@pytest.mark.slow
@pytest.mark.parametrize("joint, seen", [(1, True), (2, True), (5, False)])
def test_an_encoder_offset_is_tracked_by_gravity_alone(joint, seen):
    dynamics, fit = commissioned(0)
    fault = f"encoder_offset:joint={joint},offset={OFFSET},onset=8"
    tracker = Tracker(fit, EKF(), 0.01, EXPECTED)
    state = tracker.init()
    for sample in samples(at_work(dynamics, 0, 5, 25.0, fault)):
        state, reading = tracker.step(state, sample)
    at = tracker.currents.places["k"]
    zero, sd = reading.belief.mean[at], reading.belief.sd[at]
    if seen:  # the true angle is less than the told one
        truth = np.where(np.arange(6) == joint, -OFFSET, 0.0)
        assert (np.abs(zero - truth) < 2.0 * sd).all() and sd[joint] < 0.3 * OFFSET
    else:
        assert (np.abs(zero) < 3.0 * sd).all() and np.abs(zero[joint]) < 0.1 * OFFSET
