"""Statistics of the noise model on noise that was made to measure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import binom, chi2
from scipy.stats import t as student

from urdyn.identify import Noise
from urdyn.identify.noise import (
    CERTAIN,
    ENOUGH,
    GAUSSIAN,
    MAX_ORDER,
    PIECE,
    _autoregressions,
    fit_noise,
    white_noise,
    whiten,
)
from urdyn.identify.search import Run, _start, _with_noise
from urdyn.identify.slow import MEMORY, forgotten, periodogram, share_of
from urdyn.model.dynamics import Dynamics
from urdyn.simulate import real_sensors
from urdyn.types import Array, Motion

AR = np.array([0.6, -0.3])
SCALE = 0.04  # [A]
ROWS = 20_000
STEP = 0.01  # [s]
FOUR_SIGMA = 4.0  # of any estimate: one sound test of 16,000 fails
CHANCE = 1e-3
SLOW, ENDED = 0.3, 25.0  # [-] share of the noise, [s] of a log


def coloured(rng: np.random.Generator, rows: int = ROWS) -> tuple[Array, Array]:
    """Noise from rest and the innovations it is made of, (rows,) each [A]."""
    w = SCALE * rng.standard_normal(rows)
    return np.asarray(lfilter([1.0], [1.0, *-AR], w)), w


def covariance(order: int) -> Array:
    """Of `order` successive values of the coloured noise over its innovations' variance."""
    impulse = lfilter([1.0], [1.0, *-AR], np.eye(1, 200).ravel())
    lags = [impulse[k:] @ impulse[: len(impulse) - k] for k in range(order)]
    return np.asarray(toeplitz(lags))


def usual(joints: int) -> Noise:
    """White noise of 0.3 A."""
    one = np.ones(joints)
    return Noise(0.3 * one, 0.3 * one, GAUSSIAN * one, np.zeros((joints, 0)))


def alone(stretch: Array) -> Noise:
    return fit_noise([[stretch]], STEP, usual(1))


def test_whitening_undoes_the_colour() -> None:
    e, w = coloured(np.random.default_rng(0))
    rounding = 8.0 * np.finfo(float).eps * np.abs(e).max()
    np.testing.assert_allclose(whiten(e, AR), w[len(AR) :], rtol=0, atol=rounding)


def test_whitening_goes_down_the_columns_and_leaves_its_input_alone() -> None:
    x = np.random.default_rng(1).standard_normal((50, 3))
    before = x.copy()
    each = np.column_stack([whiten(column, AR) for column in x.T])
    np.testing.assert_array_equal(whiten(x, AR), each)
    np.testing.assert_array_equal(x, before)


@pytest.mark.parametrize("seed", range(4))
def test_the_fit_finds_the_colour(seed: int) -> None:
    """Yule-Walker estimates scatter by inv(covariance) / N. [Brockwell1991]_"""
    e, _ = coloured(np.random.default_rng(seed))
    (ar,) = alone(e).ar
    error = ar - np.pad(AR, (0, len(ar) - len(AR)))
    distance = ROWS * error @ covariance(len(ar)) @ error
    # Of all orders Akaike takes the one that fits best: allow for the largest of them.
    assert distance < chi2.ppf(1.0 - CHANCE, MAX_ORDER)


def test_noise_of_rows_further_apart_is_that_of_every_third_row() -> None:
    e, _ = coloured(np.random.default_rng(2))
    one = np.ones(1)
    close = Noise(one, SCALE * one, GAUSSIAN * one, AR[None], keep=forgotten(STEP))
    apart, thin = close.at(3.0 * STEP), e[::3]
    assert close.at(STEP) is close and close.at(0.1 * STEP) is close
    assert apart.step == pytest.approx(3.0 * STEP)
    w = apart.whiten(thin, 0)
    spread = FOUR_SIGMA / np.sqrt(len(w))
    assert abs(np.mean(w**2) / apart.power[0] - 1.0) < np.sqrt(2.0) * spread
    assert abs(np.corrcoef(w[1:], w[:-1])[0, 1]) < spread


