"""One joint to and fro."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.simulate import to_and_fro
from urdyn.simulate.limits import rated


@pytest.mark.parametrize("joint", range(6))
def test_one_joint_swings_within_what_the_maker_allows(joint: int) -> None:
    arm = load_arm("ur10e")
    motion = to_and_fro(arm, joint, 4.0, 200.0)
    others = np.arange(6) != joint
    assert np.ptp(motion.q[:, others], axis=0).max() == 0.0
    assert rated(arm).hold(arm, motion.q, motion.v, motion.a)
    assert np.allclose(motion.v[0], 0.0) and np.allclose(motion.a[0], 0.0)
    # twice a period of two thirds of a second, and at most twice more
    load = arm.torque(motion.q, motion.v, motion.a)[:, joint]
    assert 10 <= np.sum(load[1:] * load[:-1] < 0.0) <= 24
