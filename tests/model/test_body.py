"""One body, told about its frame and about its centre of mass."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.model.body import BODY, BODY_UNITS, ORDER, about_com, about_frame, steiner, tensor


@pytest.mark.parametrize("robot", ["ur3e", "ur10", "ur30"])
def test_about_the_frame_undoes_about_the_centre(robot: str) -> None:
    for body in load_arm(robot).inertials:
        mass, com, inertia = about_com(body)
        back = about_frame(mass, com, tensor(inertia))
        # Steiner's part is taken off and put on again: rounding is of its size.
        np.testing.assert_allclose(back, body, rtol=0, atol=1e-15 * (1.0 + np.abs(body).max()))


def test_the_shift_is_the_inertia_of_a_point() -> None:
    mass, com = 2.0, np.array([0.1, -0.2, 0.3])
    x, y, z = com
    moments = mass * np.array([y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])
    np.testing.assert_allclose(steiner(mass, com)[ORDER], moments, rtol=0, atol=1e-16)


def test_six_numbers_are_a_symmetric_tensor() -> None:
    Ixx, Ixy, Iyy, Ixz, Iyz, Izz = six = np.arange(1.0, 7.0)
    np.testing.assert_array_equal(tensor(six), [[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]])
    np.testing.assert_array_equal(tensor(six)[ORDER], six)


def test_every_number_of_a_body_has_a_name_and_a_unit() -> None:
    assert len(BODY) == len(BODY_UNITS) == 10
    assert BODY[4:] == ("Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
