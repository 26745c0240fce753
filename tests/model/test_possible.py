"""The nearest body: a body for every belief, and what is one stays what it is."""

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.model.body import about_frame
from urdyn.model.consistency import from_pseudo_inertia, pseudo_inertia
from urdyn.model.possible import possible_body, possible_load
from urdyn.types import Gaussian

REACH = 0.5
SD = np.array([3.0, 0.3, 0.3, 0.3, *[0.05] * 6])


def excess(inertials):
    """How far inertials are from those of a body within REACH; 0 or less: they are."""
    J = pseudo_inertia(inertials)
    return max(-np.linalg.eigvalsh(J)[0], np.trace(J[:3, :3]) / REACH**2 - J[3, 3])


@pytest.mark.parametrize("seed", range(40))
def test_whatever_is_believed_the_body_is_possible(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((10, 10)) * SD[:, None] * rng.choice([1.0, 0.1, 0.01])
    mean = SD * rng.standard_normal(10) * rng.choice([0.1, 1.0, 5.0])
    body = possible_body(Gaussian(mean, root @ root.T), REACH)
    assert excess(body) < 1e-9 * max(1.0, body[0])
    assert body[0] >= 0.0


@pytest.mark.parametrize("seed", range(20))
def test_no_other_body_is_likelier(seed):
    """Bodies are sums of points within reach: a little of no point, nor of itself, is nearer."""
    rng = np.random.default_rng(seed)
    root = SD[:, None] * (np.eye(10) + 0.15 * rng.standard_normal((10, 10)))
    mean = SD * rng.standard_normal(10)
    body = possible_body(Gaussian(mean, root @ root.T), REACH)
    left, whiten = np.linalg.solve(root, mean - body), np.linalg.inv(root)
    at = REACH * rng.uniform(-1.0, 1.0, (2000, 3)) / np.sqrt(3.0)
    points = [from_pseudo_inertia(np.outer(r, r)) for r in np.c_[at, np.ones(2000)]]
    for one in [body, -body, *points]:
        toward = whiten @ one
        # Cuts are broken by .01 sd; what mends it does so in inertials, not in standard deviations.
        assert left @ toward <= 0.2 * np.linalg.norm(toward) + 1e-6


def test_a_body_stays_what_it_is():
    body = about_frame(2.0, np.array([0.02, -0.1, 0.12]), 0.01 * np.eye(3))
    found = possible_body(Gaussian(body, np.diag(SD**2)), REACH)
    np.testing.assert_allclose(found, body, rtol=0, atol=1e-12)


def test_nothing_is_a_body_too():
    found = possible_body(Gaussian(np.zeros(10), np.diag(SD**2)), REACH)
    np.testing.assert_allclose(found, 0.0, atol=1e-15)


def test_a_negative_mass_is_nothing():
    mean = np.r_[-14.0, np.zeros(9)]
    np.testing.assert_allclose(possible_body(Gaussian(mean, np.diag(SD**2)), REACH), 0.0, atol=1e-6)


def test_what_is_surer_gives_way_less():
    """A first moment that is known asks for the mass, not the other way round."""
    mean = np.r_[0.1, 0.0, 0.0, 0.4, np.zeros(6)]
    sure = SD * np.r_[1.0, [1e-3] * 3, np.ones(6)]
    body = possible_body(Gaussian(mean, np.diag(sure**2)), REACH)
    assert body[3] == pytest.approx(0.4, rel=0.05)
    assert body[0] >= 0.4 / REACH * 0.95


def test_links_of_the_library_are_possible():
    for inertials in load_arm("ur10e").inertials:
        found = possible_body(Gaussian(inertials, np.diag((0.1 * inertials + 0.01) ** 2)), 1.5)
        np.testing.assert_allclose(found, inertials, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("seed", range(200))
def test_no_other_load_is_likelier(seed):
    """Of a projection upon a cone: nothing of the cone is nearer, and the way to it is square."""
    rng = np.random.default_rng(seed)
    sd = np.array([1.0, 0.1, 0.1, 0.1]) * 10.0 ** rng.uniform(-2.0, 1.0, 4)
    root = sd[:, None] * (np.eye(4) + 0.4 * rng.standard_normal((4, 4)))
    mean = root @ rng.standard_normal(4) * rng.choice([0.1, 1.0, 10.0])
    if seed % 10 == 0:
        mean[0] = 0.0
    load = possible_load(Gaussian(mean, root @ root.T), REACH)
    assert np.linalg.norm(load[1:]) <= (REACH + 1e-8) * load[0]
    left = np.linalg.solve(root, mean - load)
    pull = np.linalg.solve(root.T, left)  # the likelihood's gradient
    size = np.linalg.norm(left) * np.linalg.norm(np.linalg.solve(root, load))
    assert abs(pull @ load) <= 1e-6 * size
    toward = pull[0] + REACH * np.linalg.norm(pull[1:])  # along the cone's likeliest ray
    assert toward <= 1e-5 * (abs(pull[0]) + REACH * np.linalg.norm(pull[1:]))


@pytest.mark.parametrize("seed", range(200))
def test_a_load_is_possible_however_well_some_of_it_is_known(seed):
    rng = np.random.default_rng(seed)
    root = 10.0 ** rng.uniform(-12.0, 1.0, (4, 1)) * rng.standard_normal((4, 4))
    mean = rng.standard_normal(4) * 10.0 ** rng.uniform(-12.0, 1.0, 4)
    load = possible_load(Gaussian(mean, root @ root.T), REACH)
    assert np.linalg.norm(load[1:]) <= REACH * load[0] + 1e-6 * np.abs(mean).max()


def test_a_load_stays_what_it_is_and_less_than_nothing_is_nothing():
    load, cov = np.array([2.0, 0.04, -0.2, 0.24]), np.diag(SD[:4] ** 2)
    np.testing.assert_array_equal(possible_load(Gaussian(load, cov), REACH), load)
    np.testing.assert_array_equal(possible_load(Gaussian(0.0 * load, cov), REACH), 0.0 * load)
    less = np.array([-14.0, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(possible_load(Gaussian(less, cov), REACH), 0.0 * load)


def test_a_moment_without_a_mass_asks_for_one():
    """By symmetry, where both are known alike in units of the reach: halfway to the edge."""
    cov = np.diag([1.0, *[REACH**2] * 3])
    load = possible_load(Gaussian(np.array([0.0, 0.0, 0.0, 2.0 * REACH]), cov), REACH)
    np.testing.assert_allclose(load, [1.0, 0.0, 0.0, REACH], atol=1e-9)


@pytest.mark.parametrize("sd", [0.0, 1e-160, 1e-20])
def test_a_load_that_is_sure_is_possible_too(sd):
    """A cloud of particles may be of one opinion, which no body has."""
    cov = sd**2 * np.diag([1.0, *[REACH**2] * 3])
    load = possible_load(Gaussian(np.array([0.0, 0.0, 0.0, 2.0 * REACH]), cov), REACH)
    np.testing.assert_allclose(load, [1.0, 0.0, 0.0, REACH], atol=1e-9)
