"""The colour of noise, learnt: white stays white, what is coloured is whitened."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from urdyn.identify.noise import Noise
from urdyn.identify.slow import forgotten
from urdyn.tracking.noise import colour as noise

J, PERIOD = 6, 0.01
NOTHING = np.zeros(J)
LONG = 6000  # samples over which noise is averaged
SURE = np.ones(J, dtype=bool)
COMMISSIONED = Noise(np.ones(J), np.ones(J), np.full(J, 100.0), np.zeros((J, 0)))


def heard(residuals, commissioned=COMMISSIONED, period=PERIOD, unknown=NOTHING):
    """The colour after residuals (N, J), of which this much variance is no noise."""
    colour = noise.first(commissioned, 4, period)
    for row in residuals:
        colour = noise.learnt(colour, row, unknown, SURE, period)
    return colour


def test_white_noise_stays_white_and_its_size_is_found():
    rng = np.random.default_rng(0)
    colour = heard(1.1 * rng.standard_normal((6000, J)))
    # Of 6000 samples a standard deviation is known to 1 %; what was commissioned counts for 500.
    np.testing.assert_allclose(colour.scale, 1.1, rtol=0.04)
    assert np.abs(colour.ar).max() < 4.0 / np.sqrt(6000.0)
    assert (colour.slow < 0.25 * colour.scale).all()


def test_samples_that_were_not_there_do_not_count():
    """A joint that stood for an hour is told its noise as soon as one that did not."""
    loud = 3.0 * np.random.default_rng(4).standard_normal((1000, J))
    stood = np.full((LONG, J), np.nan)
    stood[:, 1:] = np.random.default_rng(5).standard_normal((LONG, J - 1))
    at_once, later = heard(loud), heard(np.concatenate([stood, loud]))
    assert later.scale[0] == pytest.approx(at_once.scale[0], rel=0.02)
    assert (
        later.scale[1:] < 0.8 * later.scale[0]
    ).all()  # a look at 500 samples of 6000, and of 1000


def test_what_sets_in_counts_as_noise_at_the_second_look():
    """Until then a change of the arm, which leaves as much, stands out against the noise before."""
    rng = np.random.default_rng(7)
    colour, slow = heard(rng.standard_normal((1250, J))), []
    for row in rng.standard_normal((750, J)) + 2.0:  # a look at the 250th and the 750th
        colour = noise.learnt(colour, row, NOTHING, SURE, PERIOD)
        slow.append(colour.slow)
    # 250 samples of 1750 with an offset of 2: slow noise of 2 sqrt(1 / 8) = .7.
    assert np.max(slow[:-1]) < 0.25 and np.min(slow[-1]) > 0.5


def test_what_is_coloured_is_whitened():
    rng = np.random.default_rng(1)
    left = lfilter([1.0], [1.0, -0.6], rng.standard_normal((10000, J)), axis=0)
    colour = heard(left)
    np.testing.assert_allclose(colour.ar[:, 0], 0.6, atol=0.06)
    white = [
        left[k] - np.einsum("jk,kj->j", colour.ar, left[k - 8 : k][::-1]) for k in range(8, 10000)
    ]
    white = np.array(white)
    alike = np.mean(white[1:] * white[:-1], axis=0) / np.mean(white**2, axis=0)
    assert np.abs(alike).max() < 0.05
    np.testing.assert_allclose(colour.scale, np.std(white, axis=0), rtol=0.05)


def test_what_learning_took_from_the_noise_is_not_taken_for_quiet():
    """Whoever follows noise leaves little of it at low frequencies, and is no surer for that."""
    rng = np.random.default_rng(3)
    heard_of = rng.standard_normal((9000, J))
    followed = lfilter([0.1], [1.0, -0.9], heard_of, axis=0)
    colour = heard(heard_of[1:] - followed[:-1])
    assert (colour.ar.sum(axis=1) > -1e-9).all()
    # White noise of sd 1 stays that, at low frequencies and of one sample.
    assert (colour.scale / (1.0 - colour.ar.sum(axis=1)) > 0.95).all()
    np.testing.assert_allclose(colour.scale, 1.0, atol=0.06)


def test_what_passes_slowly_is_told_from_what_is_quick():
    rng = np.random.default_rng(2)
    colour = heard(slowly(rng, 6000, PERIOD) + rng.standard_normal((6000, J)))
    assert np.median(colour.slow) == pytest.approx(1.0, rel=0.35)


@pytest.mark.parametrize("frequency", [4.0, 8.0, 12.0])
def test_what_swings_is_not_slow_though_it_is_alike_a_quarter_of_a_second_apart(frequency):
    rng, period, rows = np.random.default_rng(6), 0.002, 20000
    swing = np.sqrt(2.0) * np.sin(2.0 * np.pi * frequency * period * np.arange(rows))[:, None]
    colour = heard(swing + rng.standard_normal((rows, J)), period=period)
    assert (colour.slow < 0.25).all()


def followed(rng, give_back):
    """The colour after a minute in which seven parameters were learnt beside slow noise of 1."""
    rows, size = 6000, 8
    t, keep = PERIOD * np.arange(rows), np.exp(-PERIOD / noise.MEMORY)
    waves = [f(w * t) for w in (0.5, 1.1, 1.7) for f in (np.sin, np.cos)]
    H = np.column_stack([np.ones(rows), *waves, np.ones(rows)])  # slow noise last
    y = slowly(rng, rows, PERIOD) + rng.standard_normal((rows, J))
    x, P = np.zeros((size, J)), np.diag([4.0] * (size - 1) + [1.0])
    F = np.diag([1.0] * (size - 1) + [keep])
    colour = noise.first(replace(COMMISSIONED, sd=np.full(J, np.sqrt(2.0))), 4, PERIOD)
    for h, row in zip(H, y, strict=True):
        x, P = F @ x, F @ P @ F
        P[-1, -1] += 1.0 - keep**2
        if give_back and noise.due(colour, PERIOD):
            taken = np.full(J, max(-h[:-1] @ P[:-1, -1], 0.0))
            colour = noise.giving_back(colour, taken, np.full(J, P[-1, -1]), PERIOD)
        colour = noise.learnt(colour, row - h[:-1] @ x[:-1], NOTHING, SURE, PERIOD)
        K = P @ h / (h @ P @ h + 1.0)
        x, P = x + np.outer(K, row - h @ x), P - np.outer(K, h @ P)
    return colour


def test_what_parameters_took_of_slow_noise_is_given_back():
    """They take some of the minute's fifty independent values of it.

    Before it 500 samples are commissioned that tell of none. What twelve joints' variances are in
    the mean, of some 25 degrees of freedom each, scatters by .08.
    """
    expected = 6000.0 / (6000.0 + noise.TRUST)
    lacking, whole = (
        np.mean([followed(np.random.default_rng(seed), back).alike[-1] for seed in range(2)])
        * np.exp(noise.FAR / noise.MEMORY)
        for back in (False, True)
    )
    assert lacking < 0.8 * expected
    assert whole == pytest.approx(expected, abs=0.2)


def test_what_a_model_is_still_learning_is_no_noise():
    """Innovations have the power of the noise, 1, and of doubt about a parameter that strays.

    That is a fifth here. Of 9000 a variance is known to 1.5 %; the mean of six is tested.
    """
    rng, rows, strays = np.random.default_rng(11), 9000, 0.2
    walk = np.cumsum(strays * rng.standard_normal((rows, J)), axis=0)
    found, P = np.zeros(J), 1.0
    told, blind = (noise.first(COMMISSIONED, 4, PERIOD) for _ in range(2))
    for y in walk + rng.standard_normal((rows, J)):
        P += strays**2
        left = y - found
        told = noise.learnt(told, left, NOTHING, SURE, PERIOD)
        if noise.due(told, PERIOD):
            told = noise.doubting(told, np.full(J, P), SURE, PERIOD)
        blind = noise.learnt(blind, left, NOTHING, SURE, PERIOD)
        K = P / (P + 1.0)
        found, P = found + K * left, P - K * P
    assert abs(np.mean(told.scale**2) - 1.0) < 0.03
    assert np.mean(blind.scale**2) > 1.15


def test_what_is_known_to_be_no_noise_is_left_out_of_its_size():
    """Half as much as there is noise; of 6000 the mean of six variances is known to 1 %."""
    more = 0.5
    residuals = np.sqrt(1.0 + more) * np.random.default_rng(12).standard_normal((6000, J))
    colour = heard(residuals, unknown=np.full(J, more))
    assert abs(np.mean(colour.scale**2) - 1.0) < 0.05


def test_doubt_about_slow_noise_is_no_doubt_about_the_model():
    """What lasts comes through the filter that makes noise white as what is doubted of it does."""
    alone, model = np.full(J, 0.4), 0.3
    coloured = replace(COMMISSIONED, ar=np.tile([0.5, 0.2], (J, 1)))
    colour = noise.giving_back(noise.first(coloured, 4, PERIOD), NOTHING, alone, PERIOD)
    lasting = colour
    for _ in range(noise.ORDER + 1):
        _, white, _, lasting = noise.whitened(lasting, np.zeros((J, 4)), np.sqrt(alone), ~SURE)
    for _ in range(200):
        colour = noise.doubting(colour, white**2 + model, SURE, PERIOD)
    np.testing.assert_allclose(colour.modelled, model, rtol=1e-3)


def information(colour, X, y, lost):
    """What whitened rows tell of X (N, J, w) and y (N, J): (J, w, w + 1), and how many do, (J,)."""
    told, rows = 0.0, 0
    for x, value, gone in zip(X, y, lost, strict=True):
        row, seen, sd, colour = noise.whitened(colour, x, np.where(gone, np.nan, value), gone)
        both = np.column_stack([row, seen]).reshape(J, 1, -1)
        told = told + np.nan_to_num(row[..., None] * both) / sd[:, None, None] ** 2
        rows = rows + np.isfinite(seen)
    return told, rows


def test_across_lost_currents_rows_tell_what_the_dense_gaussian_tells():
    """Generalised least squares of all known rows, given as many first ones as the filter takes."""
    rng, rows, p = np.random.default_rng(8), 60, noise.ORDER
    coloured = replace(COMMISSIONED, ar=np.tile([1.2, -0.5, 0.1], (J, 1)))
    X, y = rng.standard_normal((rows, J, 4)), rng.standard_normal((rows, J))
    lost = rng.random((rows, J)) < np.linspace(0.0, 0.5, J)
    lost[:p] = False
    told, compared = information(noise.first(coloured, 4, PERIOD), X, y, lost)
    np.testing.assert_array_equal(compared, (~lost).sum(axis=0) - p)
    apart = np.abs(np.subtract.outer(np.arange(rows), np.arange(rows)))
    C = coloured.autocovariance(rows, PERIOD)[apart, 0]

    def dense(j, at):
        both = np.column_stack([X[at, j], y[at, j]])
        return X[at, j].T @ np.linalg.solve(C[np.ix_(at, at)], both)

    for j in range(J):
        wanted = dense(j, np.flatnonzero(~lost[:, j])) - dense(j, np.arange(p))
        np.testing.assert_allclose(told[j], wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())


def test_noise_is_as_loud_as_said_where_no_eight_currents_come_in_a_row():
    """Of more than 1000 squares a mean is known to sqrt(2 / 1000)."""
    rng, rows = np.random.default_rng(9), 1400
    coloured = replace(COMMISSIONED, ar=np.tile([0.9], (J, 1)))
    y = lfilter([1.0], [1.0, -0.9], rng.standard_normal((rows, J)), axis=0)
    lost = np.zeros((rows, J), dtype=bool)
    lost[3::4] = True
    colour, squares = noise.first(coloured, 4, PERIOD), []
    for value, gone in zip(y, lost, strict=True):
        now = np.where(gone, np.nan, value)
        _, seen, sd, colour = noise.whitened(colour, np.zeros((J, 4)), now, gone)
        squares.append((seen / (sd / colour.scale)) ** 2)
    np.testing.assert_array_equal(np.isfinite(squares[4:]), ~lost[4:])
    np.testing.assert_allclose(np.nanmean(squares, axis=0), 1.0, atol=4.0 * np.sqrt(2.0 / 1000.0))


def slowly(rng, rows, period):
    """Noise of unit variance that forgets itself as slow noise does, (rows, J)."""
    keep = np.exp(-period / noise.MEMORY)
    white = np.sqrt(1.0 - keep**2) * rng.standard_normal((rows, J))
    return lfilter([1.0], [1.0, -keep], white, axis=0)


def test_what_was_slow_on_the_first_day_is_not_forgotten_for_being_little():
    """A share of .08 at 20 Hz: what stands out of chance there is twice as much."""
    rng, period, share = np.random.default_rng(4), 0.05, 0.08
    known = replace(COMMISSIONED, slow=np.full(J, np.sqrt(share)), keep=forgotten(period))
    told = []
    for _ in range(6):
        e = np.sqrt(share) * slowly(rng, 1200, period)
        e += np.sqrt(1.0 - share) * rng.standard_normal(e.shape)
        told.append(heard(e, known, period).slow ** 2)
    assert np.median(told) == pytest.approx(share, rel=0.4)
    assert np.mean(np.array(told) > share / 4) > 0.9  # what stands out of chance alone is .6 of it


@pytest.mark.parametrize("apart", [1, 5, 100])
def test_a_commissioned_colour_is_that_of_fewer_samples_too(apart):
    """Of an AR(1), every fifth value is one with the fifth power of its coefficient."""
    ar, step = 0.8, 0.01
    known = replace(COMMISSIONED, ar=np.full((J, 1), ar), keep=forgotten(step))
    colour = noise.first(known, 4, apart * step)
    np.testing.assert_allclose(colour.ar[:, 0], ar**apart, rtol=1e-9)
    np.testing.assert_allclose(colour.ar[:, 1:], 0.0, atol=1e-9)
    power = known.power / (1.0 - ar**2)
    np.testing.assert_allclose(colour.scale**2, power * (1.0 - ar ** (2 * apart)), rtol=1e-9)


def test_a_commissioned_colour_is_where_it_begins():
    ar = np.tile([0.5, 0.2], (J, 1))
    known = replace(COMMISSIONED, ar=ar)
    colour = noise.first(known, 4, PERIOD)
    np.testing.assert_allclose(colour.ar[:, :2], ar)
    # Yule and Walker's equations of that noise.
    r = colour.alike[:, 0]
    np.testing.assert_allclose(r[1:3], [0.5 * r[0] + 0.2 * r[1], 0.5 * r[1] + 0.2 * r[0]])


def test_silence_teaches_nothing():
    before = noise.first(COMMISSIONED, 4, PERIOD)
    after = heard(np.full((200, J), np.nan))
    np.testing.assert_array_equal(before.alike, after.alike)
    assert np.isfinite(after.scale).all()


@pytest.mark.parametrize("least", [0.2, 2.0])  # below all eigenvalues, and above some
def test_autocovariances_are_inverted_as_if_no_eigenvalue_were_less_than_white(least):
    drawn = np.random.default_rng(7).standard_normal((J, noise.ORDER, noise.ORDER))
    vector = np.linalg.qr(drawn).Q
    value = np.tile(np.linspace(0.5, 5.0, noise.ORDER), (J, 1))
    made, wanted = (
        vector * of[:, None] @ vector.swapaxes(1, 2) for of in (value, 1.0 / np.fmax(value, least))
    )
    found = noise._inverse(0.5 * (made + made.swapaxes(1, 2)), np.full(J, least))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-13)  # of a condition of 10
