"""Laws of every filter: streaming is batch, NaN is absence, covariances stay positive."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from affine_models import EXACT, Model, Regressors, random_model, simulate, ticks

from urdyn.dbn import AffineObservation, Joined, RandomWalk, Tick, jumps
from urdyn.errors import InputError
from urdyn.estimate import (
    EKF,
    UKF,
    Bank,
    Consider,
    FixedLag,
    InformationFilter,
    Kalman,
    ParticleFilter,
    Variational,
    smooth,
    track,
)
from urdyn.types import Array, Gaussian

ALL = [
    *EXACT,
    Consider(frozenset({"x0"})),
    ParticleFilter(200, marginalise=False),
    Bank(jumps(("x0", "x1", "x2", "x3"), ["x1"], np.array([0.5, 1.0])), onsets=6, spacing=2),
]


NO_JUMP = jumps(tuple("abc"), ["a"], np.zeros(1))


def still(mean: Array, cov: Array, H: Array, R: Array) -> Model:
    """Nothing moves."""
    names = tuple("abc"[: len(mean)])
    process = RandomWalk(names, Gaussian(mean, cov), np.zeros(len(mean)))
    return Joined(process, AffineObservation(len(mean), lambda u: H, R))


@pytest.mark.parametrize("filter_", ALL, ids=lambda f: type(f).__name__)
def test_streaming_is_batch(filter_: Any) -> None:
    rng = np.random.default_rng(5)
    model = random_model(rng, 4, 2)
    observations = simulate(model, ticks(30), rng)[1]
    batch = track(filter_, model, ticks(30), observations)
    state = filter_.init(model)
    for y, mean, innovation in zip(observations, batch.mean, batch.innovations, strict=True):
        state, surprise = filter_.step(model, state, Tick(), y)
        np.testing.assert_array_equal(filter_.belief(state).mean, mean)
        assert surprise.log_likelihood == innovation.log_likelihood


@pytest.mark.parametrize("filter_", ALL, ids=lambda f: type(f).__name__)
def test_rows_that_were_not_measured_are_rows_that_do_not_exist(filter_: Any) -> None:
    rng = np.random.default_rng(6)
    whole = random_model(rng, 4, 3)
    observations = simulate(whole, ticks(20), rng)[1]
    H, R = whole.observe_jacobian(whole.prior.mean, Tick()), whole.observe_cov(Tick())
    d = whole.observe(np.zeros(4), Tick())
    part = Joined(
        whole.process,
        AffineObservation(4, lambda u: H[[0, 2]], R[np.ix_([0, 2], [0, 2])], d[[0, 2]]),
    )
    holed = observations.copy()
    holed[:, 1] = np.nan
    found = track(filter_, whole, ticks(20), holed)
    wanted = track(filter_, part, ticks(20), observations[:, [0, 2]])
    np.testing.assert_allclose(found.mean, wanted.mean, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(found.sd, wanted.sd, rtol=1e-8)
    assert found.log_likelihood == pytest.approx(wanted.log_likelihood)
    assert found.innovations[0].measured == 2
    assert (
        np.isnan(found.innovations[0].residual[1]) and np.isnan(found.innovations[0].cov[1]).all()
    )


@pytest.mark.parametrize("filter_", ALL, ids=lambda f: type(f).__name__)
def test_a_slice_without_any_measurement_is_a_prediction(filter_: Any) -> None:
    rng = np.random.default_rng(7)
    model = random_model(rng, 4, 2)
    state = filter_.init(model)
    before = filter_.belief(state)
    state, surprise = filter_.step(model, state, Tick(), np.full(2, np.nan))
    after = filter_.belief(state)
    if not isinstance(filter_, (ParticleFilter, Bank)):
        F = model.transition_jacobian(before.mean, Tick())
        np.testing.assert_allclose(after.mean, model.transition(before.mean, Tick()))
        np.testing.assert_allclose(after.cov, F @ before.cov @ F.T + model.transition_cov(Tick()))
    assert (surprise.measured, surprise.nis, surprise.log_likelihood) == (0, 0.0, 0.0)


STEPS = 100_000
STIFF = np.geomspace(1e-9, 1e6, 4)  # prior variances


@pytest.mark.parametrize(
    "filter_, steps",
    [
        *(pytest.param(f, STEPS, marks=pytest.mark.slow) for f in (Kalman(), UKF())),
        (Kalman(), STEPS // 20),
        (UKF(), STEPS // 20),
        (UKF("merwe", alpha=1e-2), STEPS // 20),
        (Variational(), STEPS // 20),
        (InformationFilter(), STEPS // 20),
        (Consider(frozenset({"a", "c"})), STEPS // 20),
    ],
    ids=lambda f: type(f).__name__,
)
def test_covariance_stays_positive_definite_under_a_stiff_prior(filter_: Any, steps: int) -> None:
    """Mostly one direction is seen, at times another, and at times nothing."""
    rng = np.random.default_rng(8)
    prior = Gaussian(np.zeros(4), np.diag(STIFF))
    model: Joined[Regressors] = Joined(
        RandomWalk(tuple("abcd"), prior, 1e-7 * np.sqrt(STIFF)),
        AffineObservation(4, lambda u: u.Y, 1e-6 * np.eye(2)),
    )
    usual = rng.standard_normal((2, 4))
    state, worst = filter_.init(model), 1.0
    for k in range(steps):
        Y = rng.standard_normal((2, 4)) if k % 50 == 0 else usual
        y = 1e-3 * rng.standard_normal(2)
        if k % 7 == 0:
            y[0] = np.nan
        state, _ = filter_.step(model, state, Regressors(Y), y)
        if k % 100 == 0:
            worst = min(worst, _smallest_correlation_eigenvalue(filter_.belief(state).cov))
    assert worst > 0.0


def _smallest_correlation_eigenvalue(cov: Array) -> float:
    np.testing.assert_allclose(cov, cov.T, rtol=1e-12, atol=0)
    scale = np.sqrt(np.diag(cov))
    return float(np.linalg.eigvalsh(cov / np.outer(scale, scale))[0])


def test_the_information_of_a_log_does_not_depend_on_its_order() -> None:
    rng = np.random.default_rng(9)
    prior = Gaussian(np.zeros(3), np.eye(3))
    model: Joined[Regressors] = Joined(
        RandomWalk(tuple("abc"), prior, np.zeros(3)),
        AffineObservation(3, lambda u: u.Y, 0.1 * np.eye(1)),
    )
    rows = [Regressors(rng.standard_normal((1, 3))) for _ in range(50)]
    y = rng.standard_normal((50, 1))
    forwards = track(InformationFilter(), model, rows, y)
    backwards = track(InformationFilter(), model, rows[::-1], y[::-1])
    np.testing.assert_allclose(forwards.mean[-1], backwards.mean[-1], rtol=1e-9)
    stacked = np.vstack([u.Y for u in rows])
    dense = np.linalg.inv(np.eye(3) + stacked.T @ stacked / 0.1)
    np.testing.assert_allclose(forwards.mean[-1], dense @ stacked.T @ y[:, 0] / 0.1, rtol=1e-9)


def test_an_information_filter_is_kalmans_beside_precise_sensors() -> None:
    """Which know two of three directions to a millionth of the prior's sd.

    The prior's precision is 1e-12 of the greatest, in sums rounded by 1e-16 of that and a few times
    over: the third direction is known to a thousandth of its sd, and the others as well as ever.
    """
    rng, noise = np.random.default_rng(10), 1e-6
    H, y = rng.standard_normal((2, 3)), rng.standard_normal((1, 2))
    model = still(rng.standard_normal(3), np.eye(3), H, noise**2 * np.eye(2))
    found, wanted = (track(f, model, ticks(1), y) for f in (InformationFilter(), Kalman()))
    np.testing.assert_allclose(found.mean, wanted.mean, atol=1e-3)
    np.testing.assert_allclose(found.mean @ H.T, wanted.mean @ H.T, atol=1e-3 * noise)


@pytest.mark.parametrize("seed", range(30))
def test_the_information_filter_is_kalmans_or_refuses(seed: int) -> None:
    """Some states, sensors or combinations have no variance, of which a precision says nothing."""
    rng = np.random.default_rng(seed)
    known, exact, tied = rng.random(3) < 0.3
    root = np.diag(rng.uniform(0.5, 2.0, 3)) + np.array([[0, 0, 0], [0, 0, 0], [0, 2, 0]])
    root[0, 0] *= not known
    root[2, 2] *= not tied
    R = np.diag([0.0 if exact else 0.3, 0.2])
    model = still(rng.standard_normal(3), root @ root.T, rng.standard_normal((2, 3)), R)
    y = rng.standard_normal((1, 2))
    if known or exact or tied:
        named = "a has" if known else "combination" if tied else "sensor 0"
        with pytest.raises(InputError, match=f"{named}.* use Kalman"):
            track(InformationFilter(), model, ticks(1), y)
        return
    found, wanted = (track(f, model, ticks(1), y) for f in (InformationFilter(), Kalman()))
    np.testing.assert_allclose(found.mean, wanted.mean, rtol=1e-9)
    np.testing.assert_allclose(found.sd, wanted.sd, rtol=1e-9)


@pytest.mark.parametrize("filter_", [Kalman(), EKF(), UKF(), FixedLag(0), Bank(NO_JUMP)])
@pytest.mark.parametrize("seed", range(10))
def test_what_is_measured_without_noise_is_known(filter_: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    H = rng.standard_normal((2, 3))
    model = still(rng.standard_normal(3), np.diag(rng.uniform(0.1, 9.0, 3)), H, 0.0 * np.eye(2))
    wandering = Joined(
        RandomWalk(tuple("abc"), model.prior, np.array([0.1, 0.3, 1.0])), model.observation
    )
    y = rng.standard_normal((6, 2))
    found = track(filter_, wandering, ticks(6), y)
    np.testing.assert_allclose(found.mean @ H.T, y, rtol=1e-7, atol=1e-7)
    assert np.isfinite(found.sd).all()
    assert np.isfinite(smooth(wandering, ticks(6), y)[0].sd).all()


def test_a_fixed_lag_goes_back_over_what_is_known() -> None:
    """a + b = 8 without noise: half of the variance is left, and nothing that moves."""
    model = still(np.array([5.0, 1.0]), np.eye(2), np.ones((1, 2)), np.zeros((1, 1)))
    found = track(FixedLag(2), model, ticks(2), np.array([[8.0], [np.nan]]))
    np.testing.assert_allclose(found.mean[-1], [6.0, 2.0])
    np.testing.assert_allclose(found.sd[-1], np.sqrt(0.5))


def test_what_is_considered_keeps_its_mean_and_its_doubt() -> None:
    rng = np.random.default_rng(10)
    model = random_model(rng, 3, 2)
    observations = simulate(model, ticks(20), rng)[1]
    held = track(Consider(), model, ticks(20), observations)
    x = model.prior.mean
    for mean in held.mean:
        x = model.transition(x, Tick())
        np.testing.assert_allclose(mean, x)


@pytest.mark.parametrize("filter_", EXACT, ids=lambda f: type(f).__name__)
def test_a_track_keeps_covariances_where_asked(filter_: Any) -> None:
    """Those of the beliefs, slice by slice; a track of no slices has none of the same shape."""
    rng = np.random.default_rng(6)
    model = random_model(rng, 3, 2)
    observations = simulate(model, ticks(12), rng)[1]
    found = track(filter_, model, ticks(12), observations, covariances=True)
    assert track(filter_, model, ticks(12), observations).cov is None
    assert found.cov is not None and found.cov.shape == (12, len(model.names), len(model.names))
    np.testing.assert_array_equal(np.sqrt(np.diagonal(found.cov, axis1=1, axis2=2)), found.sd)
    last = track(filter_, model, ticks(7), observations[:7], covariances=True)
    assert last.cov is not None
    np.testing.assert_array_equal(last.cov[-1], found.cov[6])
    none = track(filter_, model, [], [], covariances=True)
    assert none.cov is not None and none.cov.shape == (0, *found.cov.shape[1:])


def test_a_track_knows_its_names_and_times() -> None:
    rng = np.random.default_rng(14)
    model = random_model(rng, 3, 2)
    inputs = [Tick(0.0), Tick(0.5), Tick(0.25)]
    found = track(Kalman(), model, inputs, simulate(model, inputs, rng)[1])
    np.testing.assert_allclose(found.t, [0.0, 0.5, 0.75])
    np.testing.assert_array_equal(found["x1"], found.mean[:, 1])
    assert len(found) == 3 and found.names == model.names
    with pytest.raises(InputError, match="no state x9; there are x0, x1"):
        found["x9"]
