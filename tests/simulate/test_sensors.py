"""Laws and statistics of what the virtual arm reports."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.model.arm import load_arm
from urdyn.simulate import (
    Payload,
    fourier,
    observe,
    perfect_sensors,
    point_to_point,
    typical_sensors,
    virtual_arm,
)
from urdyn.simulate.trajectory import BLOCK

RATE = 500.0
UR10E_NOISE = [0.23, 0.25, 0.14, 0.036, 0.052, 0.036]  # [A], left on recordings by any model


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur10e")


@pytest.fixture(scope="module")
def dynamics(arm):
    return virtual_arm(arm, 11, Payload(3.0, np.array([0.01, -0.02, 0.06])))


@pytest.fixture(scope="module")
def made(arm):
    return fourier(arm, 40.0, RATE, np.random.default_rng(0))


def rng():
    return np.random.default_rng(5)


def rounding(dynamics, made):
    """Of current, (J,) [A]: friction tells every way between reversals from the whole way."""
    drive, way = dynamics.drive, np.abs(made.v).sum(axis=0) * made.step
    ways = way / drive.presliding_distance
    return 10.0 * np.finfo(float).eps * ways * drive.coulomb / drive.gain


def test_perfect_sensors_report_the_equation(arm, dynamics, made):
    log = observe(dynamics, made, perfect_sensors(arm), rng())
    assert len(log) > BLOCK  # friction's memory passes from block to block
    error = np.abs(log.channels["actual_current"] - dynamics.current(made.at(log.t)))
    assert (error.max(axis=0) < 1e-12 + rounding(dynamics, made)).all()
    np.testing.assert_array_equal(log.channels["actual_q"], log.channels["target_q"])
    np.testing.assert_array_equal(log.channels["actual_qd"], log.channels["target_qd"])


def test_current_leads_the_motion_by_the_time_offset(arm, dynamics, made):
    rows = 3  # a whole number of rows, so that the shifted current is among the unshifted
    early = replace(dynamics, drive=replace(dynamics.drive, time_offset=rows / RATE))
    now, ahead = (
        observe(d, made, perfect_sensors(arm), rng()).channels["actual_current"]
        for d in (dynamics, early)
    )
    # Presliding begins three rows later: what it has forgotten by then is forgotten.
    np.testing.assert_allclose(ahead[500:-rows], now[500 + rows :], rtol=0, atol=1e-8)


def test_work_of_the_drives_is_energy_stored_and_friction_lost(arm, dynamics, made):
    log = observe(dynamics, made, perfect_sensors(arm), rng())
    motion, drive = made.at(log.t), dynamics.drive
    tau = drive.gain * drive.health * log.channels["actual_current"]
    s, load = dynamics.presliding(motion), dynamics.load(motion)
    sliding = (drive.coulomb + drive.structural * np.abs(load)) * s
    lost = sliding + drive.viscous * motion.v + drive.offset
    power = ((tau - lost) * motion.v).sum(axis=1)
    stop = 1 + int(np.argmax(np.abs(motion.v).sum(axis=1)))  # in full motion: both energies count
    work = np.trapezoid(power[:stop], log.t[:stop])
    # The trapezoid errs by h³/12 |P''| in every step: a twelfth of the second differences.
    error = np.abs(np.diff(power[: stop + 1], 2)).sum() / RATE / 12.0
    stored = energy(dynamics, motion, stop - 1) - energy(dynamics, motion, 0)
    assert abs(stored) > 1e4 * error
    assert work == pytest.approx(stored, abs=1.5 * error + 1e-9)


def energy(dynamics, motion, row) -> float:
    """Kinetic and potential energy by links, which owes nothing to the equation of motion [J]."""
    arm, q, v = dynamics.arm, motion.q[row], motion.v[row]
    total = 0.5 * float(dynamics.drive.rotor_inertia @ v**2)
    for name, body in zip(arm.link_names, dynamics.loaded(), strict=True):
        place, jacobian = arm.pose(q, name), arm.jacobian(q, name)
        turn, h = place[:3, :3], place[:3, :3] @ body[1:4]
        linear, angular = jacobian[:3] @ v, jacobian[3:] @ v
        xx, xy, yy, xz, yz, zz = body[4:]
        inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
        total += 0.5 * body[0] * linear @ linear + linear @ np.cross(angular, h)
        total += 0.5 * angular @ inertia @ angular
        total += 9.81 * (body[0] * place[2, 3] + h[2])
    return float(total)


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_current_noise_has_the_spread_and_the_colour_asked_for(arm, dynamics, made, colour):
    sensors = replace(typical_sensors(arm), colour=colour)
    log = observe(dynamics, made, sensors, rng())
    noise = log.channels["actual_current"] - dynamics.current(made.at(log.t))
    n, score = len(log), noise / sensors.current_noise
    # Bartlett: variance of the sample variance and of the first autocorrelation; five sigma.
    spread = np.sqrt(2.0 / n * (1 + colour**2) / (1 - colour**2))
    np.testing.assert_allclose((score**2).mean(axis=0), 1.0, rtol=0, atol=5 * spread)
    lag = (score[1:] * score[:-1]).mean(axis=0) / (score**2).mean(axis=0)
    bias = 2.0 / n
    tolerance = 5 * np.sqrt((1 - colour**2) / n) + bias
    np.testing.assert_allclose(lag, colour, rtol=0, atol=tolerance)


def test_typical_noise_of_a_ur10e_is_that_of_its_recordings(arm):
    np.testing.assert_allclose(typical_sensors(arm).current_noise, UR10E_NOISE, rtol=0.05)


def test_encoder_and_tachometer_err_as_asked(arm, dynamics, made):
    sensors = typical_sensors(arm)
    log = observe(dynamics, made, sensors, rng())
    steps = log.channels["actual_q"] / sensors.encoder_step
    np.testing.assert_allclose(steps, np.round(steps), rtol=0, atol=1e-6)
    off = log.channels["actual_q"] - log.channels["target_q"]
    assert np.abs(off).max() <= 0.5 * sensors.encoder_step * (1 + 1e-6)
    noise = (log.channels["actual_qd"] - log.channels["target_qd"]) / sensors.velocity_noise
    assert (noise**2).mean() == pytest.approx(1.0, abs=5 * np.sqrt(2 / noise.size))


def test_a_joint_that_stands_reports_no_velocity(arm, dynamics):
    moves = point_to_point(arm, 20.0, 100.0, rng())
    log = observe(dynamics, moves, typical_sensors(arm), rng())
    assert not log.channels["actual_qd"][moves.v == 0.0].any()


def test_the_target_moment_has_no_friction_and_the_target_current_has(arm, made):
    log = observe(virtual_arm(arm, 1), made, perfect_sensors(arm), rng())
    wanted = arm.torque(made.q, made.v, made.a)
    np.testing.assert_allclose(log.channels["target_moment"], wanted, rtol=0, atol=1e-6)
    wrist = np.abs(log.channels["target_current"][:, 5]).mean()
    assert wrist > 0.2 > np.abs(log.channels["target_moment"][:, 5]).mean() / 10.0


def test_the_tool_pose_is_seen_from_the_controllers_base(arm, dynamics, made):
    log = observe(dynamics, made, perfect_sensors(arm), rng())
    in_root = arm.pose(made.q)[:, :3, 3]
    in_base = log.channels["actual_TCP_pose"][:, :3]
    np.testing.assert_allclose(in_base, in_root * [-1, -1, 1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("rate", [60.0, 125.0, 200.0, 500.0])
def test_stamps_are_whole_controller_cycles(arm, dynamics, rate):
    made = fourier(arm, 2.0, rate, rng())
    log = observe(dynamics, made, perfect_sensors(arm), rng())
    cycles = log.t / 0.002
    np.testing.assert_allclose(cycles, np.round(cycles), rtol=0, atol=1e-9)
    assert np.all(np.diff(log.t) > 0) and np.abs(log.t - made.t).max() <= 0.001 + 1e-12
    error = np.abs(log.channels["actual_current"] - dynamics.current(made.at(log.t)))
    assert (error.max(axis=0) < 1e-12 + rounding(dynamics, made)).all()


def test_more_rows_than_controller_cycles_are_refused(arm, dynamics):
    with pytest.raises(InputError, match="500 Hz"):
        observe(dynamics, fourier(arm, 1.0, 1000.0, rng()), perfect_sensors(arm), rng())
