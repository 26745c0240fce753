"""The one equation, put together by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import bristles
from urdyn.model.population import OPTIONAL
from urdyn.simulate import Payload, fourier, virtual_arm
from urdyn.types import Array, Motion

BALL = Payload(1.5, np.array([0.01, -0.02, 0.06])).inertials()


@pytest.fixture(scope="module")
def dynamics(ur5e: Arm) -> Dynamics:
    """An arm with every term there is, half worn, whose current leads its motion."""
    drawn = virtual_arm(ur5e, 5, terms=OPTIONAL)
    worn = replace(drawn.drive, health=np.linspace(0.5, 1.0, 6), time_offset=0.006)
    worn = replace(worn, friction_lead=0.004)
    return replace(drawn, drive=worn, payload=BALL)


@pytest.fixture(scope="module")
def motion(ur5e: Arm) -> Motion:
    """Ten seconds of warm-up at 100 Hz."""
    trajectory = fourier(ur5e, 10.0, 100.0, np.random.default_rng(2))
    going = trajectory.at(trajectory.t)
    return replace(going, temperature=np.linspace(30.0, 40.0, 6 * len(going)).reshape(-1, 6))


def assembled(dynamics: Dynamics, motion: Motion) -> Array:
    """i = (Y pi + I_r a + (f + g exp(-|v|/v_s) + beta |Y pi|) s + ... ) / (K z), joint by joint."""
    d, m = dynamics.drive, motion.ahead(dynamics.drive.time_offset)
    bodies = np.vstack([dynamics.inertials[:-1], dynamics.inertials[-1] + dynamics.payload])
    load = dynamics.arm.regressor(m.q, m.v, m.a) @ bodies.ravel()
    stiff, soft = bristles(m, d.presliding_distance, lead=d.friction_lead).state
    s = (1.0 - d.presliding_tail) * stiff + d.presliding_tail * soft
    grip = d.coulomb + d.stribeck * np.exp(-np.abs(m.v) / d.stribeck_velocity)
    friction = (grip + d.structural * np.abs(load)) * s + d.viscous * m.v + d.offset
    friction += d.thermal * (m.temperature - d.temperature) * m.v
    turns = 2.0 * 101.0 * m.q
    ripple = d.ripple_cos * np.cos(turns) + d.ripple_sin * np.sin(turns)
    return (load + d.rotor_inertia * m.a + friction + ripple) / (d.gain * d.health)


def test_current_is_the_equation(dynamics: Dynamics, motion: Motion) -> None:
    current = dynamics.current(motion)
    scale = np.abs(current).max()
    np.testing.assert_allclose(current, assembled(dynamics, motion), rtol=0, atol=1e-12 * scale)


def test_a_payload_is_more_of_the_last_link(dynamics: Dynamics, motion: Motion) -> None:
    heavier = replace(dynamics, inertials=dynamics.loaded(), payload=np.zeros(10))
    np.testing.assert_array_equal(heavier.current(motion), dynamics.current(motion))
    np.testing.assert_array_equal(dynamics.loaded()[:-1], dynamics.inertials[:-1])


def test_a_drive_of_half_the_health_takes_twice_the_current(
    dynamics: Dynamics, motion: Motion
) -> None:
    half = replace(dynamics.drive, health=dynamics.drive.health / 2.0)
    np.testing.assert_allclose(
        replace(dynamics, drive=half).current(motion), 2.0 * dynamics.current(motion), rtol=1e-14
    )


def test_whoever_has_followed_the_presliding_state_may_say_so(
    dynamics: Dynamics, motion: Motion
) -> None:
    s = dynamics.presliding(motion)
    np.testing.assert_array_equal(dynamics.torque(motion, s), dynamics.torque(motion))


@pytest.mark.parametrize("offset", [-0.02, 0.0, 0.007])
def test_looking_ahead_is_exact_on_cubic_motion(offset: float) -> None:
    c = np.random.default_rng(1).standard_normal((4, 6))
    t = np.linspace(0.0, 2.0, 50)

    def cubic(t: Array) -> Motion:
        x = t[:, None]
        q, v = c[0] + x * (c[1] + x * (c[2] + x * c[3])), c[1] + x * (2 * c[2] + 3 * x * c[3])
        a, jerk = 2 * c[2] + 6 * x * c[3], np.broadcast_to(6 * c[3], q.shape)
        return Motion(t, q, v, a, jerk, np.full_like(q, np.nan), np.full_like(q, np.nan))

    ahead, there = cubic(t).ahead(offset), cubic(t + offset)
    for name in ("q", "v", "a"):
        np.testing.assert_allclose(getattr(ahead, name), getattr(there, name), atol=1e-13 * 50)
    np.testing.assert_array_equal(ahead.t, t)