def test_regressions_of_every_order_solve_the_equations_of_yule_and_walker() -> None:
    acf = covariance(MAX_ORDER + 1)[0] + 0.3 * 0.8 ** np.arange(MAX_ORDER + 1)
    for order, (ar, left) in enumerate(_autoregressions(acf)):
        dense = np.linalg.solve(toeplitz(acf[:order]), acf[1 : order + 1]) if order else ar
        np.testing.assert_allclose(ar, dense, rtol=0, atol=1e-12)
        assert left == pytest.approx(acf[0] - dense @ acf[1 : order + 1])
    assert order == MAX_ORDER


def test_beside_slow_noise_a_regression_may_be_longer_than_without() -> None:
    """One that ends where it would be unstable ends elsewhere where less noise is left."""
    w = np.linspace(0.01, np.pi, 200)
    longer = {True: [(np.zeros(1), 1.0)], False: [(np.zeros(0), 1.0)]}
    found = share_of(w, np.ones(200), lambda share: longer[share > 0.1], forgotten(STEP))
    assert 0.0 < found < 0.1


@pytest.mark.parametrize("share", [0.05, 0.3, 0.64])
def test_what_is_left_beside_slow_noise_never_grows(share: float) -> None:
    """Of products that are estimated, and of a share that is too large, too."""
    rng, keep, lags = np.random.default_rng(7), forgotten(STEP), np.arange(MAX_ORDER + 1)
    for _ in range(50):
        pole = rng.uniform(0.5, 0.999)
        acf = pole**lags + 0.02 * rng.standard_normal(len(lags)) * (lags > 0)
        regressions = _autoregressions(acf - share * acf[0] * keep**lags)
        roots = [np.abs(np.roots([1.0, *-ar])) for ar, _ in regressions]
        assert max(np.concatenate(roots), default=0.0) < 1.0


@pytest.mark.parametrize("seed", range(4))
def test_what_the_fit_whitens_is_white(seed: int) -> None:
    """Ljung and Box's sum of squared autocorrelations."""
    e, _ = coloured(np.random.default_rng(seed))
    w = whiten(e, alone(e).ar[0])
    lags = np.arange(1, 31)
    r = np.array([w[k:] @ w[:-k] for k in lags]) / (w @ w)
    assert len(w) * (len(w) + 2) * np.sum(r**2 / (len(w) - lags)) < chi2.ppf(1 - CHANCE, 30)


def test_scale_is_that_of_the_innovations_and_sd_that_of_the_whole() -> None:
    e, _ = coloured(np.random.default_rng(9))
    noise = alone(e)
    scatter = FOUR_SIGMA / np.sqrt(2.0 * ROWS)
    assert noise.scale[0] == pytest.approx(SCALE, rel=scatter + 1.0 / GAUSSIAN)
    # Neighbours are alike, so there are fewer than ROWS of them: variances add up over all lags.
    lags = covariance(60)[0] / covariance(1)[0, 0]
    alike = 1.0 + 2.0 * np.sum(lags[1:] ** 2)
    sd = SCALE * np.sqrt(covariance(1)[0, 0])
    assert noise.sd[0] == pytest.approx(sd, rel=scatter * np.sqrt(alike))


def test_gaussian_noise_is_called_gaussian() -> None:
    rng, times = np.random.default_rng(3), 60
    called = sum(alone(rng.standard_normal(2000)).dof[0] == GAUSSIAN for _ in range(times))
    # Two sigma of a kurtosis: 2.3 % of Gaussian samples look heavier, or somewhat more, for the
    # kurtosis itself is skewed.
    assert called >= binom.ppf(CHANCE, times, 0.95)


