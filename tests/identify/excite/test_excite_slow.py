"""Probes and poses: what they are for, they do."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.identify.excite import Ask, excite
from urdyn.model.arm import load_arm

PROBE = Ask(kind="probe", duration=20.0, rate=125.0)


@pytest.mark.parametrize(("robot", "joint"), [("ur10e", 2), ("ur3", 5), ("ur30", 0)])
def test_a_probe_goes_from_creeping_to_fast_and_from_long_to_short(robot, joint):
    found = excite(load_arm(robot), replace(PROBE, joint=joint))
    moves = found.path.moves
    way = np.array([abs(m.goal - m.start)[joint] for m in moves])
    pace = way / np.array([m.duration for m in moves])
    assert pace.max() > 20.0 * pace[0]
    assert way.min() < 2e-3 < 0.1 < way.max()
    assert all(np.count_nonzero(m.goal - m.start) == 1 for m in moves)
    assert moves[-1].end <= 20.0


def test_a_probe_of_the_elbow_turns_its_gravity_round(ur10e):
    found = excite(ur10e, replace(PROBE, joint=2))
    still = 0.0 * found.trajectory.q
    gravity = ur10e.torque(found.trajectory.q, still, still)[:, 2]
    assert gravity.min() < 0.0 < gravity.max()


def test_a_probe_tells_of_its_joint_alone(ur10e):
    told = excite(ur10e, replace(PROBE, joint=2)).expected
    gained = dict(zip(told.parameters.names, told.gained(), strict=True))
    assert gained["elbow_joint.coulomb"] > 0.9
    assert gained["elbow_joint.presliding_distance"] > 0.9
    assert gained["wrist_1_joint.coulomb"] < 0.01


def test_poses_are_reached_slowly_and_tell_of_gravity(ur10e):
    ask = Ask(kind="poses", duration=30.0, rate=50.0)
    found = excite(ur10e, ask)
    moves = found.path.moves
    assert len(moves) >= 3
    assert np.abs(found.trajectory.v / found.ask.limits.velocity).max() <= 0.3 + 1e-9
    for one, other in pairwise(moves):
        np.testing.assert_array_equal(one.goal, other.start)
        assert other.begin - one.end == pytest.approx(1.0)
    gained = dict(zip(found.expected.parameters.names, found.expected.gained(), strict=True))
    assert gained["forearm_link.com_x"] > gained["forearm_link.Izz"]


def test_what_there_is_no_time_for_is_refused(ur10e):
    for kind in ("probe", "poses"):
        with pytest.raises(InputError, match="ask for"):
            excite(ur10e, Ask(kind=kind, duration=3.0, rate=50.0))


@pytest.mark.parametrize("joint", [-1, 6, 1.5])
def test_a_joint_that_no_arm_has_is_not_probed(ur10e, joint):
    with pytest.raises(InputError, match=r"joint .* from 0 to 5"):
        excite(ur10e, replace(PROBE, joint=joint))
