"""What passes slowly in a current's noise: seen past exactly, and found."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import norm

from urdyn.identify import Noise
from urdyn.identify.noise import fit_noise
from urdyn.identify.slow import MEMORY, forgotten, without_slow
from urdyn.types import NORMAL90, Array

STEP = 0.01  # [s]
KEEP = forgotten(STEP)
ROWS = 2500  # as of an excitation of 25 s


def slowly(rng: np.random.Generator, rows: int, many: int, keep: float = KEEP) -> Array:
    """Noise of unit variance of which `keep` is left a row on, (rows, many)."""
    white = rng.standard_normal((rows, many))
    white[1:] *= np.sqrt(1.0 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], white, axis=0))


def unit(joints: int) -> Noise:
    """White noise of 1 A."""
    return Noise(*np.ones((3, joints)), np.zeros((joints, 0)))


@pytest.mark.parametrize("h", [0.05, 0.5, 3.0])
def test_innovations_are_those_of_the_dense_gaussian(h: float) -> None:
    """White ones are L^-1 y, with L the root of the noise's covariance."""
    n = 400
    y = np.random.default_rng(0).standard_normal((n, 2))
    L = np.linalg.cholesky(h**2 * toeplitz(KEEP ** np.arange(n)) + np.eye(n))
    np.testing.assert_allclose(without_slow(y, h, KEEP), np.linalg.solve(L, y), atol=1e-7)


def test_nothing_slow_is_nothing_to_see_past() -> None:
    y = np.random.default_rng(1).standard_normal((50, 3))
    np.testing.assert_array_equal(without_slow(y, 0.0, KEEP), y)


def test_the_share_that_is_slow_is_found() -> None:
    """A log has rows STEP / MEMORY independent values, whose variance scatters by sqrt(2 / n)."""
    many, share = 40, 0.2
    rng = np.random.default_rng(2)
    quick = lfilter([1.0], [1.0, -0.5], rng.standard_normal((ROWS, many)), axis=0)
    quick *= np.sqrt((1.0 - share) * 0.75)
    e = quick + np.sqrt(share) * slowly(rng, ROWS, many)
    noise = fit_noise([[column] for column in e.T], STEP, unit(many))
    one = np.sqrt(2.0 * MEMORY / (ROWS * STEP))
    found = noise.slow**2 / share
    assert abs(found.mean() - 1.0) < 0.2  # a mean of what is likely leans on what was likely before
    assert found.std() < 1.5 * one
    white = np.array([noise.whiten(column, j) for j, column in enumerate(e.T)])
    np.testing.assert_allclose(white.var(axis=1), noise.power, rtol=0.02)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.1, 0.3])
def test_intervals_hold_although_a_log_tells_little_of_what_is_slow(share: float) -> None:
    """25 s at 50 Hz, where a regression spans a sixth of a second, beside what a filter leaves.

    An error has the density that noise has beside gentle motion, and is told to have that found.
    """
    step, many, rng = 0.02, 100, np.random.default_rng(3)
    rows, keep, quickly = round(25.0 / step), forgotten(step), np.exp(-step / 0.01)
    e = rng.standard_normal((rows, many)) + slowly(rng, rows, many, quickly)
    e = np.sqrt(0.5 - 0.5 * share) * e + np.sqrt(share) * slowly(rng, rows, many, keep)
    found = fit_noise([[column] for column in e.T], step, unit(many)).gentle
    quick, slow = ((1.0 + a) / (1.0 - a) for a in (quickly, keep))  # density at rest
    truth = 0.5 * (1.0 - share) * (1.0 + quick) + 0.5 * share * slow
    held = 2.0 * norm.cdf(NORMAL90 * np.sqrt(found / truth)) - 1.0
    assert held.mean() == pytest.approx(0.9, abs=0.03)


def test_slow_noise_makes_slow_motion_tell_less() -> None:
    """A level is known by its density at rest, 2 MEMORY slow²; half of it beside gentle motion."""
    one = np.ones(1)
    white = Noise(one, one, 1e9 * one, np.zeros((1, 0)))
    slow = Noise(one, one, 1e9 * one, np.zeros((1, 0)), one, KEEP)
    assert white.gentle[0] == pytest.approx(1.0)
    assert slow.gentle[0] == pytest.approx(1.0 + MEMORY / STEP, rel=1e-4)
    row = np.ones((20_000, 1))
    told = float(np.sum(slow.whiten(row, 0) ** 2))  # information on a level
    assert told == pytest.approx(len(row) / (1.0 + 2.0 * MEMORY / STEP), rel=0.02)
