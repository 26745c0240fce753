"""How doubtful motions are, learnt: what is found is what there is."""

import numpy as np
import pytest

from urdyn.tracking import doubt
from urdyn.tracking.doubt import LEARN, LEAST

J, PERIOD, NOISE = 6, 0.01, 0.7


def found(share, u, rows, seed):
    """The share of the stated variance u [A²], told from innovations that have `share` of it."""
    rng, known = np.random.default_rng(seed), doubt.unlearnt(J, PERIOD)
    stated = np.array([np.full(J, u), np.zeros(J)])
    for _ in range(rows):
        e = np.sqrt(NOISE + share * u) * rng.standard_normal(J)
        known = doubt.learnt(known, stated, e, NOISE + known.share[0] * u, PERIOD)
    return known.share


@pytest.mark.parametrize("share", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("u", [0.5, 5.0])
def test_as_much_as_there_is_is_found(share, u):
    """Of the last LEARN / PERIOD samples' weights."""
    got = found(share, u, 20_000, seed=1)[0]
    sd = np.sqrt(2.0 * PERIOD / LEARN) * (NOISE + share * u) / min(u, NOISE + share * u)
    # An innovation that counts as CLIP sd at most has half a per cent less variance.
    assert np.abs(got - share).max() < 4.0 * sd + 0.01 * (NOISE + share * u) / u


def test_what_is_not_doubted_tells_nothing():
    known = doubt.unlearnt(J, PERIOD)
    nothing, one = np.zeros((2, J)), np.ones(J)
    assert doubt.learnt(known, nothing, 3.0 * one, one, PERIOD) is known
    some = np.array([one, 0.0 * one])
    told = doubt.learnt(known, some, 5.0 * one, one, PERIOD)
    assert (told.share[0] > 1.0).all() and (told.share[1] == 1.0).all()


def test_a_current_that_is_not_measured_tells_nothing():
    known, lost = doubt.unlearnt(J, PERIOD), np.full(J, np.nan)
    told = doubt.learnt(known, np.ones((2, J)), lost, lost, PERIOD)
    np.testing.assert_array_equal(told.share, known.share)
    np.testing.assert_array_equal(told.count, known.count)


def test_some_doubt_is_left_of_a_gear_that_always_grips_as_it_should():
    assert (found(0.0, 5.0, 5000, seed=2)[0] >= LEAST).all()
