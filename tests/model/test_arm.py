"""Laws of rigid-body dynamics that every arm obeys, and what becomes of broken descriptions."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from urdyn.errors import ArmError
from urdyn.model.arm import Arm, load_arm, read_arm, with_inertials
from urdyn.model.consistency import inertials, is_consistent, log_cholesky
from urdyn.model.library import folder, names
from urdyn.types import Array

GRAVITY = 9.81  # [m/s²]
ARMS = ("ur3", "ur3e", "ur5", "ur5e", "ur10", "ur10e", "ur16e", "ur20", "ur30")


@pytest.fixture(params=ARMS, scope="module")
def arm(request: pytest.FixtureRequest) -> Arm:
    return load_arm(request.param)


@pytest.fixture(scope="module")
def ur5e() -> Arm:
    return load_arm("ur5e")


def motion(*shape: int) -> Array:
    """Random q, v, a, stacked (3, ..., 6)."""
    return np.random.default_rng(11).uniform(-2.0, 2.0, size=(3, *shape, 6))


def other_bodies(arm: Arm) -> Array:
    """Inertials near the arm's that solid bodies can have, (6, 10)."""
    x = log_cholesky(arm.inertials)
    return inertials(x + np.random.default_rng(5).normal(scale=0.1, size=x.shape))


def test_the_library_has_nine_arms_small_ones_first() -> None:
    assert names() == ARMS


def test_an_arm_is_what_its_description_says(arm: Arm) -> None:
    assert arm.joint_names[::5] == ("shoulder_pan_joint", "wrist_3_joint")
    assert arm.link_names[::5] == ("shoulder_link", "wrist_3_link")
    assert arm.tool == "tool0" and arm.name in ARMS and arm.joints == 6
    turns = np.array([2, 2, 1, 2, 2, 2]) * np.pi
    np.testing.assert_array_equal([arm.lower, arm.upper], [-turns, turns])
    assert (arm.velocity_limit >= np.radians(120)).all() and (arm.effort_limit >= 9.0).all()
    assert not arm.inertials.flags.writeable


def test_every_published_link_is_a_solid_body(arm: Arm) -> None:
    assert is_consistent(arm.inertials, margin=1e-5).all()  # 3 mm at the thinnest


def test_names_are_found_in_any_case() -> None:
    assert load_arm("UR10e").name == "ur10e"


def test_regressor_times_inertials_is_newton_euler(arm: Arm) -> None:
    q, v, a = motion(50)
    tau = arm.torque(q, v, a)
    linear = arm.regressor(q, v, a) @ arm.inertials.ravel()
    np.testing.assert_allclose(linear, tau, atol=1e-10 * np.abs(tau).max())


def test_regressor_finds_36_of_60_inertials(arm: Arm) -> None:
    Y = arm.regressor(*motion(200)).reshape(-1, 60)
    values = np.linalg.svd(Y, compute_uv=False)
    assert values[35] > 1e-4 * values[0] and values[36] < 1e-12 * values[0]


def test_torque_derivatives_equal_finite_differences(arm: Arm) -> None:
    q, v, a = motion()
    h = 1e-6
    steps = h * np.eye(6)
    scale = np.abs(arm.torque(q, v, a)).max()
    moves: list[Callable[[Array], Array]] = [
        lambda d: arm.torque(q + d, v, a),
        lambda d: arm.torque(q, v + d, a),
        lambda d: arm.torque(q, v, a + d),
    ]
    for derivative, move in zip(arm.torque_derivatives(q, v, a), moves, strict=True):
        # A central difference is good to h² and to rounding / h: 2e-10 of the torque and less.
        difference = (move(steps) - move(-steps)).T / 2 / h
        np.testing.assert_allclose(derivative, difference, atol=1e-8 * scale)


def test_mass_matrix_is_symmetric_and_positive_definite(arm: Arm) -> None:
    M = arm.torque_derivatives(*motion(20))[2]
    np.testing.assert_array_equal(M, np.swapaxes(M, -1, -2))
    assert (np.linalg.eigvalsh(M) > 0.0).all()