def test_heavy_tails_are_found_and_the_power_is_kept() -> None:
    """Excess and mean square of t innovations scatter by their eighth and fourth moments."""
    nu, rows = 14.0, 100_000
    unit = student(nu, scale=np.sqrt((nu - 2.0) / nu))
    m4, m6, m8 = (unit.moment(k) for k in (4, 6, 8))
    x = SCALE * unit.rvs(rows, random_state=np.random.default_rng(4))
    noise = alone(x)
    dof = noise.dof[0]
    # m4/m2² = m4 + (x⁴ - m4) - 2 m4 (x² - 1) to first order.
    excess = np.sqrt((m8 - m4**2 - 4 * m4 * (m6 - m4) + 4 * m4**2 * (m4 - 1.0)) / rows)
    assert 6.0 / (dof - 4.0) == pytest.approx(m4 - 3.0, abs=FOUR_SIGMA * excess)
    rms = noise.scale[0] * np.sqrt(dof / (dof - 2.0))
    assert rms == pytest.approx(SCALE, rel=FOUR_SIGMA * np.sqrt((m4 - 1.0) / rows) / 2.0)


@pytest.mark.parametrize("dof", [4.5, 10.0, 100.0])
def test_average_weight_is_fishers_information(dof: float) -> None:
    """Of the location of a t variable: the mean square of its score. [Lange1989]_"""
    law = student(dof, scale=SCALE)
    noise = Noise(*np.array([[SCALE], [SCALE], [dof]]), np.zeros((1, 0)))
    weight = quad(lambda w: noise.weights(np.array([w]), 0)[0] ** 2 * law.pdf(w), -np.inf, np.inf)
    information = (dof + 1.0) / (dof + 3.0) / SCALE**2
    assert weight[0] == pytest.approx(information, rel=1e-6)


@pytest.mark.parametrize("dof", [4.5, 10.0])
def test_gaussian_noise_that_counts_alike_leaves_fishers_information(dof: float) -> None:
    """Of a location, a row of t noise tells less than one of a Gaussian of its scale."""
    noise = Noise(*np.array([[SCALE], [SCALE], [dof]]), np.zeros((1, 0)))
    information = (dof + 1.0) / (dof + 3.0) / SCALE**2
    assert 1.0 / noise.counted.power[0] == pytest.approx(information, rel=1e-9)


def test_what_a_fit_absorbed_is_part_of_the_noise_and_widens_its_intervals() -> None:
    """A white share of it adds to the residuals' variance."""
    left = SCALE * np.random.default_rng(41).standard_normal(2000)
    more = [[np.full(1001, SCALE**2)]]
    plain, noise = (fit_noise([[left]], STEP, usual(1), absorbed) for absorbed in (None, more))
    assert noise.sd[0] ** 2 == pytest.approx(plain.sd[0] ** 2 + SCALE**2, rel=1e-9)


def test_an_outlier_counts_less_the_wilder_it_is() -> None:
    noise = Noise(*np.array([[SCALE], [SCALE], [5.0]]), np.zeros((1, 0)))
    wild = SCALE * np.array([0.0, 3.0, 30.0, 300.0])
    weights = noise.weights(wild, 0)
    assert (np.diff(weights) < 0.0).all()
    assert (np.diff(weights**2 * wild)[1:] < 0.0).all()  # and pulls less


