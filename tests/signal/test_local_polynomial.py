"""Laws of the local polynomial that turns angles and velocities into kinematics."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest
from numpy.linalg import norm
from numpy.polynomial import Polynomial
from scipy.signal import savgol_filter
from scipy.stats import chi2

from urdyn.signal import LocalPolynomial, half_window, kinematics, weights
from urdyn.signal.kinematics import BATCH
from urdyn.signal.polynomial import averaging
from urdyn.types import Array

STEP, HALF, DEGREE = 0.01, 4, 4


def rounding(q: Array, order: int, half: int = HALF, degree: int = DEGREE) -> float:
    """Error that float64 may leave in a derivative of data of this size.

    Markov: the k-th derivative of a polynomial on a window of half length s is at most n^2k / s^k
    times its size; the normal equations of a Legendre basis lose at most four digits.
    """
    scale = degree**2 / (half * STEP)
    return float(1e4 * np.finfo(float).eps * np.abs(q).max() * scale**order)


def irregular(rng: np.random.Generator, rows: int) -> Array:
    """Stamps of a recorder that polls: 8 to 16 ms apart."""
    return np.cumsum(rng.choice([0.008, 0.010, 0.012, 0.016], rows, p=[0.1, 0.6, 0.2, 0.1]))


@pytest.mark.parametrize("half", [4, 10])
@pytest.mark.parametrize("order", range(4))
def test_without_velocities_it_is_savitzky_golay_to_the_very_ends(order: int, half: int) -> None:
    q = np.random.default_rng(1).normal(size=(300, 2))
    ours = kinematics(STEP * np.arange(300), q, half=half)[order]
    theirs = savgol_filter(q, 2 * half + 1, DEGREE, deriv=order, delta=STEP, axis=0)
    assert np.abs(ours - theirs).max() < rounding(q, order)


@pytest.mark.parametrize("velocities", [True, False])
def test_polynomials_up_to_the_degree_are_exact_on_any_stamps_at_any_offset(
    velocities: bool,
) -> None:
    rng = np.random.default_rng(2)
    t = irregular(rng, 200)
    motion = [Polynomial(rng.normal(size=DEGREE + 1)) for _ in range(3)]
    q = np.stack([p(t) for p in motion], axis=1)
    v = np.stack([p.deriv()(t) for p in motion], axis=1)
    q[50:52] = np.nan
    q[120, 1] = np.nan
    offset = np.array([0.0, 0.006, -0.003])
    found = kinematics(t, q, v if velocities else None, offset=offset)
    for order, estimate in enumerate(found):
        truth = [p.deriv(order)(t + h) for p, h in zip(motion, offset, strict=True)]
        assert np.abs(estimate - np.stack(truth, axis=1)).max() < rounding(np.nan_to_num(q), order)


def test_a_uniform_window_is_solved_as_any_other() -> None:
    rng = np.random.default_rng(3)
    t, q = STEP * np.arange(100), rng.normal(size=(100, 2))
    # without velocities the usual step is only a unit: told another one, no window looks uniform
    pairs = zip(
        kinematics(t, q, offset=0.002), kinematics(t, q, offset=0.002, step=0.0101), strict=True
    )
    for order, (quick, general) in enumerate(pairs):
        assert np.abs(quick - general).max() < rounding(q, order)


def test_windows_never_reach_across_a_gap() -> None:
    rng = np.random.default_rng(4)
    t = irregular(rng, 60)
    t[30:] += 1.0
    q, v = rng.normal(size=(2, 60, 3))
    whole = kinematics(t, q, v)
    for part in (slice(None, 30), slice(30, None)):
        alone = kinematics(t[part], q[part], v[part], step=float(np.median(np.diff(t))))
        assert all(np.array_equal(a[part], b) for a, b in zip(whole, alone, strict=True))


def test_joints_do_not_know_each_other() -> None:
    rng = np.random.default_rng(5)
    t, (q, v) = STEP * np.arange(200), rng.normal(size=(2, 200, 4))
    q[rng.random(q.shape) < 0.05] = np.nan
    v[rng.random(v.shape) < 0.05] = np.nan
    together = kinematics(t, q, v)
    for j in range(4):
        alone = kinematics(t, q[:, [j]], v[:, [j]])
        for order in range(4):
            error = np.abs(together[order][:, j] - alone[order][:, 0]).max()
            assert error < rounding(np.nan_to_num(q), order)


def test_too_few_samples_make_nan_and_no_warning() -> None:
    t, q = STEP * np.arange(40), np.zeros((40, 1))
    q[10:17] = np.nan
    found = np.isnan(kinematics(t, q).q[:, 0])
    # a window of nine has the five angles that a quartic needs, unless it lost five of the seven
    assert np.flatnonzero(found).tolist() == list(range(10, 17))
    assert np.isnan(kinematics(t, np.full((40, 2), np.nan)).q).all()
    assert np.isnan(kinematics(t[:4], q[:4]).q).all()


def test_velocities_alone_need_one_angle() -> None:
    t = STEP * np.arange(9)
    q, v = np.full((9, 1), np.nan), np.cos(t)[:, None]
    assert np.isnan(kinematics(t, q, v).v).all()
    q[2] = np.sin(t[2])
    assert np.isfinite(kinematics(t, q, v).v).all()


@pytest.mark.parametrize("lag", [0, HALF])
def test_noise_gain_is_the_squared_weights(lag: int) -> None:
    rng, windows = np.random.default_rng(6), 4000
    fit = LocalPolynomial(HALF, DEGREE, STEP)
    sd_q, sd_v = 5e-5, 2e-3
    of_q, of_v = weights(fit, (HALF - lag) * STEP)
    q = rng.normal(scale=sd_q, size=(windows, fit.samples, 1))
    v = rng.normal(scale=sd_v, size=(windows, fit.samples, 1))
    t = np.tile(STEP * np.arange(fit.samples), (windows, 1))
    found = fit.estimate(t, q, v, np.full((windows, 1), (2 * HALF - lag) * STEP))[..., 0]
    theory = (of_q**2).sum(1) * sd_q**2 + (of_v**2).sum(1) * sd_v**2
    statistic = (found**2).sum(1) / theory  # chi-squared: the windows do not overlap
    low, high = chi2.ppf([1e-4, 1 - 1e-4], windows)
    assert ((low < statistic) & (statistic < high)).all()


def test_velocities_make_the_acceleration_quieter() -> None:
    fit = LocalPolynomial(HALF, DEGREE, STEP)
    (joint_q, joint_v), (alone, _) = weights(fit, 0.0), weights(fit, 0.0, False)
    sd_q, sd_v = 5e-5, 2e-3
    with_both = (joint_q[2] ** 2).sum() * sd_q**2 + (joint_v[2] ** 2).sum() * sd_v**2
    assert with_both < (alone[2] ** 2).sum() * sd_q**2


def test_the_truncation_error_is_of_the_first_power_left_out() -> None:
    omega = 2 * math.pi
    t = STEP * np.arange(400)
    found = kinematics(t, np.sin(omega * t)[:, None]).v[HALF:-HALF, 0]
    of_q, _ = weights(LocalPolynomial(HALF, DEGREE, STEP), 0.0, False)
    away = STEP * np.abs(np.arange(-HALF, HALF + 1))
    bound = (np.abs(of_q[1]) * (omega * away) ** 5 / math.factorial(5)).sum()
    assert np.abs(found - omega * np.cos(omega * t[HALF:-HALF])).max() <= bound


@pytest.mark.parametrize(("rate", "half"), [(25, 2), (100, 4), (125, 4), (500, 18)])
def test_the_window_is_a_time_not_a_number_of_samples(rate: float, half: int) -> None:
    assert half_window(1 / rate) == half


def test_windows_as_long_as_the_log_take_little_memory() -> None:
    """That of the equations of BATCH samples, angle and velocity in five terms, ten times over."""
    rng = np.random.default_rng(7)
    t = np.cumsum(rng.choice([0.008, 0.012], 400))
    q, v = rng.normal(size=(2, 400, 3))
    tracemalloc.start()
    kinematics(t, q, v, half=200)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10 * BATCH * 2 * 5 * np.dtype(float).itemsize


@pytest.mark.parametrize("rate", [20, 25, 31, 45, 50, 100, 125, 500])
@pytest.mark.parametrize("velocities", [True, False])
@pytest.mark.parametrize("degree", [3, 4])
def test_noise_makes_little_of_an_acceleration_at_any_rate(
    rate: float, velocities: bool, degree: int
) -> None:
    """Excited arms have some .35 rad/s²: noise of .1 makes a rotor 8 % lighter than it is."""
    fit = LocalPolynomial(half_window(1 / rate, degree, velocities), degree, 1 / rate)
    of_q, of_v = weights(fit, 0.0, velocities)
    assert np.hypot(5e-5 * norm(of_q[2]), 2e-3 * norm(of_v[2])) < 0.1


@pytest.mark.parametrize("lead", [0.0, 0.006])
def test_an_acceleration_is_told_as_the_average_that_its_weights_say(lead: float) -> None:
    """Each row's lasts for a step about it, `lead` later; angles and velocities are exact."""
    a = np.random.default_rng(3).normal(size=60)
    since = np.arange(60)[:, None] - np.arange(60) + 0.5 - lead / STEP  # [rows] since it set in
    lasted, gone = np.maximum(since, 0.0), np.maximum(since - 1.0, 0.0)
    q, v = STEP**2 * (lasted**2 - gone**2) / 2.0 @ a, STEP * (lasted - gone) @ a
    told = kinematics(STEP * np.arange(60), q[:, None], v[:, None], offset=lead, half=HALF).a[:, 0]
    weigh = averaging(LocalPolynomial(HALF, DEGREE, STEP), lead)
    inside = slice(2 * HALF, -2 * HALF)  # the first row's, and what lies beyond a window, aside
    assert np.isclose(weigh.sum(), 1.0)
    off = (np.correlate(a, weigh, "same") - told)[inside]
    assert np.abs(off).max() < 1e-9