def energy(arm: Arm, q: Array, v: Array) -> Array:
    """Kinetic and potential energy (...) [J], the latter from link poses and first moments."""
    M = arm.torque_derivatives(q, v, np.zeros(6))[2]
    kinetic = 0.5 * np.einsum("...i,...ij,...j", v, M, v)
    heights = [
        (arm.pose(q, link)[..., 2, :3] @ body[1:4]) + arm.pose(q, link)[..., 2, 3] * body[0]
        for link, body in zip(arm.link_names, arm.inertials, strict=True)
    ]
    return np.asarray(kinetic + GRAVITY * np.sum(heights, axis=0))


def test_energy_grows_by_the_power_put_in(arm: Arm) -> None:
    rng = np.random.default_rng(8)
    size, rate, phase = rng.uniform(0.2, 1.0, 6), rng.uniform(0.5, 2.0, 6), rng.uniform(0, 6, 6)

    def course(t: Array) -> tuple[Array, Array, Array]:
        angle = rate * t[:, None] + phase
        swing = size * np.sin(angle)
        return swing, size * rate * np.cos(angle), -(rate**2) * swing

    t, h = np.linspace(0.0, 10.0, 40), 1e-4
    gained = (energy(arm, *course(t + h)[:2]) - energy(arm, *course(t - h)[:2])) / 2 / h
    q, v, a = course(t)
    power = (v * arm.torque(q, v, a)).sum(axis=-1)
    # Truncation h² and rounding / h of some 500 J.
    np.testing.assert_allclose(gained, power, atol=1e-6 * np.abs(power).max())


def test_forward_dynamics_undoes_inverse_dynamics(arm: Arm) -> None:
    q, v, a = motion(20)
    np.testing.assert_allclose(arm.accelerate(q, v, arm.torque(q, v, a)), a, atol=1e-9)


def test_everything_broadcasts_over_leading_axes(ur5e: Arm) -> None:
    q, v, a = motion(4, 3)
    assert ur5e.regressor(q, v, a).shape == (4, 3, 6, 60)
    assert ur5e.torque(q, v[0], a[0, 0]).shape == (4, 3, 6)
    assert [d.shape for d in ur5e.torque_derivatives(q, v, a)] == [(4, 3, 6, 6)] * 3
    assert ur5e.pose(q).shape == (4, 3, 4, 4) and ur5e.pose(q[0, 0]).shape == (4, 4)
    assert ur5e.jacobian(q).shape == (4, 3, 6, 6)
    assert ur5e.torque(q[:0], v[:0], a[:0]).shape == (0, 3, 6)
    one_by_one = [ur5e.torque(*(x[i, 1] for x in (q, v, a))) for i in range(4)]
    np.testing.assert_array_equal(ur5e.torque(q, v, a)[:, 1], one_by_one)


def test_a_motion_of_the_wrong_width_is_refused(ur5e: Arm) -> None:
    with pytest.raises(ArmError, match="6 joints"):
        ur5e.torque(np.zeros(7), np.zeros(7), np.zeros(7))


def test_jacobian_is_the_derivative_of_the_pose(arm: Arm) -> None:
    q, h = motion()[0], 1e-6
    T, J, steps = arm.pose(q), arm.jacobian(q), h * np.eye(6)
    dT = (arm.pose(q + steps) - arm.pose(q - steps)) / 2 / h
    np.testing.assert_allclose(dT[:, :3, 3].T, J[:3], atol=1e-8)
    spin = dT[:, :3, :3] @ T[:3, :3].T  # [w x]
    np.testing.assert_allclose([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], J[3:], atol=1e-8)


def test_pose_is_the_product_of_the_makers_denavit_hartenberg_rows(arm: Arm) -> None:
    dh = tomllib.loads((folder() / "arms.toml").read_text())[arm.name]["dh"]
    q = motion()[0]
    T = np.diag([-1.0, -1.0, 1.0, 1.0])  # the controller's base seen from base_link
    d = [dh["d1"], 0, 0, dh["d4"], dh["d5"], dh["d6"]]
    a = [0, dh["a2"], dh["a3"], 0, 0, 0]
    for angle, d_i, a_i, twist in zip(q, d, a, np.radians([90, 0, 0, 90, -90, 0]), strict=True):
        c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
        T = T @ [
            [c, -s * ct, s * st, a_i * c],
            [s, c * ct, -c * st, a_i * s],
            [0, st, ct, d_i],
            [0, 0, 0, 1],
        ]
    np.testing.assert_allclose(arm.pose(q), T, atol=1e-12)


