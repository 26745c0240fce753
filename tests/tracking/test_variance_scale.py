"""The scale of what a model states of uncertain motions: what is found is what there is."""

import numpy as np
import pytest

from urdyn.tracking.noise import variance_scale
from urdyn.tracking.noise.variance_scale import LEARN, LEAST

J, PERIOD, NOISE = 6, 0.01, 0.7


def found(scale, u, rows, seed):
    """The scale of the stated variance u [A²], told from innovations that have `scale` of it."""
    rng, known = np.random.default_rng(seed), variance_scale.as_stated(J, PERIOD)
    stated = np.array([np.full(J, u), np.zeros(J)])
    for _ in range(rows):
        e = np.sqrt(NOISE + scale * u) * rng.standard_normal(J)
        known = variance_scale.updated(known, stated, e, NOISE + known.scale[0] * u, PERIOD)
    return known.scale


@pytest.mark.parametrize("scale", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("u", [0.5, 5.0])
def test_as_much_as_there_is_is_found(scale, u):
    """Of the last LEARN / PERIOD samples' weights."""
    got = found(scale, u, 20_000, seed=1)[0]
    sd = np.sqrt(2.0 * PERIOD / LEARN) * (NOISE + scale * u) / min(u, NOISE + scale * u)
    # An innovation that counts as CLIP sd at most has half a per cent less variance.
    assert np.abs(got - scale).max() < 4.0 * sd + 0.01 * (NOISE + scale * u) / u


def test_what_is_not_doubted_tells_nothing():
    known = variance_scale.as_stated(J, PERIOD)
    nothing, one = np.zeros((2, J)), np.ones(J)
    assert variance_scale.updated(known, nothing, 3.0 * one, one, PERIOD) is known
    some = np.array([one, 0.0 * one])
    told = variance_scale.updated(known, some, 5.0 * one, one, PERIOD)
    assert (told.scale[0] > 1.0).all() and (told.scale[1] == 1.0).all()


def test_a_current_that_is_not_measured_tells_nothing():
    known, lost = variance_scale.as_stated(J, PERIOD), np.full(J, np.nan)
    told = variance_scale.updated(known, np.ones((2, J)), lost, lost, PERIOD)
    np.testing.assert_array_equal(told.scale, known.scale)
    np.testing.assert_array_equal(told.count, known.count)


def test_some_doubt_is_left_of_a_gear_that_always_grips_as_it_should():
    assert (found(0.0, 5.0, 5000, seed=2)[0] >= LEAST).all()
