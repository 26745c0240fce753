"""Laws of the wrench at the flange, and of arms that are not as drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.model.arm import Arm, load_arm
from urdyn.simulate import (
    Payload,
    fourier,
    observe,
    parse_fault,
    perfect_sensors,
    simulate,
    virtual_arm,
)
from urdyn.simulate.deviations import SPREAD, deviated, draw_deviations
from urdyn.simulate.schedule import course
from urdyn.simulate.wrench import wrenches

TOOL = Payload(1.2, np.array([0.02, -0.01, 0.07]))


@pytest.fixture(scope="module")
def dynamics(ur5e: Arm):
    return virtual_arm(ur5e, 2, TOOL)


@pytest.fixture(scope="module")
def made(ur5e: Arm):
    return fourier(ur5e, 10.0, 100.0, np.random.default_rng(0))


def in_base(arm: Arm, q, wrench):
    """A wrench in the flange's axes, in the base's."""
    turn = np.diag([-1.0, -1.0, 1.0]) @ arm.pose(q)[:, :3, :3]
    return np.hstack([np.einsum("nij,nj->ni", turn, half) for half in np.hsplit(wrench, 2)])


def test_what_the_flange_feels_is_what_the_joints_lift(ur5e, dynamics, made):
    """J' W is the torque of the payload: recursive Newton-Euler with it, less that without."""
    motion = made.at(made.t)
    felt = wrenches(dynamics, course(dynamics, (), made.t), motion)["ft_raw_wrench"]
    turn = ur5e.pose(made.q, "wrist_3_link")[:, :3, :3]
    in_root = np.hstack([np.einsum("nij,nj->ni", turn, h) for h in np.hsplit(felt, 2)])
    torque = np.einsum("nij,ni->nj", ur5e.jacobian(made.q, "wrist_3_link"), -in_root)
    wanted = dynamics.load(motion) - replace(dynamics, payload=np.zeros(10)).load(motion)
    # Two Jacobians 2e-5 s apart err by their rounding over it, 1e-11 of their size.
    np.testing.assert_allclose(torque, wanted, rtol=0, atol=1e-8 * np.abs(wanted).max())


def test_a_hanging_payload_weighs_what_it_weighs(ur5e, dynamics):
    still = np.zeros((1, 6))
    motion = fourier(ur5e, 2.0, 10.0, np.random.default_rng(0)).at(np.zeros(1))
    motion = replace(motion, q=still, v=still, a=still)
    felt = wrenches(dynamics, course(dynamics, (), np.zeros(1)), motion)["ft_raw_wrench"]
    in_base_axes = in_base(ur5e, still, felt)[0, :3]
    np.testing.assert_allclose(in_base_axes, [0.0, 0.0, -9.81 * TOOL.mass], atol=1e-9)


def test_the_tcp_force_knows_the_payload_of_the_first_day_and_no_other(ur5e, dynamics, made):
    change = parse_fault("payload_change:onset=5,mass=3,com=0/0/0.05", 6)
    now = course(dynamics, (change,), made.t)
    both = wrenches(dynamics, now, made.at(made.t))
    before = made.t < 5.0
    assert not both["actual_TCP_force"][before].any()
    # Slow as it is, the motion adds little to the weight that nobody told of.
    pull = both["actual_TCP_force"][~before, 2]
    assert np.abs(pull + 9.81 * (3.0 - TOOL.mass)).max() < 0.5 * 9.81 * (3.0 - TOOL.mass)


def test_a_push_on_the_last_link_is_told_as_it_is(ur5e, dynamics, made):
    push = parse_fault("collision:link=5,onset=2,duration=1,force=10/20/-30", 6)
    now = course(dynamics, (push,), made.t)
    force = wrenches(dynamics, now, made.at(made.t))["actual_TCP_force"]
    share = np.where((made.t > 2) & (made.t < 3), np.sin(np.pi * (made.t - 2.0)), 0.0)
    wanted = np.outer(share, [10.0, 20.0, -30.0])
    np.testing.assert_allclose(force[:, :3], wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("robot", "felt"), [("ur5", False), ("ur5e", True), ("ur20", True)])