def test_an_unknown_frame_is_refused_by_name(ur5e: Arm) -> None:
    with pytest.raises(ArmError, match="gripper"):
        ur5e.pose(np.zeros(6), "gripper")


def test_other_inertials_act_as_an_arm_that_has_them(ur5e: Arm) -> None:
    q, v, a = motion(5)
    other = other_bodies(ur5e)
    heavier = with_inertials(ur5e, other)
    expected = ur5e.regressor(q, v, a) @ other.ravel()
    np.testing.assert_allclose(ur5e.torque(q, v, a, other), expected, atol=1e-10)
    np.testing.assert_allclose(heavier.torque(q, v, a), expected, atol=1e-10)
    np.testing.assert_array_equal(heavier.inertials, other)
    for one, two in zip(
        ur5e.torque_derivatives(q, v, a, other), heavier.torque_derivatives(q, v, a), strict=True
    ):
        np.testing.assert_array_equal(one, two)
    np.testing.assert_allclose(ur5e.accelerate(q, v, expected, other), a, atol=1e-9)
    assert not np.allclose(ur5e.torque(q, v, a), expected)  # the first arm is as it was


PENDULUM = """<robot name="pendulum">
  <link name="ground"/>
  <link name="bob"><inertial><origin xyz="0.1 0.2 0.3"/><mass value="2"/>
    <inertia ixx="1.1" ixy="0.01" ixz="0.02" iyy="1.2" iyz="0.03" izz="1.3"/></inertial></link>
  <joint name="pivot" type="revolute"><parent link="ground"/><child link="bob"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="5" velocity="6"/></joint>
</robot>"""


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
@pytest.mark.parametrize(
    ("soft", "narrowed"),
    [
        ('k_velocity="9"', (None, None)),
        ('k_velocity="9" soft_lower_limit="-0.5"', (-0.5, None)),
        ('k_velocity="9" soft_lower_limit="-9" soft_upper_limit="0.7"', (None, 0.7)),
    ],
)
def test_a_joint_moves_within_its_soft_limits(
    kind: str, soft: str, narrowed: tuple[float | None, float | None]
) -> None:
    text = PENDULUM.replace("revolute", kind)
    hard = read_arm(text)
    arm = read_arm(text.replace("</joint>", f"<safety_controller {soft}/></joint>"))
    lower, upper = narrowed
    assert arm.lower == (hard.lower if lower is None else lower)
    assert arm.upper == (hard.upper if upper is None else upper)


def test_a_jacobian_of_one_joint_is_one_column() -> None:
    arm, q = read_arm(PENDULUM), np.array([[0.3], [0.4]])
    turning = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])[:, None]  # about the bob's own frame
    np.testing.assert_array_equal(arm.jacobian(q), [turning, turning])
    np.testing.assert_array_equal(arm.jacobian(q[0]), turning)


def test_one_joint_at_one_moment_has_the_shapes_of_many_at_many() -> None:
    arm, motion = read_arm(PENDULUM), np.full((3, 2, 1), 0.3)

    def derivatives(q: Array, v: Array, a: Array) -> Array:
        return np.stack(arm.torque_derivatives(q, v, a), axis=-1)

    for of in (arm.regressor, arm.wrench_regressor, derivatives):
        np.testing.assert_array_equal(of(*motion[:, 0]), of(*motion)[0])


