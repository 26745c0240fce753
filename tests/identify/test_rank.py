"""What a fixed base shows at all, and what is said of data that show less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.errors import IdentifiabilityError
from urdyn.identify import Noise, base_parameters, identify
from urdyn.identify.compress import compress
from urdyn.identify.rank import data_rank
from urdyn.model.arm import Arm, load_arm
from urdyn.model.consistency import inertials, log_cholesky
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import population
from urdyn.simulate import fourier
from urdyn.types import Motion, Source

ONE = np.ones(6)
UNIT = Noise(ONE, ONE, 100.0 * ONE, np.zeros((6, 0)))


def excited(arm: Arm, still: tuple[int, ...] = ()) -> tuple[Dynamics, Motion]:
    """The typical arm on an excitation trajectory in which the joints `still` stand."""
    point = population(arm).typical()
    trajectory = fourier(arm, 20.0, 100.0, np.random.default_rng(1))
    moves = np.isin(np.arange(6), still, invert=True)
    going = trajectory.at(trajectory.t)
    parts = {name: getattr(going, name) * moves for name in ("v", "a", "jerk")}
    going = replace(going, q=np.where(moves, going.q, going.q[0]), **parts)
    return point, replace(going, current=point.current(going))


@pytest.mark.parametrize("robot", ["ur3e", "ur5e", "ur10e"])
def test_an_excited_arm_shows_58_of_84(robot: str) -> None:
    point, motion = excited(load_arm(robot))
    assert data_rank(compress(point, motion, UNIT), 6) == (58, 84)


def test_the_rank_does_not_depend_on_the_scale_of_the_noise(ur10e: Arm) -> None:
    point, motion = excited(ur10e)
    quiet = replace(UNIT, scale=1e-3 * ONE)
    assert data_rank(compress(point, motion, quiet), 6) == (58, 84)


def test_a_wrist_that_stands_still_shows_nothing_of_its_friction(ur10e: Arm) -> None:
    point, motion = excited(ur10e, still=(5,))
    rank, columns = data_rank(compress(point, motion, UNIT), 6)
    assert rank < 58 and columns == 84


@pytest.mark.parametrize("robot", ["ur5e", "ur20"])
def test_36_base_parameters_stand_for_60_inertials(robot: str) -> None:
    arm, rng = load_arm(robot), np.random.default_rng(2)
    independent, matrix = base_parameters(arm, rng)
    assert len(independent) == 36 and matrix.shape == (36, 60)
    np.testing.assert_allclose(matrix[:, independent], np.eye(36), rtol=0, atol=1e-9)
    x = log_cholesky(arm.inertials)
    pi = inertials(x + 0.1 * rng.standard_normal(x.shape))
    q, v, a = rng.uniform(-2.0, 2.0, (3, 100, 6))  # motions that it was not made from
    tau = arm.torque(q, v, a, pi)
    base = arm.regressor(q, v, a)[..., independent] @ (matrix @ pi.ravel())
    np.testing.assert_allclose(base, tau, rtol=0, atol=1e-9 * np.abs(tau).max())


def standing(rows: int, joints: int = 6, rng: np.random.Generator | None = None) -> Motion:
    """An arm that stands, with noise on its current."""
    zero = np.zeros((rows, joints))
    current = (rng or np.random.default_rng(0)).standard_normal(zero.shape)
    t, nowhere = np.arange(rows) / 100.0, Source("monday.csv")
    return Motion(t, zero + 0.5, zero, zero, zero, current, zero, source=nowhere)


def test_an_arm_that_stands_is_not_identified(ur10e: Arm) -> None:
    with pytest.raises(IdentifiabilityError, match="record an excitation trajectory"):
        identify(ur10e, standing(2000))


def test_another_robots_log_is_told_by_both_numbers_of_joints(ur10e: Arm) -> None:
    with pytest.raises(IdentifiabilityError, match=r"monday.csv: .* 7 joints, ur10e has 6"):
        identify(ur10e, standing(2000, joints=7))


def test_too_short_a_log_is_told_with_what_would_do(ur10e: Arm) -> None:
    with pytest.raises(IdentifiabilityError, match=r"50 rows .* record at least 200"):
        identify(ur10e, standing(50))