def test_arms_without_a_force_sensor_have_no_raw_wrench(robot, felt):
    arm = load_arm(robot)
    sensors = replace(perfect_sensors(arm), wrench_noise=(0.0, 0.0))
    log, _ = simulate(arm, 2.0, 50.0, 0, sensors=sensors)
    assert "actual_TCP_force" in log and ("ft_raw_wrench" in log) == felt


def test_no_deviation_is_the_arm_as_drawn(ur10e):
    same = deviated(ur10e, np.zeros((6, 4)))
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (50, 6))
    np.testing.assert_allclose(same.pose(q), ur10e.pose(q), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(same.inertials, ur10e.inertials)


def test_a_longer_link_is_longer(ur10e):
    longer = np.zeros((6, 4))
    longer[2, 0] = -1e-3  # the forearm begins that much further along the upper arm
    q = np.zeros((1, 6))
    moved = deviated(ur10e, longer).pose(q) - ur10e.pose(q)
    assert np.linalg.norm(moved[0, :3, 3]) == pytest.approx(1e-3, abs=1e-12)
    np.testing.assert_allclose(moved[0, :3, :3], 0.0, atol=1e-12)


def test_deviations_spread_as_those_of_real_arms(ur10e):
    drawn = np.array([draw_deviations(ur10e, np.random.default_rng(s)) for s in range(500)])
    five = 5.0 / np.sqrt(2.0 * len(drawn))
    np.testing.assert_allclose(drawn.std(axis=0), SPREAD, rtol=five)
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (40, 6))
    off = [deviated(ur10e, d).pose(q)[:, :3, 3] - ur10e.pose(q)[:, :3, 3] for d in drawn[:20]]
    # Tool of a UR10 by its nominal kinematics, measured: about 1 mm after the best base and tool;
    # without these, some millimetres.
    assert 1e-3 < np.sqrt((np.array(off) ** 2).sum(axis=-1).mean()) < 8e-3


def test_the_controller_tells_the_pose_of_the_arm_as_built(ur10e):
    sensors = perfect_sensors(ur10e)
    (drawn, _), (built, truth) = (
        simulate(ur10e, 4.0, 50.0, 3, sensors=sensors, deviations=d) for d in (False, True)
    )
    np.testing.assert_allclose(
        built.channels["actual_q"], drawn.channels["actual_q"], rtol=0, atol=0.05
    )
    arm = virtual_arm(ur10e, 3, deviations=True).arm
    q = built.channels["actual_q"]
    wanted = arm.pose(q)[:, :3, 3] * [-1.0, -1.0, 1.0]
    told = built.channels["actual_TCP_pose"][:, :3]
    np.testing.assert_allclose(told, wanted, rtol=0, atol=1e-9)
    nominal = ur10e.pose(q)[:, :3, 3] * [-1.0, -1.0, 1.0]
    assert np.abs(told - nominal).max() > 1e-4
    assert truth["kinematics"][1]["xyz"] != [0.0, 0.0, 0.0]


def test_deviations_leave_masses_and_drives_as_they_are(ur10e):
    drawn, built = (virtual_arm(ur10e, 3, deviations=d) for d in (False, True))
    np.testing.assert_array_equal(built.inertials, drawn.inertials)
    np.testing.assert_array_equal(built.drive.coulomb, drawn.drive.coulomb)


def test_the_wrench_leaves_all_other_noise_as_it_is(ur5e, dynamics, made):
    quiet = perfect_sensors(ur5e)
    noisy = replace(quiet, wrench_noise=(1.0, 0.02), velocity_noise=1e-3)
    without = replace(noisy, wrench_noise=None)
    one, two = (observe(dynamics, made, s, np.random.default_rng(0)) for s in (noisy, without))
    for name in two.channels:
        np.testing.assert_array_equal(one.channels[name], two.channels[name])