def test_inertials_come_in_pinocchios_order_about_the_joint() -> None:
    m, (x, y, z) = 2.0, (0.1, 0.2, 0.3)
    about_joint = [
        1.1 + m * (y * y + z * z),
        0.01 - m * x * y,
        1.2 + m * (x * x + z * z),
        0.02 - m * x * z,
        0.03 - m * y * z,
        1.3 + m * (x * x + y * y),
    ]
    arm = read_arm(PENDULUM)
    np.testing.assert_allclose(arm.inertials, [[m, m * x, m * y, m * z, *about_joint]], rtol=1e-14)
    assert (arm.name, arm.tool) == ("pendulum", "bob")
    assert (arm.effort_limit.item(), arm.velocity_limit.item()) == (5.0, 6.0)


def test_a_prismatic_joint_carries_weight_along_its_axis() -> None:
    lift = PENDULUM.replace("revolute", "prismatic").replace('"1 0 0"', '"0 0 1"')
    tau = read_arm(lift).torque(np.zeros(1), np.zeros(1), np.ones(1))
    np.testing.assert_allclose(tau, [2.0 * (GRAVITY + 1.0)])


@pytest.mark.parametrize("limit", [True, False])
def test_a_continuous_joint_is_one_angle_within_a_turn(limit: bool) -> None:
    endless = PENDULUM.replace("revolute", "continuous")
    arm = read_arm(endless if limit else re.sub("<limit[^>]*>", "", endless))
    assert (arm.lower.item(), arm.upper.item()) == (-2 * np.pi, 2 * np.pi)
    assert arm.effort_limit.item() == (5.0 if limit else np.inf)
    swing = np.array([[0.3], [0.4], [0.5]])
    assert arm.torque(*swing) == read_arm(PENDULUM).torque(*swing)


def test_a_limit_of_zero_is_none() -> None:
    """Exporters write it where they were told nothing; an arm that may not move is no arm."""
    arm = read_arm(PENDULUM.replace('effort="5" velocity="6"', 'effort="0" velocity="0.0"'))
    assert (arm.effort_limit.item(), arm.velocity_limit.item()) == (np.inf, np.inf)


@pytest.mark.parametrize("key", ["effort", "velocity"])
def test_a_limit_below_zero_is_refused(key: str) -> None:
    with pytest.raises(ArmError, match="'pivot' has a negative limit of velocity or effort"):
        read_arm(re.sub(f'{key}="', f'{key}="-', PENDULUM))


def test_what_is_bolted_to_a_link_is_part_of_its_body() -> None:
    bolted = PENDULUM.replace(
        "</robot>",
        """<link name="weight"><inertial><mass value="3"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
        <joint name="bolt" type="fixed"><parent link="bob"/><child link="weight"/>
        <origin xyz="0 0 1"/><axis xyz="0 0 0"/></joint></robot>""",
    )
    arm = read_arm(bolted)
    np.testing.assert_allclose(arm.inertials[0, :4], [5.0, 0.2, 0.4, 0.6 + 3.0])
    assert arm.link_names == ("bob",)


def test_missing_meshes_do_not_matter() -> None:
    visual = '<visual><geometry><mesh filename="package://nowhere/x.dae"/></geometry></visual>'
    assert read_arm(PENDULUM.replace("</link>", visual + "</link>")).joints == 1


SECOND = """<link name="other"><inertial><mass value="1"/>
  <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="second" type="revolute"><parent link="ground"/><child link="other"/>
  <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="5" velocity="6"/></joint></robot>"""
LAUGHS = '<!DOCTYPE robot [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>'
XACRO = "http://www.ros.org/wiki/xacro"
INERTIAL = re.compile("<inertial>.*</inertial>", re.DOTALL)


def edited(old: str, new: str) -> str:
    assert old in PENDULUM
    return PENDULUM.replace(old, new)


