"""Our URDFs in the eyes of other libraries, others' URDFs in ours, and files that we write."""

from __future__ import annotations

import io
import runpy
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from urdyn.errors import ArmError
from urdyn.model.arm import Arm, load_arm, read_arm
from urdyn.model.consistency import inertials, log_cholesky
from urdyn.model.describe import describe
from urdyn.model.library import folder, names
from urdyn.types import Array

DATA = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots"
GRAVITY = 9.81  # [m/s²]

# A tool bolted to the flange, with mass and shape: what a user adds to an arm's file.
TOOL = """<link name="gripper">
  <inertial><origin xyz="0 0.01 0.05" rpy="0.1 0.2 0.3"/><mass value="0.9"/>
  <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.0015"/></inertial>
  <collision><geometry><box size="0.05 0.1 0.1"/></geometry></collision></link>
  <joint name="bolts" type="fixed"><parent link="tool0"/><child link="gripper"/>
  <origin xyz="0 0 0.02" rpy="0 0 0.5"/></joint></robot>"""


@pytest.fixture(params=names(), scope="module")
def arm(request: pytest.FixtureRequest) -> Arm:
    return load_arm(request.param)


@pytest.fixture(scope="module")
def tooled() -> Arm:
    return read_arm(load_arm("ur5e").urdf.replace("</robot>", TOOL))


def motion(*shape: int) -> Array:
    """Random q, v, a, stacked (3, ..., 6)."""
    return np.random.default_rng(21).uniform(-2.0, 2.0, size=(3, *shape, 6))


def other_bodies(arm: Arm) -> Array:
    """Inertials near the arm's that solid bodies can have, (6, 10)."""
    x = log_cholesky(arm.inertials)
    return inertials(x + np.random.default_rng(5).normal(scale=0.1, size=x.shape))


def yourdf(urdf: str) -> Any:
    return yourdfpy.URDF.load(io.BytesIO(urdf.encode()), load_meshes=False)


def weights(robot: Any, q: Array) -> list[tuple[str, float, Array]]:
    """Every link's name, mass and place of its centre of mass in the root, by yourdfpy."""
    robot.update_cfg(q)
    return [
        (name, link.inertial.mass, (robot.get_transform(name) @ link.inertial.origin)[:3, 3])
        for name, link in robot.link_map.items()
        if link.inertial is not None
    ]


def gravity_by_yourdfpy(robot: Any, arm: Arm, q: Array) -> Array:
    """Gravity torque (6,) [N m] as levers times weights, the links beyond each joint."""
    found = weights(robot, q)
    order = [name for name, _, _ in found]
    tau = np.zeros(arm.joints)
    for j, link in enumerate(arm.link_names):
        T = robot.get_transform(link)
        for _, mass, place in found[order.index(link) :]:
            tau[j] += mass * GRAVITY * np.cross(T[:3, 2], place - T[:3, 3])[2]
    return tau


