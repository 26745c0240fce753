"""Statistics of arms that nobody has measured yet."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from urdyn.model.arm import Arm, load_arm, read_arm
from urdyn.model.consistency import is_consistent, log_cholesky
from urdyn.model.library import names
from urdyn.model.population import (
    IDENTIFIED_GAIN,
    MASS_SPREAD,
    MAX_TAIL,
    OPTIONAL,
    RATED_TORQUE,
    TYPICAL,
    Population,
    population,
)
from urdyn.types import Array

DRAWS = 400
CHANCE = 1e-3  # that a sound population fails


@pytest.fixture(scope="module")
def arms_of_a_type(ur5e: Arm) -> Population:
    return population(ur5e)


def scores(prior: Population) -> Array:
    """Standard scores of links and drives of many draws, (DRAWS, P); clipped tails left out."""
    rng, drawn = np.random.default_rng(0), []
    for _ in range(DRAWS):
        arm = prior.draw(rng, OPTIONAL)
        links = (log_cholesky(arm.inertials) - prior.link_mean) / prior.link_sd
        drive = []
        for name, spread in prior.drive.items():
            value = getattr(arm.drive, name)
            x = np.log(value) if spread.positive else value
            drive += [] if name == "presliding_tail" else [(x - spread.mean) / spread.sd]
        drawn.append(np.concatenate([links.ravel(), *drive]))
    return np.array(drawn)


def test_draws_have_the_mean_and_spread_that_are_believed(arms_of_a_type: Population) -> None:
    z = scores(arms_of_a_type)
    low, high = CHANCE / 2.0, 1.0 - CHANCE / 2.0
    means = DRAWS * np.sum(z.mean(axis=0) ** 2)  # chi-square of as many as there are coordinates
    assert chi2.ppf(low, z.shape[1]) < means < chi2.ppf(high, z.shape[1])
    assert chi2.ppf(low, z.size) < np.sum(z**2) < chi2.ppf(high, z.size)
    each = np.sum(z**2, axis=0)  # and no coordinate makes up for another
    assert chi2.ppf(low / z.shape[1], DRAWS) < each.min()
    assert each.max() < chi2.ppf(1.0 - low / z.shape[1], DRAWS)


def test_masses_of_links_are_spread_as_is_told(arms_of_a_type: Population) -> None:
    """Each by itself, of a logarithm: chi-square of as many as there are draws."""
    rng, typical = np.random.default_rng(2), arms_of_a_type.typical().inertials[:, 0]
    mass = np.array([arms_of_a_type.draw(rng).inertials[:, 0] for _ in range(DRAWS)])
    found = np.sum((np.log(mass / typical) / MASS_SPREAD) ** 2, axis=0)
    tail = CHANCE / (2.0 * len(typical))
    assert (chi2.ppf(tail, DRAWS) < found).all() and (found < chi2.ppf(1.0 - tail, DRAWS)).all()


def test_every_draw_can_be_built(arms_of_a_type: Population) -> None:
    rng = np.random.default_rng(1)
    for _ in range(DRAWS):
        arm = arms_of_a_type.draw(rng, OPTIONAL)
        assert is_consistent(arm.inertials).all()
        assert (arm.drive.gain > 0.0).all() and (arm.drive.coulomb > 0.0).all()
        tail = arm.drive.presliding_tail
        assert ((tail >= 0.0) & (tail <= MAX_TAIL)).all()


@pytest.mark.parametrize("robot", names())
def test_the_typical_arm_has_the_published_masses(robot: str) -> None:
    arm = load_arm(robot)
    typical = population(arm).typical()
    np.testing.assert_allclose(typical.inertials, arm.inertials, rtol=1e-9, atol=1e-12)
    assert not any(getattr(typical.drive, name).any() for name in OPTIONAL)


@pytest.mark.parametrize(
    ("robot", "later"), [("ur3e", (0.0449, 0.0111)), ("ur5e", (0.3325, 0.0785))]
)
def test_what_is_published_as_a_cylinder_may_be_half_as_long_again(
    robot: str, later: tuple[float, float]
) -> None:
    """As UR's later moments of inertia across upper arm and forearm [kg·m²] are."""
    arm = load_arm(robot)
    prior = population(arm)
    own = np.exp(prior.link_mean[1:3, 1]) ** 2  # along the link, per unit of mass
    longer = 0.5 * np.log(np.array(later) / arm.inertials[1:3, 0] / own)
    assert (longer > 0.3).all() and (longer < 1.5 * prior.link_sd[1:3, 1]).all()
    drawn = population(load_arm("ur10e"))  # whose tensors are its drawings'
    assert (drawn.link_sd[:, 1:4] < 0.5 * prior.link_sd[:, 1:4]).all()


