"""An instrument that follows programs, and not vibrations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.identify.compress import unexplained
from urdyn.identify.design import blocks
from urdyn.identify.instrument import REACH, steadied
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array, Motion


def swinging(frequency: float, rate: float) -> Motion:
    """Six seconds of a joint that swings by 1 rad."""
    t = np.arange(0.0, 6.0, 1.0 / rate)
    w = 2.0 * np.pi * frequency
    q = np.sin(w * t)[:, None]
    v, none = w * np.cos(w * t)[:, None], np.full_like(q, np.nan)
    return Motion(t, q, v, -(w**2) * q, -(w**2) * v, 0.0 * q, none)


def followed(motion: Motion) -> float:
    """Share of the acceleration in the instrument, away from the ends."""
    inner = (motion.t > 2.0 * REACH) & (motion.t < motion.t[-1] - 2.0 * REACH)
    told, true = steadied(motion).instrument[inner, 0], motion.a[inner, 0]
    return float(told @ true / (true @ true))


@pytest.mark.parametrize("rate", [20.0, 100.0, 500.0])
def test_programs_are_followed_and_vibrations_are_not(rate: float) -> None:
    assert followed(swinging(1.0, rate)) == pytest.approx(1.0, abs=0.01)
    assert followed(swinging(2.0, rate)) > 0.94
    for frequency in (6.0, 8.0):
        assert abs(followed(swinging(frequency, rate))) < 0.06


def test_a_zero_that_jumps_is_no_acceleration() -> None:
    motion = swinging(1.0, 100.0)
    shift = np.zeros_like(motion.q)
    shift[250] = 0.5
    jumped = replace(motion, q=motion.q + np.cumsum(shift, axis=0), shift=shift)
    assert np.allclose(steadied(jumped).instrument, steadied(motion).instrument, atol=1e-6)


def rotors(point: Dynamics, motion: Motion) -> Array:
    """By how much least squares on the rotors alone would change them, (J,) [kg m²]."""
    (block,) = blocks(point, motion)
    z, e = block.instrumental.motion.a, unexplained(point, block) * point.drive.gain
    return np.array([z[k, j] @ e[k, j] / (z[k, j] @ z[k, j]) for j, k in enumerate(block.known.T)])


def test_an_arm_that_shakes_does_not_pass_for_heavier_rotors(
    point: Dynamics, motion: Motion
) -> None:
    """At 9 Hz, where an elastic gear lets its rotor move three times as much as its joint."""
    drive, shaking = point.drive, 2.0 * np.sin(2.0 * np.pi * 9.0 * motion.t)[:, None] * np.ones(6)
    shaken = replace(motion, a=motion.a + shaking)
    elastic = 2.0 * drive.rotor_inertia * shaking / drive.gain
    shaken = replace(shaken, current=point.current(shaken) + elastic)
    rigid, steady = (rotors(point, m) / drive.rotor_inertia for m in (shaken, steadied(shaken)))
    assert rigid.min() > 0.2 and np.abs(steady).max() < 0.1 * rigid.min()