BROKEN = {
    "nothing": ("", "not XML"),
    "cut short": (PENDULUM[:200], "not XML"),
    "another language": ("<html><body/></html>", "not a URDF"),
    "entities that explode": (LAUGHS + edited("pendulum", "&b;"), "DOCTYPE"),
    "entities from a file": (
        '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/hostname">]>' + edited("pendulum", "&a;"),
        "DOCTYPE",
    ),
    "an empty robot": ("<robot/>", "has no links"),
    "a xacro": (
        edited(
            '<link name="ground"/>', f'<x:macro xmlns:x="{XACRO}"><link name="ground"/></x:macro>'
        ),
        "is a xacro, not yet a URDF",
    ),
    "no joint": (re.sub("<joint.*</joint>", "", PENDULUM, flags=re.DOTALL), "root link"),
    "only fixed joints": (edited("revolute", "fixed"), "no joint that moves"),
    "two branches": (edited("</robot>", SECOND), "branches at pivot, second"),
    "no inertial": (INERTIAL.sub("", PENDULUM), "'bob' moves and has no mass"),
    "no mass": (edited('mass value="2"', 'mass value="0"'), "'bob' moves and has no mass"),
    "negative mass": (edited('mass value="2"', 'mass value="-2"'), "negative mass"),
    "mass is no number": (edited('mass value="2"', 'mass value="two"'), "'two' is not a number"),
    "mass is nan": (edited('mass value="2"', 'mass value="nan"'), "not finite"),
    "mass left out": (edited('<mass value="2"/>', ""), "'bob' has no <mass>"),
    "inertia left out": (re.sub("<inertia .*/>", "", PENDULUM), "'bob' has no <inertia>"),
    "half an inertia": (edited('izz="1.3"', ""), "izz"),
    "impossible inertia": (edited('izz="1.3"', 'izz="3.3"'), "no solid body"),
    "negative inertia": (edited('ixx="1.1"', 'ixx="-1.1"'), "no solid body"),
    "centre in the plane": (edited('xyz="0.1 0.2 0.3"', 'xyz="0.1 0.2"'), "not a vector"),
    "floating joint": (edited("revolute", "floating"), "type 'floating'"),
    "no limit": (re.sub("<limit[^>]*>", "", PENDULUM), "'pivot' has no <limit>"),
    "soft limits outside": (
        edited("</joint>", '<safety_controller soft_lower_limit="1"/></joint>'),
        "no room to move: its limits are 1 and 1",
    ),
    "limits swapped": (edited('lower="-1" upper="1"', 'lower="1" upper="-1"'), "no room"),
    "no speed limit": (edited('velocity="6"', ""), "velocity"),
    "no axis": (edited('"1 0 0"', '"0 0 0"'), "axis"),
    "two links of a name": (edited("</robot>", '<link name="bob"/></robot>'), "only once"),
    "nameless joint": (edited('name="pivot"', ""), "joint name ''"),
    "unknown link": (edited('child link="bob"', 'child link="bib"'), "'bib'"),
    "no parent": (edited('<parent link="ground"/>', ""), "no <parent>"),
    "loose link": (edited("</robot>", '<link name="loose"/></robot>'), "root link .ground, loose"),
    "mimic": (edited("</joint>", '<mimic joint="pivot"/></joint>'), "mimics"),
    "a link on two joints": (
        edited("</robot>", SECOND.replace('child link="other"', 'child link="bob"')),
        "'bob' hangs on more than one joint",
    ),
    "a ring of links": (
        edited(
            "</robot>",
            '<link name="a"/><link name="b"/>'
            '<joint name="f" type="fixed"><parent link="a"/><child link="b"/></joint>'
            '<joint name="g" type="fixed"><parent link="b"/><child link="a"/></joint></robot>',
        ),
        "loop",
    ),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_description_ends_in_one_clear_line(
    case: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text, reason = BROKEN[case]
    path = tmp_path / "broken.urdf"
    path.write_text(text)
    with pytest.raises(ArmError, match=reason) as caught:
        load_arm(path)
    message = str(caught.value)
    assert message.startswith(str(path)) and "\n" not in message
    assert tuple(capfd.readouterr()) == ("", "")


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(b"\x89PNG\xff\xfe\x00")
    with pytest.raises(ArmError, match="UTF-8"):
        load_arm(path)


@pytest.mark.parametrize("robot", ["ur4", "", "no/such/file.urdf", "/"])
def test_an_unknown_arm_is_answered_with_the_names(robot: str) -> None:
    with pytest.raises(
        ArmError, match="ur3, ur3e, ur5, ur5e, ur10, ur10e, ur16e, ur20, ur30, ur7e, ur12e"
    ):
        load_arm(robot)