def test_a_wild_sample_is_no_louder_noise() -> None:
    """At most twelve of its sd are counted of it: with it that variance is .7 % more."""
    e, _ = coloured(np.random.default_rng(3))
    wild = e.copy()
    wild[ROWS // 2] = 1e4 * SCALE
    sound, noise = alone(e), alone(wild)
    assert noise.sd[0] == pytest.approx(sound.sd[0], rel=0.5 * 12.0**2 / ROWS + 1e-3)
    # In heavy tails innovations stand for less of it, which is what these are for.
    assert noise.scale[0] == pytest.approx(sound.scale[0], rel=0.4)
    assert noise.power[0] == pytest.approx(sound.power[0], rel=0.1)


def test_white_noise_is_gaussian_and_as_strong_as_what_is_left() -> None:
    e, w = coloured(np.random.default_rng(2))
    plain = white_noise([[e], [w], []], STEP, usual(3))
    np.testing.assert_allclose(plain.scale, [np.std(e), np.std(w), 0.3])
    np.testing.assert_array_equal(plain.sd, plain.scale)
    assert plain.ar.shape == (3, 0) and (plain.dof == GAUSSIAN).all()


@pytest.mark.parametrize("few", [[], [np.ones(ENOUGH - 1)]], ids=["silent", "brief"])
def test_joints_may_differ_in_order_and_one_that_tells_too_little_has_usual_noise(
    few: list[Array],
) -> None:
    e, w = coloured(np.random.default_rng(5))
    noise = fit_noise([[e[:9000], e[9000:]], [w], few], STEP, usual(3))
    assert noise.ar.shape[0] == 3 and noise.ar.shape[1] >= 2
    assert (noise.ar[2] == 0.0).all() and noise.sd[2] == noise.scale[2] == 0.3


def test_a_joint_that_never_moved_has_the_noise_of_such_sensors(
    point: Dynamics, motion: Motion
) -> None:
    moves = np.arange(6) != 3
    part = motion.slice(0, 400)
    runs = [Run(replace(part, v=moves * part.v, a=moves * part.a))]
    start = _start(point.arm, runs, point.drive.gain, point.payload)
    for plain in (True, False):
        (noise,) = _with_noise(start, runs, plain).noises
        assert noise.sd[3] == pytest.approx(real_sensors(point.arm).current_noise[3], rel=1e-9)
        assert noise.gentle[3] > 4.0 * noise.sd[3] ** 2  # slow noise is a part of it


@pytest.mark.parametrize("length", [1, 2, 5, MAX_ORDER, MAX_ORDER + 1, 20])
def test_noise_in_pieces_as_short_as_these_is_that_of_the_whole(length: int) -> None:
    """In power, and in colour as far as a piece tells of it."""
    e, _ = coloured(np.random.default_rng(8))
    pieces = np.split(e, np.arange(length, len(e), length))
    whole, noise = alone(e), fit_noise([[*pieces, np.zeros(0)]], STEP, usual(1))
    assert noise.ar.shape[1] <= min(length - 1, MAX_ORDER)
    np.testing.assert_allclose(noise.sd, whole.sd, rtol=1e-9)
    assert noise.ar.size or length == 1
    np.testing.assert_array_equal(whiten(e[:1], AR), np.zeros(0))


def smooth(rng: np.random.Generator, rows: int, columns: int) -> Array:
    """Columns as a robot's motion makes them: a few harmonics of a slow period, (rows, columns)."""
    t = np.arange(rows) * STEP
    phase = 2.0 * np.pi * (0.1 * t[:, None] * np.arange(1, 7) + rng.random((columns, 1, 6)))
    return np.asarray((np.cos(phase) * rng.standard_normal((columns, 1, 6))).sum(axis=2).T)


def test_what_a_fit_took_from_the_noise_is_given_back() -> None:
    """The density at low frequency is the true one, within what so few slow values can tell."""
    rows, keep, runs = round(ENDED / STEP), forgotten(STEP), 40
    cov = SLOW * toeplitz(keep ** np.arange(rows)) + (1.0 - SLOW) * np.eye(rows)
    root, inverse = np.linalg.cholesky(cov), np.linalg.inv(cov)
    found: dict[str, list[float]] = {"told": [], "not told": []}
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        X, e = smooth(rng, rows, 12), root @ rng.standard_normal(rows)
        doubt = np.linalg.inv(X.T @ inverse @ X)  # of generalised least squares
        left = e - X @ (doubt @ (X.T @ (inverse @ e)))
        took = periodogram(X @ np.linalg.cholesky(doubt)).sum(axis=1)
        for told, absorbed in (("told", [[took]]), ("not told", None)):
            found[told].append(float(fit_noise([[left]], STEP, usual(1), absorbed).gentle[0]))
    one = np.ones(1)
    white = np.sqrt(1.0 - SLOW) * one
    truth = Noise(one, white, 1e9 * one, np.zeros((1, 0)), np.sqrt(SLOW) * one, keep).gentle[0]
    scatter = 4.0 * np.sqrt(2.0 * MEMORY / ENDED / runs)
    assert np.mean(found["told"]) == pytest.approx(truth, rel=scatter)
    assert np.mean(found["not told"]) < (1.0 - scatter) * truth


@pytest.mark.parametrize("fit", [fit_noise, white_noise])
@pytest.mark.parametrize("step", [0.002, 0.01])
def test_where_joints_turn_noise_says_what_lasting_errors_do(
    step: float, fit: Callable[..., Noise]
) -> None:
    """Noise of one density and errors of one size make the same density there at any rate."""
    rng, turns = np.random.default_rng(11), 300
    rows, lasting = round(1.0 / step), round(0.1 / step)
    density, size = 1e-5, 0.05  # [A²s] of the noise, [A] of what is misjudged
    e = np.sqrt(density / step) * rng.standard_normal((turns, rows))
    near = np.zeros((turns, rows), bool)
    near[:, lasting : 2 * lasting] = True
    e += near * size * rng.standard_normal((turns, 1))
    noise = fit([[*e]], step, usual(1), turning=[[*near]])
    found = noise.turning[0] ** 2 * noise.power[0] / (1.0 - noise.ar[0].sum()) ** 2 * step
    # Known by as many errors as there are turns; what they lend to the colour makes it only more.
    few = FOUR_SIGMA * np.sqrt(2.0 / turns)
    assert 1.0 - few <= found / (density + size**2 * PIECE) <= 2.0


def test_white_noise_is_told_from_where_joints_go_their_way() -> None:
    w, near = SCALE * np.random.default_rng(14).standard_normal(ROWS), np.arange(ROWS) % 100 < 12
    rough = white_noise([[w * np.where(near, 5.0, 1.0)]], STEP, usual(1), [[near]])
    few = FOUR_SIGMA / np.sqrt(2.0 * ROWS)
    assert rough.sd[0] == pytest.approx(SCALE, rel=1.1 * few)
    # What white noise sums up to is as loud as its rows; of every turn a piece may be cut.
    pieces = ROWS * 12 // 100 // round(PIECE / STEP) - ROWS // 100
    assert rough.turning[0] == pytest.approx(5.0, rel=FOUR_SIGMA / np.sqrt(2.0 * pieces))


def test_noise_that_is_alike_everywhere_is_hardly_louder_in_turns() -> None:
    e, _ = coloured(np.random.default_rng(12))
    near = np.arange(ROWS) % 100 < 12
    noise, plain = fit_noise([[e]], STEP, usual(1), turning=[[near]]), alone(e)
    pieces = ROWS * 12 // 100 // round(PIECE / STEP)
    assert 1.0 <= noise.turning[0] ** 2 <= 1.0 + FOUR_SIGMA * np.sqrt(2.0 / pieces)
    assert plain.turning[0] == 1.0
    # What little the turns are louder by chance is all that their noise is quietened by.
    chance = np.sqrt(2.0 / near.sum())
    np.testing.assert_allclose(noise.power, plain.power, rtol=FOUR_SIGMA * chance)


def test_errors_in_turns_are_no_colour_of_the_noise() -> None:
    rng = np.random.default_rng(13)
    e, _ = coloured(rng)
    near = np.arange(ROWS) % 100 < 12
    rough = e + near * np.repeat(0.2 * rng.standard_normal(ROWS // 100), 100)
    told, blind = fit_noise([[rough]], STEP, usual(1), turning=[[near]]), alone(rough)
    truth = 1.0 - AR.sum()
    assert abs(1.0 - told.ar.sum() - truth) < 0.5 * abs(1.0 - blind.ar.sum() - truth)


@pytest.mark.parametrize("period", [0.01, 0.02])
def test_what_rows_of_an_autoregression_have_in_common_fades_as_it_is_known_to(
    period: float,
) -> None:
    keep = np.array([0.0, 0.7, -0.4])
    by, dof = np.full(3, 0.3), np.full(3, CERTAIN)
    noise = Noise(np.ones(3), by, dof, keep[:, None], keep=forgotten(STEP))
    lags = np.arange(6)[:, None] * round(period / STEP)
    wanted = 0.09 / (1.0 - keep**2) * keep**lags
    np.testing.assert_allclose(noise.autocovariance(5, period), wanted, rtol=1e-9, atol=1e-15)