def test_a_term_that_is_not_asked_for_is_zero_and_changes_no_other(
    arms_of_a_type: Population,
) -> None:
    plain, rippled = (
        arms_of_a_type.draw(np.random.default_rng(2), terms)
        for terms in (frozenset[str](), frozenset({"ripple_cos"}))
    )
    assert not plain.drive.ripple_cos.any() and rippled.drive.ripple_cos.all()
    assert not rippled.drive.stribeck.any()
    np.testing.assert_array_equal(plain.drive.coulomb, rippled.drive.coulomb)
    np.testing.assert_array_equal(plain.inertials, rippled.inertials)


def test_no_drawn_arm_is_driven_by_its_friction_at_rest(arms_of_a_type: Population) -> None:
    rng = np.random.default_rng(11)
    drives = [arms_of_a_type.draw(rng, frozenset({"stribeck"})).drive for _ in range(100)]
    assert all((drive.coulomb + drive.stribeck > 0.0).all() for drive in drives)
    assert np.mean([drive.stribeck < 0.0 for drive in drives]) > 0.3  # some are slippery at rest


@pytest.mark.parametrize("effort", ["0", "1e6"])
def test_less_is_known_of_the_gains_of_an_arm_that_does_not_rate_its_joints(
    effort: str, ur5e: Arm
) -> None:
    """Exporters write 0 or a very large number where they were not told."""
    unrated = read_arm(re.sub(r' effort="[^"]*"', f' effort="{effort}"', ur5e.urdf))
    known, unknown = population(ur5e).drive["gain"], population(unrated).drive["gain"]
    assert (unknown.sd > 2.0 * known.sd).all()
    low, high = known.typical.min() / 2.0, 2.0 * known.typical.max()
    assert ((unknown.typical > low) & (unknown.typical < high)).all(), unknown.typical
    assert not population(unrated).typical().undrawn(np.full(6, 5.0)).any()


def test_bigger_joints_have_more_inertia_and_friction(ur10e: Arm) -> None:
    order = np.argsort(ur10e.effort_limit, kind="stable")
    for name in ("rotor_inertia", "coulomb", "viscous"):
        assert (np.diff(population(ur10e).drive[name].typical[order]) >= 0.0).all()


def test_a_servo_has_less_inertia_and_friction_the_smaller_it_is(ur5e: Arm) -> None:
    """Also far below the joints that were measured: there is no step."""
    ratings = np.array([0.1, 0.3, 1.0, 1.1, 10.0])  # [N·m]
    arms = [replace(ur5e, effort_limit=np.full(6, rating)) for rating in ratings]
    for name in ("gain", "rotor_inertia", "coulomb", "viscous"):
        typical = np.array([population(arm).drive[name].typical[0] for arm in arms])
        assert (np.diff(typical) > 0.0).all(), name


def test_gains_of_a_type_that_was_identified_are_those() -> None:
    gain = population(load_arm("ur10")).drive["gain"]
    np.testing.assert_allclose(gain.typical, IDENTIFIED_GAIN["ur10"])
    # What joints of that size have elsewhere is within the spread that is taken for them all.
    by_size = np.interp([330.0, 150.0, 54.0], RATED_TORQUE, TYPICAL["gain"])
    assert (np.abs(np.log(gain.typical[[0, 2, 3]] / by_size)) < 2 * gain.sd[[0, 2, 3]]).all()
