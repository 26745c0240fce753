"""Friction as a fit states it: the sum of terms that trade off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.identify import Fit
from urdyn.types import Array, Gaussian

PAN, F, G = "shoulder_pan_joint", 30.0, -16.0  # [N·m], as a real UR10e's: it builds up with speed
FIELDS = ("coulomb", "viscous", "stribeck", "stribeck_velocity")


@pytest.fixture(scope="module")
def building(identified: Fit) -> Fit:
    """A fit whose shoulder pan has friction that builds up, by a term that its motion hardly told.

    f and g are known to 4 N·m each, their sum to 0.4.
    """
    drive = identified.dynamics.drive
    f, g, v_s = (
        np.where(np.arange(6) == 0, of, other)
        for of, other in (
            (F, drive.coulomb), (G, drive.stribeck), (0.6, drive.stribeck_velocity),
        )
    )  # fmt: skip
    names = (*identified.names, f"{PAN}.stribeck", f"{PAN}.stribeck_velocity")
    P = len(names)
    cov = np.zeros((P, P))
    cov[:-2, :-2] = identified.belief.cov
    f_at, g_at = names.index(f"{PAN}.coulomb"), P - 2
    cov[f_at], cov[:, f_at] = 0.0, 0.0
    cov[np.ix_([f_at, g_at], [f_at, g_at])] = [
        [(4.0 / F) ** 2, -(4.0**2) / F],
        [-(4.0**2) / F, 4.0**2 + 0.4**2],
    ]
    cov[-1, -1] = 0.1**2
    belief = Gaussian(np.r_[identified.belief.mean, G, np.log(0.6)], cov)
    drive = replace(drive, coulomb=f, stribeck=g, stribeck_velocity=v_s)
    dynamics = replace(identified.dynamics, drive=drive)
    return replace(identified, names=names, belief=belief, dynamics=dynamics)


def test_friction_at_rest_is_known_where_its_terms_are_not(building: Fit) -> None:
    at_rest = building.friction(0.0)
    assert at_rest.mean[0] == pytest.approx(F + G)
    assert at_rest.sd[0] == pytest.approx(0.4)


@pytest.mark.parametrize("speed", [0.0, 0.5, -2.0])
def test_slopes_of_friction_are_its_finite_differences(building: Fit, speed: float) -> None:
    drive, step = building.dynamics.drive, 1e-6

    def moved(field: str) -> Array:
        """Friction after a step in one coordinate of every joint: all but g are logarithms."""
        of = getattr(drive, field)
        further = of + step if field == "stribeck" else of * np.exp(step)
        dynamics = replace(building.dynamics, drive=replace(drive, **{field: further}))
        return replace(building, dynamics=dynamics).friction(speed).mean

    slopes = building.of_friction(speed)
    for field in FIELDS:
        by_joint = (moved(field) - building.friction(speed).mean) / step
        for j, joint in enumerate(building.dynamics.arm.joint_names):
            if (name := f"{joint}.{field}") in building.names:
                at = building.names.index(name)
                assert slopes[j, at] == pytest.approx(by_joint[j], abs=1e-4)
                slopes[j, at] = 0.0
    assert not slopes.any()
