"""Laws of the whole house."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import urdyn as ud
from urdyn.identify import Fit
from urdyn.identify.compress import compress
from urdyn.identify.design import coefficients_at
from urdyn.identify.noise import Noise
from urdyn.model.arm import Arm
from urdyn.model.consistency import is_consistent
from urdyn.model.dynamics import Dynamics
from urdyn.simulate import Trajectory, fourier, observe, perfect_sensors, virtual_arm


@pytest.fixture(scope="module")
def dynamics(ur5e: Arm) -> Dynamics:
    return virtual_arm(ur5e, 2)


@pytest.fixture(scope="module")
def trajectory(ur5e: Arm) -> Trajectory:
    return fourier(ur5e, 10.0, 500.0, np.random.default_rng(0))


def test_power_that_the_bodies_take_becomes_their_energy(
    dynamics: Dynamics, trajectory: Trajectory
) -> None:
    """v · tau is the rate of kinetic and potential energy: over a run from rest to rest, no work.

    The run ends where it began, in angle and at rest, so both energies are what they were.
    """
    motion = trajectory.at(np.linspace(0.0, trajectory.t[-1], 20_001))
    power = np.sum(motion.v * dynamics.load(motion), axis=1)
    h = motion.t[1]
    work = h * (np.sum(power) - 0.5 * (power[0] + power[-1]))
    # On a whole period of a smooth periodic function the trapezoidal rule has no error but rounding
    # and that of the quintic between rows.
    assert abs(work) < 1e-6 * h * np.sum(np.abs(power))


def test_friction_takes_power_whatever_the_motion(
    dynamics: Dynamics, trajectory: Trajectory
) -> None:
    """Joint by joint, over the run; offset and rotor inertia store work and lose none."""
    drive = replace(dynamics.drive, offset=np.zeros(6), rotor_inertia=np.zeros(6))
    lossy, motion = replace(dynamics, drive=drive), trajectory.at(trajectory.t)
    losses = lossy.torque(motion) - lossy.load(motion)
    assert (np.sum(losses * motion.v, axis=0) > 0.0).all()


def test_current_is_linear_in_what_is_identified(
    dynamics: Dynamics, trajectory: Trajectory
) -> None:
    """tau = Y theta: the triangle of a log without noise is solved by the truth."""
    motion = trajectory.at(trajectory.t)
    motion = replace(motion, current=dynamics.current(motion))
    unit = Noise(*np.ones((2, 6)), np.full(6, 1e9), np.zeros((6, 0)))
    for block, w in zip(compress(dynamics, motion, unit), coefficients_at(dynamics), strict=True):
        left = np.linalg.norm(block.R[:, :-1] @ w - block.R[:, -1])
        assert left < 1e-11 * np.linalg.norm(block.R[:, -1])


def test_a_log_in_two_halves_tells_what_the_whole_does(
    dynamics: Dynamics, trajectory: Trajectory
) -> None:
    """Information adds, but for the rows in which a half does not know its presliding yet."""
    motion = trajectory.at(trajectory.t)
    current = dynamics.current(motion)
    unit = Noise(*np.ones((2, 6)), np.full(6, 1e9), np.zeros((6, 0)))
    half = len(motion) // 2
    broken = replace(motion, current=current, breaks=(half,))
    parts = [replace(motion, current=current).slice(*rows) for rows in ((0, half), (half, None))]
    one, two = (compress(dynamics, part, unit) for part in parts)
    for whole, a, b in zip(compress(dynamics, broken, unit), one, two, strict=True):
        gram, sum_of_two = whole.R.T @ whole.R, a.R.T @ a.R + b.R.T @ b.R
        size = np.sqrt(np.diag(gram))
        rounding = len(motion) * np.finfo(float).eps
        difference = (gram - sum_of_two) / np.outer(*[np.where(size, size, 1.0)] * 2)
        assert np.abs(difference).max() < 10.0 * rounding


def test_the_truth_is_what_conditioned_perfect_sensors_show(
    dynamics: Dynamics, trajectory: Trajectory
) -> None:
    sensors = perfect_sensors(dynamics.arm)
    log = observe(dynamics, trajectory, sensors, np.random.default_rng(0))
    motion = ud.condition(log)
    error = motion.current - dynamics.current(motion)
    # Polynomials through 500 Hz of 2 rad/s motion; presliding, within 0.1 mrad, is the hardest.
    assert np.linalg.norm(error) < 1e-3 * np.linalg.norm(motion.current)


def test_every_identified_body_is_possible(identified: Fit) -> None:
    bodies = np.array([*identified.dynamics.inertials, *identified.payloads])
    assert is_consistent(bodies).all()


def test_data_never_make_anything_less_certain(identified: Fit) -> None:
    """In the coordinates of the belief the posterior is narrower than the prior: I + J'J > I."""
    sd = identified.belief.sd
    names = identified.names
    for joint in identified.dynamics.arm.joint_names:
        for field in ("coulomb", "viscous"):  # their logarithms had a prior sd of 0.5
            assert sd[names.index(f"{joint}.{field}")] <= 0.5


@pytest.mark.parametrize("name", ud.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(ud, name) is not None and name in dir(ud)
