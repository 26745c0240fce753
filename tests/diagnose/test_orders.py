"""Lines that follow a motor's angle are its gear's; those that keep to time are loops that ring."""

from __future__ import annotations

import numpy as np
import pytest
from realarm import Recorded
from shop import Shop

from urdyn.diagnose.fast.orders import GEAR, MOTOR, beside
from urdyn.diagnose.fast.ringing_line import APART
from urdyn.diagnose.fast.swings import amplitude, refined
from urdyn.model.friction import GEAR_RATIO
from urdyn.simulate import Trajectory, observe, typical_sensors

T = np.arange(450) / 500.0  # [s]
ANGLE = 0.4 * T + 0.05 * T**2  # [rad], at a speed that varies by a fifth
SPEED = np.column_stack([np.zeros_like(T), 0.4 + 0.1 * T, np.zeros_like(T)])


def _left(x: np.ndarray, v: np.ndarray, joint: int, about: float) -> float:
    """What is left of the line about this frequency beside what follows a motor [-]."""
    frequency = refined(x, T, about, 1.0 / T[-1])
    return beside(x, T, frequency, v, joint) / amplitude(x, T, frequency)


@pytest.mark.parametrize("order", GEAR)
@pytest.mark.parametrize("joint", [1, 2])
def test_what_a_gear_makes_follows_its_motor_in_its_joint_and_in_those_beside_it(
    order: float, joint: int
) -> None:
    x = np.cos(order * GEAR_RATIO * ANGLE + 0.7)
    about = order * GEAR_RATIO * 0.45 / (2.0 * np.pi)
    assert _left(x, SPEED, joint, about) < 0.02


def test_what_a_gear_makes_beyond_half_the_rate_is_heard_folded_back() -> None:
    """A sound pan at 1 rad/s was said to ring at 14 Hz in a log of 50 samples a second."""
    t = np.arange(45) / 50.0
    angle, v = t + 0.03 * t**2, (1.0 + 0.06 * t)[:, None]
    x = np.cos(2.0 * GEAR_RATIO * angle + 0.7)
    frequency = refined(x, t, 50.0 - 2.0 * GEAR_RATIO * v.mean() / (2.0 * np.pi), 1.0 / t[-1])
    assert 16.0 < frequency < 18.0
    assert beside(x, t, frequency, v, 0) < 0.02 * amplitude(x, t, frequency)


@pytest.mark.parametrize("order", MOTOR)
def test_what_a_motor_makes_of_its_own_torque_is_felt_in_its_joint(order: float) -> None:
    slowly = 0.2  # [-] of that speed
    x = np.cos(order * GEAR_RATIO * slowly * ANGLE + 0.7)
    about = order * GEAR_RATIO * slowly * 0.45 / (2.0 * np.pi)
    assert _left(x, slowly * SPEED, 1, about) < 0.02
    assert _left(x, slowly * SPEED, 2, about) > 0.9


@pytest.mark.parametrize("frequency", [6.0, 14.5, 27.0])
@pytest.mark.parametrize("joint", [1, 2])
def test_what_keeps_to_time_is_left_beside_a_motor_whose_speed_varies(
    frequency: float, joint: int
) -> None:
    """14.5 Hz is in the midst of what the gear makes while its joint speeds up."""
    x = np.cos(2.0 * np.pi * frequency * T)
    noise = np.random.default_rng(3).standard_normal(len(T))
    varies = SPEED + np.outer(0.3 * (T - T.mean()), [0.0, 1.0, 0.0])
    assert _left(x + 0.5 * noise, varies, joint, frequency) > 1.3 * APART


def test_a_joint_that_swings_with_its_loop_turns_no_gear() -> None:
    """A motor's angle swings there, and what follows that is the loop itself."""
    swing = np.sin(2.0 * np.pi * 9.0 * T)
    assert _left(np.cos(2.0 * np.pi * 9.0 * T), 0.1 * swing[:, None], 0, 9.0) > 0.95
    assert _left(swing, 0.1 * swing[:, None], 0, 9.0) > 0.95


def test_gear_ripple_of_a_neighbour_is_no_loop_that_rings_and_a_steady_line_there_is(
    shop: Shop,
) -> None:
    """Of a lift that turns a little faster and slower, felt in the elbow as it sets in."""
    rate = 125.0
    t = np.arange(round(7.0 * rate)) / rate
    rest, of = np.array([0.2, -2.4, 1.2, -0.8, 0.5, 0.1]), np.eye(6)[1]
    w = 2.0 * np.pi * 0.25
    turned = 0.4 * t - 0.045 / w * (np.cos(w * t) - 1.0)
    v, a = 0.4 + 0.045 * np.sin(w * t), 0.045 * w * np.cos(w * t)
    go = Trajectory(t, rest + np.outer(turned, of), np.outer(v, of), np.outer(a, of))
    log = observe(shop.dynamics, go, typical_sensors(shop.dynamics.arm), np.random.default_rng(4))
    since = log.t - log.t[0]

    def told(phase: np.ndarray) -> list[tuple[str, int | None]]:
        swing = np.where(since > 3.0, 2.0 * np.sin(phase), 0.0)
        return [(f.kind, f.joint) for f in shop.disturbed(log, 2, swing)]

    assert told(2.0 * GEAR_RATIO * turned) == []
    assert told(2.0 * GEAR_RATIO * 0.4 * since) == [("controller_instability", 2)]


def test_a_real_elbow_feels_the_gear_of_its_lift(recorded: Recorded) -> None:
    """Twice a turn of its motor, 26.7 Hz for half a second, while its speed varies by a quarter."""
    log = recorded("ur-20_02_10-20sec_7harm")
    part = (log.t > 1314.4) & (log.t < 1315.4)
    t, v = log.t[part], log.joint("actual_qd")[part]
    current = log.joint("actual_current")[part, 2]
    frequency = refined(current, t, 26.7, 1.0)
    line = amplitude(current, t, frequency)
    assert line > 0.08  # [A]
    assert beside(current, t, frequency, v, 2) < APART * line
    assert beside(current, t, frequency, np.delete(v, 1, axis=1), 1) > 1.3 * APART * line