def torque_by_mujoco(urdf: str, q: Array, v: Array, a: Array) -> tuple[float, Array]:
    """Moving mass [kg] and inverse dynamics (N, 6) [N m] by MuJoCo, contacts and limits off."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(urdf)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, tau = mujoco.MjData(model), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, v, a, strict=True):
        mujoco.mj_inverse(model, data)
        tau.append(data.qfrc_inverse.copy())
    return float(model.body_mass.sum()), np.array(tau)


def assert_three_libraries_agree(arm: Arm, urdf: str) -> None:
    """The text `urdf`, read by each library, is `arm` in mass, gravity and inertia."""
    q, v, a = motion(10)
    still = np.zeros_like(q)
    mass, tau = torque_by_mujoco(urdf, q, v, a)
    expected, gravity = arm.torque(q, v, a), arm.torque(q, still, still)
    np.testing.assert_allclose(tau, expected, atol=1e-9 * np.abs(expected).max())
    tau = torque_by_mujoco(urdf, q, still, still)[1]
    np.testing.assert_allclose(tau, gravity, atol=1e-9 * np.abs(gravity).max())
    robot = yourdf(urdf)
    tau = np.array([gravity_by_yourdfpy(robot, arm, row) for row in q])
    np.testing.assert_allclose(tau, gravity, atol=1e-9 * np.abs(gravity).max())
    moving = sum(m for name, m, _ in weights(robot, q[0]) if name != "base_link_inertia")
    total = arm.inertials[:, 0].sum()
    assert mass == pytest.approx(total, rel=1e-9) and moving == pytest.approx(total, rel=1e-9)


def test_the_files_are_what_the_script_writes() -> None:
    texts = runpy.run_path(str(folder() / "write.py"))["texts"]()
    assert set(texts) == set(names())
    for name, text in texts.items():
        assert (folder() / f"{name}.urdf").read_bytes() == text.encode(), (
            f"run urdf/write.py: {name}"
        )


def test_pinocchio_mujoco_and_yourdfpy_read_the_same_arm(arm: Arm) -> None:
    assert_three_libraries_agree(arm, arm.urdf)


def test_yourdfpy_puts_every_frame_where_we_do(arm: Arm) -> None:
    robot = yourdf(arm.urdf)
    for q in motion(3)[0]:
        robot.update_cfg(q)
        for frame in ("tool0", "base", "ft_frame", "flange", "forearm_link"):
            expected = robot.get_transform(frame, "base_link")
            np.testing.assert_allclose(arm.pose(q, frame), expected, atol=1e-12)


def test_tool0_is_the_last_joints_frame_and_the_wrench_frame_faces_the_arm(arm: Arm) -> None:
    q = motion()[0]
    np.testing.assert_allclose(arm.pose(q), arm.pose(q, "wrist_3_link"), atol=1e-15)
    np.testing.assert_allclose(
        arm.pose(q, "ft_frame"), arm.pose(q) @ np.diag([1.0, -1.0, -1.0, 1.0]), atol=1e-15
    )


def test_every_link_with_mass_has_a_shape(arm: Arm) -> None:
    for link in ET.fromstring(arm.urdf).findall("link"):
        has_mass = link.find("inertial") is not None
        assert has_mass == (link.find("visual") is not None) == (link.find("collision") is not None)


@pytest.mark.parametrize(
    "path", sorted(DATA.glob("ur_description/urdf/ur*_*.urdf")), ids=lambda path: path.stem
)
def test_example_robot_data_arms_can_be_read(path: Path) -> None:
    arm = load_arm(path)
    assert arm.joints == 6 and arm.joint_names[5] == "wrist_3_joint"
    assert read_arm(describe(arm, arm.inertials)).name == arm.name


def test_example_robot_data_is_where_we_look() -> None:
    assert len(list(DATA.glob("ur_description/urdf/ur*_*.urdf"))) >= 8


@pytest.mark.parametrize("relative", ["kinova_description/robots/kinova.urdf", "xarm_description"])
def test_arms_of_other_makers_obey_the_same_law(relative: str) -> None:
    path = DATA / relative
    arm = load_arm(path if path.is_file() else next(path.rglob("*.urdf")))
    q, v, a = np.random.default_rng(2).normal(size=(3, 10, arm.joints))
    tau = arm.torque(q, v, a)
    linear = arm.regressor(q, v, a) @ arm.inertials.ravel()
    np.testing.assert_allclose(linear, tau, atol=1e-10 * np.abs(tau).max())


def test_a_written_file_loads_with_exactly_its_inertials(arm: Arm, tmp_path: Path) -> None:
    other, path = other_bodies(arm), tmp_path / "identified.urdf"
    path.write_text(describe(arm, other), encoding="utf-8")
    loaded = load_arm(path)
    np.testing.assert_allclose(loaded.inertials, other, rtol=1e-9, atol=1e-12)
    assert (loaded.name, loaded.joint_names) == (arm.name, arm.joint_names)
    assert_three_libraries_agree(loaded, path.read_text())


def test_a_tools_mass_is_written_once(tooled: Arm, tmp_path: Path) -> None:
    other, path = other_bodies(tooled), tmp_path / "identified.urdf"
    path.write_text(describe(tooled, other), encoding="utf-8")
    loaded = load_arm(path)
    np.testing.assert_allclose(loaded.inertials, other, rtol=1e-9, atol=1e-12)
    assert_three_libraries_agree(loaded, path.read_text())


def test_the_base_keeps_what_it_had(arm: Arm) -> None:
    written = ET.fromstring(describe(arm, other_bodies(arm)))
    mass = written.find("link[@name='base_link_inertia']/inertial/mass")
    assert mass is not None and float(mass.get("value", "0")) in (2.0, 4.0)


@pytest.mark.timeout(20)  # with a search that begins anew at every tag it takes an hour
def test_a_file_of_tags_without_end_is_refused_as_soon_as_it_is_read(tmp_path: Path) -> None:
    (path := tmp_path / "arm.urdf").write_text("<mesh " * 170_000)
    with pytest.raises(ArmError, match="is not XML"):
        load_arm(path)


def test_provenance_heads_the_file_whatever_it_says(tooled: Arm) -> None:
    text = describe(tooled, tooled.inertials, "fit of <monday--run>.csv --- sha 12ab\0 -->-")
    head = text.splitlines()[1]
    assert head.startswith("<!-- fit of <monday- -run>.csv") and "sha 12ab" in head
    assert read_arm(text).joints == 6


def test_a_body_that_cannot_be_is_not_written(tooled: Arm) -> None:
    impossible = tooled.inertials.copy()
    impossible[2, 0] = -1.0
    with pytest.raises(ArmError, match="forearm_link"):
        describe(tooled, impossible)


def test_an_arm_that_stands_upright_does_not_touch_itself(arm: Arm) -> None:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(arm.urdf)
    data = mujoco.MjData(model)
    data.qpos[:] = np.radians([0, -90, 0, -90, 0, 0])
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
