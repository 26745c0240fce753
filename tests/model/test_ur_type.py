"""A UR arm is that, whatever its URDF calls it and its parts, and nothing else is."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from urdyn.cli.serving import cycle
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.io.calibration_file import read_calibration
from urdyn.model.arm import Arm, controller_base, described, load_arm, read_arm
from urdyn.model.geometry.drawing import angles
from urdyn.model.geometry.origins import with_origins
from urdyn.model.library import RERATED, names
from urdyn.model.population import population
from urdyn.model.ur_type import ALIKE, _known, ur_type
from urdyn.simulate.limits import comfortable
from urdyn.simulate.wrench import has_force_sensor

RULES = read_rules()
# On a wall, turned about z as well: nothing of the arm is where the library has it.
MOUNT = """<link name="world"/><joint name="mount" type="fixed">
  <parent link="world"/><child link="left/base_link"/>
  <origin xyz="1 2 3" rpy="1.5707963267948966 0 0.7"/></joint></robot>"""


def renamed(arm: Arm, name: str = "cell") -> Arm:
    """The arm in somebody's cell: all its names with a prefix, but the robot's own, and a mount."""
    inside = re.sub(r'((?<!robot )name|link)="', r'\1="left/', arm.urdf)
    return read_arm(inside.replace("</robot>", MOUNT).replace(f'"{arm.name}"', f'"{name}"'))


@pytest.mark.parametrize("robot", names())
def test_a_ur_arm_is_that_by_any_name_with_any_prefix_and_mounting(robot: str) -> None:
    arm = load_arm(robot)
    other = renamed(arm)
    assert (other.name, other.prefix, other.tool) == ("cell", "left/", "left/tool0")
    assert ur_type(other) == ur_type(arm) == robot
    mounted = other.pose(np.zeros(6), "left/base_link")
    np.testing.assert_allclose(
        controller_base(other), mounted @ controller_base(arm), rtol=0.0, atol=1e-12
    )
    np.testing.assert_array_equal(comfortable(other).middle, comfortable(arm).middle)
    gain, its = (population(one).drive["gain"] for one in (arm, other))
    np.testing.assert_array_equal([gain.mean, gain.sd], [its.mean, its.sd])
    assert has_force_sensor(other) == has_force_sensor(arm) and cycle(other) == cycle(arm)
    critical, allowed = (
        [kind.critical for kind in RULES.slow_of(population(one).typical())] for one in (arm, other)
    )
    assert critical == allowed and np.isfinite(critical).all()


def test_a_type_that_is_not_in_the_library_keeps_its_name() -> None:
    assert ur_type(renamed(load_arm("ur5e"), "UR15")) == "ur15"


@pytest.mark.parametrize(("robot", "before"), RERATED.items())
def test_an_arm_that_is_sold_under_another_name_is_the_same_arm(robot: str, before: str) -> None:
    arm, older = load_arm(robot.upper()), load_arm(before)
    assert arm.name == ur_type(arm) == robot and read_arm(arm.urdf).name == robot
    np.testing.assert_array_equal(arm.inertials, older.inertials)
    np.testing.assert_array_equal(
        population(arm).drive["gain"].sd, population(older).drive["gain"].sd
    )
    assert has_force_sensor(arm) and cycle(arm) == cycle(older)
    assert RULES.rated[robot] >= RULES.rated[before] and described(arm) and not described(older)


def test_an_arm_that_is_two_centimetres_longer_is_of_no_type() -> None:
    arm = load_arm("ur5e")
    longer = read_arm(renamed(arm).urdf.replace("-0.425 0 0", "-0.445 0 0"))
    assert longer.urdf != renamed(arm).urdf and ur_type(longer) == ""


def test_no_two_types_are_alike() -> None:
    assert all(np.abs(_known(a) - _known(b)).max() > 2 * ALIKE for a, b in combinations(names(), 2))


def test_a_calibrated_arm_is_still_of_its_type(recordings: Path) -> None:
    for file in (recordings / "ur_calibration_yaml").glob("*.yaml"):
        robot = file.stem.partition("_")[0]
        origins = [(pose[:3, 3], angles(pose)) for pose in read_calibration(file)]
        assert ur_type(with_origins(renamed(load_arm(robot)), origins)) == robot
