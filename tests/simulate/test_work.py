"""Laws of work: limits hold with the piece in hand, pieces come and go, programs change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.model.arm import Arm, load_arm, with_inertials
from urdyn.simulate import (
    Payload,
    Work,
    fourier,
    parse_fault,
    pick_and_place,
    plan,
    shift,
    typical_gears,
    virtual_arm,
)
from urdyn.simulate.follow import follow
from urdyn.simulate.limits import comfortable, require
from urdyn.simulate.schedule import course
from urdyn.simulate.there_and_back import there_and_back
from urdyn.simulate.unfolding import unfolding

ARMS = ("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "ur16e", "ur20", "ur30")
PIECE = Payload(2.0, np.array([0.0, 0.0, 0.08]))


def heaviest(arm: Arm, work: Work) -> Arm:
    """The arm with the heaviest of its pieces."""
    carried = work.handling[0].carried
    inertials = arm.inertials.copy()
    inertials[-1] += carried[carried[:, 0].argmax()]
    return with_inertials(arm, inertials)


@pytest.mark.parametrize("robot", ARMS)
def test_comfortable_limits_hold_at_work_for_every_arm(robot):
    arm = load_arm(robot)
    for seed in range(3):
        work = pick_and_place(arm, 30.0, 125.0, np.random.default_rng(seed))
        require(heaviest(arm, work), comfortable(arm), work.trajectory)


def test_comfortable_limits_hold_throughout_a_shift(ur5e: Arm):
    work = shift(ur5e, 2400.0, 25.0, np.random.default_rng(1))
    require(heaviest(ur5e, work), comfortable(ur5e), work.trajectory)


def test_an_arm_that_nobody_rated_works_with_a_common_arms_pieces_and_gears(ur5e: Arm):
    unrated = replace(ur5e, effort_limit=np.full(6, np.inf))
    work = pick_and_place(unrated, 30.0, 125.0, np.random.default_rng(0))
    assert 0.1 < work.handling[0].carried[:, 0].max() < 5.0
    stiffness, usual = typical_gears(unrated).stiffness, typical_gears(ur5e).stiffness
    assert (stiffness > 0.1 * usual).all() and (stiffness < 10.0 * usual).all()


def test_velocity_and_acceleration_are_derivatives(ur10e: Arm):
    made = pick_and_place(ur10e, 20.0, 500.0, np.random.default_rng(0)).trajectory
    h = made.step
    jerk = 1.05 * np.abs(np.diff(made.a, axis=0)).max() / h
    for whole, part, error in (
        (made.q, made.v, h**3 / 12.0 * jerk),
        (made.v, made.a, h**2 / 4.0 * jerk),
    ):
        step = 0.5 * h * (part[1:] + part[:-1])
        assert np.abs(np.diff(whole, axis=0) - step).max() <= error


def test_the_piece_is_in_hand_from_one_place_to_the_other(ur5e: Arm):
    work = pick_and_place(ur5e, 60.0, 100.0, np.random.default_rng(0), PIECE)
    dynamics = virtual_arm(ur5e, 0)
    mass = course(dynamics, work.handling, work.trajectory.t).payload[:, 0]
    assert set(mass) == {0.0, 2.0} and mass[0] == 0.0
    grips = np.flatnonzero(np.diff(mass))
    # It opens and closes where the arm stands, each time at the same two places.
    assert not work.trajectory.v[grips].any()
    assert len(np.unique(work.trajectory.q[grips].round(9), axis=0)) == 2
    assert np.isin(work.handling[0].begin, unfolding(dynamics, work.handling, 60.0).t).all()


def test_pieces_are_beside_what_the_arm_carries_anyway(ur5e: Arm):
    gripper = Payload(1.0, np.array([0.0, 0.0, 0.05]))
    work = pick_and_place(ur5e, 30.0, 50.0, np.random.default_rng(0), PIECE)
    dynamics = virtual_arm(ur5e, 0, gripper)
    assert set(course(dynamics, work.handling, work.trajectory.t).payload[:, 0]) == {1.0, 3.0}


@pytest.mark.parametrize("onset", [0, 12])
def test_pieces_come_and_go_whatever_the_tool_is_changed_for(ur5e: Arm, onset):
    work = pick_and_place(ur5e, 30.0, 50.0, np.random.default_rng(0), PIECE)
    t, changed = work.trajectory.t, parse_fault(f"payload_change:mass=0.5,onset={onset}", 6)
    mass = course(virtual_arm(ur5e, 0), (changed, *work.handling), t).payload[:, 0]
    assert set(mass[t >= onset]) == {0.5, 2.5} and set(mass[t < onset]) <= {0.0, 2.0}


def test_a_piece_is_carried_as_any_payload_is(ur5e: Arm):
    """Row by row the load is that of an arm with the piece, or of one without."""
    work = pick_and_place(ur5e, 20.0, 50.0, np.random.default_rng(0), PIECE)
    made, bare, full = work.trajectory, virtual_arm(ur5e, 0), virtual_arm(ur5e, 0, PIECE)
    (part,) = follow(bare, made, made.t, work.handling)
    carrying = part.course.payload[:, 0] > 0.0
    for rows, dynamics in ((carrying, full), (~carrying, bare)):
        load = dynamics.load(made.at(made.t))[rows]
        np.testing.assert_array_equal(part.load[rows], load)


def test_a_shift_has_several_programs_and_pauses(ur5e: Arm):
    work = shift(ur5e, 3 * 3600.0, 10.0, np.random.default_rng(3))
    masses = {mass for mass in work.handling[0].carried[:, 0] if mass}
    still = np.abs(work.trajectory.v).max(axis=1) == 0.0
    edges = np.flatnonzero(np.diff(still.astype(int)))
    longest = np.diff(edges).max() * work.trajectory.step
    assert len(masses) >= 5 and longest >= 30.0
    assert 0.1 < still.mean() < 0.5


def test_the_seed_decides(ur5e: Arm):
    same, again, other = (shift(ur5e, 60.0, 10.0, np.random.default_rng(s)) for s in (1, 1, 2))
    assert same.trajectory.q.tobytes() == again.trajectory.q.tobytes()
    assert same.trajectory.q.tobytes() != other.trajectory.q.tobytes()


def test_a_motion_goes_by_its_name(ur5e: Arm):
    named = plan("fourier", ur5e, 4.0, 50.0, np.random.default_rng(0))
    made = fourier(ur5e, 4.0, 50.0, np.random.default_rng(0))
    assert named.trajectory.q.tobytes() == made.q.tobytes() and not named.handling
    with pytest.raises(InputError, match="no motion 'dance'; name one of fourier"):
        plan("dance", ur5e, 4.0, 50.0, np.random.default_rng(0))


@pytest.mark.parametrize("kind", ["point_to_point", "pick_and_place"])
@pytest.mark.parametrize("duration", [19.0, 20.0, 22.0])  # a piece in hand at home, away; none
def test_whatever_is_moved_there_is_moved_back(ur5e: Arm, kind: str, duration: float):
    """An arm bears the way back as it did the way there, and ends where it began, hands empty."""
    there = plan(kind, ur5e, duration, 50.0, np.random.default_rng(0))
    work = there_and_back(there)
    made, t = work.trajectory, work.trajectory.t
    assert t[-1] == 2.0 * there.trajectory.t[-1] and np.diff(t) == pytest.approx(made.step)
    np.testing.assert_array_equal(made.q[-1], made.q[0])
    (part,) = follow(virtual_arm(ur5e, 0), made, t, work.handling)
    np.testing.assert_allclose(part.load, part.load[::-1], atol=1e-9)
    np.testing.assert_array_equal(part.course.payload, part.course.payload[::-1])
    assert not part.course.payload[-1].any()


@pytest.mark.parametrize(("kind", "duration"), [("fourier", 4.0), ("pick_and_place", 23.0)])
def test_work_that_ends_as_it_began_needs_no_way_back(ur5e: Arm, kind: str, duration: float):
    work = plan(kind, ur5e, duration, 50.0, np.random.default_rng(0))
    assert there_and_back(work) is work


def test_a_run_too_short_for_a_move_is_refused(ur5e: Arm):
    with pytest.raises(InputError, match="no move fits"):
        pick_and_place(ur5e, 0.2, 50.0, np.random.default_rng(0))


def test_a_piece_that_no_arm_holds_is_refused(ur5e: Arm):
    brick = Payload(80.0, np.array([0.0, 0.0, 0.2]))
    with pytest.raises(InputError, match="lighter"):
        pick_and_place(ur5e, 20.0, 50.0, np.random.default_rng(0), brick)
