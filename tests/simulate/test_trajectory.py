"""Laws of trajectories: limits hold, ends are at rest, velocity is the derivative of the angle."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.model.arm import load_arm, with_inertials
from urdyn.simulate import Payload, Trajectory, fourier, point_to_point, simulate, virtual_arm
from urdyn.simulate.limits import comfortable, rated, require
from urdyn.simulate.trajectory import BLOCK

ARMS = ("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "ur16e", "ur20", "ur30")
KINDS = {"fourier": fourier, "point to point": point_to_point}


def make(kind: str, robot: str, seed: int = 0, duration: float = 12.0, rate: float = 125.0):
    return KINDS[kind](load_arm(robot), duration, rate, np.random.default_rng(seed))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("robot", ARMS)
def test_comfortable_limits_hold_for_every_arm(robot, kind):
    arm = load_arm(robot)
    for seed in range(4):
        require(arm, comfortable(arm), make(kind, robot, seed))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("joint", "lower", "upper"), [(1, 0.0, 3.1), (1, -1.6, 1.6), (3, -1.5, 1.5), (3, -1.6, -1.5)]
)
def test_a_joint_that_may_not_be_upright_moves_within_its_range(kind, joint, lower, upper):
    arm = load_arm("ur5e")
    ends = np.array([arm.lower, arm.upper])
    ends[:, joint] = lower, upper
    narrow = replace(arm, lower=ends[0], upper=ends[1])
    made = KINDS[kind](narrow, 12.0, 50.0, np.random.default_rng(0))
    require(narrow, rated(narrow), made)
    assert np.ptp(made.q[:, joint]) > 0.25 * min(upper - lower, 1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_limits_hold_with_the_largest_payload(kind):
    arm = load_arm("ur10e")
    dynamics = virtual_arm(arm, 0, Payload(12.5, np.array([0.0, 0.0, 0.1])))
    loaded = with_inertials(arm, dynamics.loaded())
    for seed in range(3):
        made = KINDS[kind](loaded, 10.0, 100.0, np.random.default_rng(seed))
        require(loaded, comfortable(arm), made)


@pytest.mark.parametrize("kind", KINDS)
def test_a_payload_that_no_arm_holds_is_refused(kind):
    arm = load_arm("ur3e")
    brick = virtual_arm(arm, 0, Payload(80.0, np.array([0.0, 0.0, 0.2])))
    with pytest.raises(InputError, match="payload"):
        KINDS[kind](with_inertials(arm, brick.loaded()), 5.0, 100.0, np.random.default_rng(0))


@pytest.mark.parametrize("kind", KINDS)
def test_a_trajectory_starts_and_ends_at_rest(kind):
    made = make(kind, "ur5e")
    # Sums of a dozen terms of at most amplitude x frequency², each rounded.
    assert np.abs(made.v[[0, -1]]).max() < 1e-12
    assert np.abs(made.a[[0, -1]]).max() < 1e-11


@pytest.mark.parametrize("kind", KINDS)
def test_velocity_and_acceleration_are_derivatives(kind):
    made = make(kind, "ur10e", rate=500.0)
    h = made.step
    # The rule of the trapezoid errs by h³/12 |f''|, and by h²/4 |f'| where f has corners, as the
    # acceleration of a move has. Differences miss a few per cent of the jerk's peak.
    jerk = 1.05 * np.abs(np.diff(made.a, axis=0)).max() / h
    for whole, part, error in (
        (made.q, made.v, h**3 / 12.0 * jerk),
        (made.v, made.a, h**2 / 4.0 * jerk),
    ):
        step = 0.5 * h * (part[1:] + part[:-1])
        assert np.abs(np.diff(whole, axis=0) - step).max() <= error


def test_between_rows_a_trajectory_is_exact_to_the_sixth_order():
    errors = []
    for rate in (20.0, 40.0, 80.0):
        rng, fine = np.random.default_rng(3), 160.0
        # One row more at each rate, so that all three end, and repeat, at the same time.
        coarse = fourier(load_arm("ur5"), 10.0 + 1.0 / rate, rate, rng)
        exact = fourier(load_arm("ur5"), 10.0 + 1.0 / fine, fine, np.random.default_rng(3))
        errors.append(np.abs(coarse.at(exact.t).q - exact.q).max())
    for coarse_error, fine_error in pairwise(errors):
        assert coarse_error / fine_error > 2.0**5.5  # 2⁶ in the limit of small steps


def test_at_its_rows_a_trajectory_is_its_rows():
    made = make("fourier", "ur5e")
    motion = made.at(made.t)
    for name in ("q", "v", "a"):
        np.testing.assert_allclose(getattr(motion, name), getattr(made, name), rtol=0, atol=1e-9)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_outside_a_trajectory_the_arm_stands_still(share):
    """One that breaks off while the arm moves, too."""
    whole = make("fourier", "ur5e")
    rows = slice(0, int(share * len(whole)))
    made = Trajectory(*(x[rows] for x in (whole.t, whole.q, whole.v, whole.a)))
    motion = made.at(np.array([-1.0, made.t[-1] + 1.0]))
    np.testing.assert_allclose(motion.q, made.q[[0, -1]], rtol=0, atol=1e-12)
    assert not (motion.v.any() or motion.a.any() or motion.jerk.any())


@pytest.mark.parametrize(
    ("t", "said"),
    [
        ([0.0, 0.01, 0.02, 0.05], r"a row every 0\.0166667 s; that of row 1 is 0\.01 s"),
        ([0.0, 0.01, np.nan, 0.03], r"t\[2\] is nan"),
        ([0.0, -0.01, -0.02, -0.03], "from time 0 on"),
    ],
)
def test_a_grid_that_is_not_uniform_makes_no_trajectory(t, said):
    still = np.zeros((4, 6))
    with pytest.raises(InputError, match=said):
        Trajectory(np.array(t), still, still, still)


def test_stamps_are_uniform_but_for_their_digits():
    t, still = np.round(np.arange(1000) / 300.0, 6), np.zeros((1000, 6))
    assert len(Trajectory(t, still, still, still)) == 1000


def test_an_arm_is_asked_for_a_motion_of_its_own_joints(ur5e):
    t, still = np.arange(3.0), np.zeros((3, 5))
    with pytest.raises(InputError, match="one of 5 joints; ur5e has 6"):
        simulate(ur5e, 1.0, 1.0, 0, trajectory=Trajectory(t, still, still, still), heat=True)


def test_a_long_fourier_run_repeats_itself_across_blocks():
    made = make("fourier", "ur3", duration=160.0, rate=500.0)
    assert len(made) == 80_000 > 4 * BLOCK
    later = made.at(made.t[:BLOCK] + made.t[-1] / 8)
    np.testing.assert_allclose(later.q, made.q[:BLOCK], rtol=0, atol=1e-9)


def test_a_dwell_is_a_rest():
    made = point_to_point(load_arm("ur5e"), 60.0, 100.0, np.random.default_rng(1), dwell=1.0)
    still = np.abs(made.v).max(axis=1) == 0.0
    begins = np.flatnonzero(still[1:] & ~still[:-1])
    assert len(begins) > 5
    assert all(still[row + 1 : row + 99].all() for row in begins)


@pytest.mark.parametrize("kind", KINDS)
def test_the_seed_decides(kind):
    same, again, other = (make(kind, "ur5e", seed) for seed in (7, 7, 8))
    assert same.q.tobytes() == again.q.tobytes() != other.q.tobytes()


@pytest.mark.parametrize(
    ("duration", "rate", "said"),
    [
        (0.01, 100.0, "two rows"),
        (0.0, 500.0, r"duration 0\.0: takes a time above 0"),
        (1.0, -1.0, r"rate -1\.0: takes a rate above 0"),
        (np.nan, 1, "duration nan"),
        ("a", 1, "duration a"),
    ],
)
def test_a_run_without_rows_is_refused(duration, rate, said):
    with pytest.raises(InputError, match=said):
        fourier(load_arm("ur5e"), duration, rate, np.random.default_rng(0))


def test_a_broken_limit_is_named():
    arm, t = load_arm("ur5e"), np.linspace(0.0, 1.0, 101)
    q = np.zeros((101, 6))
    q[50, 2] = 4.0
    with pytest.raises(InputError, match=r"elbow_joint at 127 % of its angle limit at 0\.500 s"):
        require(arm, rated(arm), Trajectory(t, q, 0 * q, 0 * q))
