"""Settings that make no filter and histories that fit no model are refused, with what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from affine_models import Model, ticks
from bent_models import Product

from urdyn.dbn import AffineObservation, Joined, RandomWalk, Tick, Trend, jumps
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
    expectation_maximisation,
    follow_ramp,
    maximise_evidence,
    parameter_cov,
    posterior_bound,
    ramp_bank,
    ramp_bound,
    ramp_model,
    smooth,
    track,
)
from urdyn.types import Array, Gaussian

JUMPS = jumps(("a", "b"), ["b"], np.ones(1))


def seen_together(noise: float, variances: tuple[float, float] = (1.0, 1.0)) -> Model:
    """a + b, measured with a variance of `noise`."""
    process = RandomWalk(("a", "b"), Gaussian(np.zeros(2), np.diag(variances)), np.zeros(2))
    return Joined(process, AffineObservation(2, lambda u: np.ones((1, 2)), np.array([[noise]])))


def nothing() -> Model:
    """No state, and a sensor."""
    process = RandomWalk((), Gaussian(np.zeros(0), np.zeros((0, 0))), np.zeros(0))
    return Joined(process, AffineObservation(0, lambda u: np.zeros((1, 0)), np.eye(1)))


MODEL, SEEN = seen_together(1.0), np.ones((3, 1))


def climb(**settings: Any) -> object:
    return expectation_maximisation(
        1.0, lambda _: MODEL, lambda one, _: one, ticks(3), SEEN, **settings
    )


@pytest.mark.parametrize(
    "filter_, settings",
    [
        (ParticleFilter, {"count": 0}),
        (ParticleFilter, {"count": 2.5}),
        (ParticleFilter, {"threshold": 2.0}),
        (ParticleFilter, {"threshold": np.nan}),
        (ParticleFilter, {"seed": -1}),
        (ParticleFilter, {"kept": 1.1}),
        (UKF, {"alpha": 0.0}),
        (UKF, {"alpha": 0.5, "rule": "simplex"}),
        (UKF, {"beta": np.inf}),
        (UKF, {"kappa": np.nan}),
        (ParticleFilter, {"seed": 1.5}),
        *((EKF, {"iterations": count}) for count in (0, 1.5, "2")),
        *((FixedLag, {"lag": lag}) for lag in (-1, 1.5)),
        *((Variational, {"iterations": count}) for count in (0, 1.5)),
        *((Variational, {"tolerance": limit}) for limit in (-1.0, np.nan)),
        (Consider, {"learnt": "ab"}),
        *((Variational, {"step_size": size}) for size in (0.0, -1.0, 2.0, np.nan)),
        *((Bank, {"hazard": hazard, "jumps": JUMPS}) for hazard in (0.0, 1.0, -0.1, np.nan)),
        *((Bank, {"onsets": count, "jumps": JUMPS}) for count in (0, 1, 1.5)),
        (Bank, {"spacing": 0, "jumps": JUMPS}),
        *((ramp_bank, {"expected": k, "sigma": 0.1}) for k in (0.0, -1.0, 1.0, np.inf)),
        *((ramp_bank, {"steepest": s, "sigma": 0.1}) for s in (0.0, -1.0, np.nan)),
    ],
)
def test_settings_that_make_no_filter_are_refused(filter_: Any, settings: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(settings))):
        filter_(**settings)


@pytest.mark.parametrize(
    "filter_, model, said",
    [
        (Kalman(), Product(), "gain"),
        (UKF(kappa=-2.0), MODEL, "kappa -2.0: with 2 states it has to be above -2"),
        (UKF(alpha=1e-9), MODEL, "alpha 1e-09: rounding leaves no spread"),
        (UKF(), nothing(), "a model without states has no sigma points; use Kalman"),
        (Consider(frozenset({"c"})), MODEL, "no state c; there are a, b"),
        (Bank(jumps(("a",), ["a"], np.ones(1))), MODEL, "jumps are of 1 states and .* 2: a, b"),
        (Variational(), seen_together(1.0, (0.0, 1.0)), "a has no variance"),
        (Variational(), seen_together(0.0), "sensor has noise"),
        (InformationFilter(), seen_together(0.0), "sensor 0 has no variance"),
        *(
            (filter_, seen_together(0.0, (0.0, 0.0)), "sensor has noise")
            for filter_ in (
                Kalman(),
                EKF(),
                UKF(),
                FixedLag(),
                Variational(),
                ParticleFilter(9),
                Bank(JUMPS),
            )
        ),
    ],
)
def test_a_model_that_is_not_the_filters_is_refused(filter_: Any, model: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        track(filter_, model, ticks(1), SEEN[:1])


def run(inputs: list[Tick], observations: Array) -> object:
    return track(Kalman(), MODEL, inputs, observations)


def smoothed(inputs: list[Tick], observations: Array) -> object:
    return smooth(MODEL, inputs, observations)


@pytest.mark.parametrize("over", [run, smoothed])
@pytest.mark.parametrize(
    "inputs, observations, said",
    [
        (ticks(3), SEEN[:2], "2 observations and more inputs"),
        (ticks(2), SEEN, "2 inputs and more observations"),
        (ticks(3), SEEN[:, 0], r"observation 0 has the shape \(\)"),
        (ticks(3), np.ones((3, 2)), r"observation 0 has the shape \(2,\); the model's is \(1,\)"),
        ([Tick(), Tick(-1.0), Tick()], SEEN, "slice 1 has dt -1.0"),
        ([Tick(np.nan)] * 3, SEEN, "slice 0 has dt nan"),
    ],
)
def test_a_history_that_fits_no_model_is_refused(
    over: Callable[..., object], inputs: list[Tick], observations: Array, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        over(inputs, observations)


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda: follow_ramp(np.zeros((4, 1)), 0.1), "observation 0 has the shape"),
        (lambda: follow_ramp(np.zeros(4), 0.1, steepest=0.0), "steepest"),
        (lambda: follow_ramp(np.zeros(4), 0.1, level=1.0), "prior 1.0: takes a Gaussian"),  # type: ignore[arg-type]
        (lambda: follow_ramp(np.zeros(4), 0.1, level=MODEL.prior), r"mean has the shape \(2,\)"),
        (lambda: ramp_bank(0.1, names=("g", "g.rate")), "no state f.rate; did you mean g.rate"),
        (lambda: follow_ramp(["a"], 0.1), "readings y holds text"),  # type: ignore[arg-type]
        (lambda: follow_ramp(np.zeros(4), "a"), "sigma a: takes"),  # type: ignore[arg-type]
        (lambda: follow_ramp(np.zeros(4), np.ones(2)), "sigma .* takes"),  # type: ignore[arg-type]
        (lambda: follow_ramp(np.zeros(4), 0.1, np.ones(2)), "direction .* takes"),  # type: ignore[arg-type]
        (lambda: ramp_model(-1.0), "sigma -1.0: takes"),
        (lambda: ramp_bound(0.0, 3, 5, 1.0, 1.0), "sigma"),
        (lambda: ramp_bound(1.0, 3, -3, 1.0, 1.0), "steps -3: takes a whole number"),
        (lambda: ramp_bound(1.0, np.nan, 5, 1.0, 1.0), "onset nan"),
        (lambda: ramp_bound(1.0, 3, 5, -1.0, 1.0), "level_sd -1.0: takes"),
        (lambda: ramp_bound(1.0, 3, 5, 1.0, np.inf), "rate_sd inf: takes"),
        (lambda: ramp_bound(1.0, 3, 5, 1.0, 1.0, onset_sd=-1.0), "onset_sd -1.0: takes"),
        (lambda: posterior_bound(MODEL, ticks(3), SEEN[:2]), "observations have the shape"),
        (lambda: posterior_bound(MODEL, ticks(3), np.ones((3, 2))), "observations have the shape"),
        (lambda: posterior_bound(MODEL, ticks(3), lives=np.ones((3, 1, 1))), "lives have"),
        (
            lambda: posterior_bound(MODEL, ticks(3), lives=np.ones((2, 1, 2))),
            "lives have the shape",
        ),
        (lambda: posterior_bound(MODEL, ticks(3), lives=np.ones((3, 0, 2))), r"is \(3, 1, 2\)"),
        (lambda: posterior_bound(seen_together(0.0), ticks(3)), "sensor has noise"),
        (lambda: climb(iterations=0), "iterations 0: takes a whole number, 1 or more"),
        (lambda: climb(tolerance=-1.0), "tolerance -1.0: takes a finite number, 0 or more"),
        (lambda: parameter_cov(np.eye(2), lambda _: MODEL, ticks(3), SEEN), "^at "),
        (lambda: maximise_evidence(np.eye(2), lambda _: MODEL, ticks(3), SEEN), "^start "),
        (lambda: posterior_bound(MODEL, ticks(3))["c"], "no state c"),
    ],
)
def test_what_is_asked_of_nothing_is_refused(asked: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        asked()


@dataclass(frozen=True, eq=False)
class Strange:
    """A sensor of a and b that does not say alike how many readings it has, or what they are."""

    seen: Array  # what is expected of them
    H: Array
    R: Array

    linear = np.ones(2, dtype=bool)

    def observe(self, x: Array, u: Tick) -> Array:
        return np.broadcast_to(self.seen, x.shape[:-1] + self.seen.shape)

    def observe_jacobian(self, x: Array, u: Tick) -> Array:
        return self.H

    def observe_cov(self, u: Tick) -> Array:
        return self.R


FILTERS = (Kalman(), EKF(), UKF(), InformationFilter(), FixedLag(), Variational(), Bank(JUMPS))
ONE, TWO = np.ones((1, 2)), np.ones((2, 2))


@pytest.mark.parametrize("filter_", [*FILTERS, ParticleFilter(9), Consider()])
@pytest.mark.parametrize(
    "seen, H, R, y, said",
    [
        (np.ones(2), TWO, np.eye(1), np.ones(1), r"R has the shape \(1, 1\); .* it is \(2, 2\)"),
        (np.ones(1), ONE, np.eye(2), np.ones(2), r"R has the shape \(2, 2\); .* it is \(1, 1\)"),
        (np.ones(2), TWO, np.eye(2), np.ones(1), r"y has the shape \(1,\); .* has \(2,\)"),
    ],
)
def test_readings_that_are_not_those_expected_are_refused(
    filter_: Any, seen: Array, H: Array, R: Array, y: Array, said: str
) -> None:
    """Broadcasting would count one reading twice."""
    model = Joined(MODEL.process, Strange(seen, H, R))
    with pytest.raises(InputError, match=said):
        filter_.step(model, filter_.init(model), Tick(), y)


@pytest.mark.parametrize("filter_", [Kalman(), EKF(), InformationFilter(), FixedLag()])
def test_a_jacobian_of_other_states_is_refused(filter_: Any) -> None:
    model = Joined(MODEL.process, Strange(np.ones(1), np.ones(2), np.eye(1)))
    with pytest.raises(InputError, match=r"H has the shape \(2,\); here it has to be \(1, 2\)"):
        track(filter_, model, ticks(1), SEEN[:1])


@pytest.mark.parametrize("filter_", [Kalman(), EKF(), InformationFilter(), FixedLag()])
def test_a_jacobian_of_other_states_is_refused_beside_rates(filter_: Any) -> None:
    one = np.ones(1)
    process = Trend(("a", "b"), MODEL.prior, np.zeros(2), np.array([0]), one, one)
    model = Joined(process, Strange(one, np.ones((1, 1)), np.eye(1)))
    with pytest.raises(InputError, match=r"H has the shape \(1, 1\); 2 states are observed"):
        track(filter_, model, ticks(1), SEEN[:1])


@pytest.mark.parametrize("filter_", [*FILTERS, Consider(frozenset({"a"}))])
@pytest.mark.parametrize("slope", [1.0, np.nan])
def test_a_model_that_gives_no_number_is_told(filter_: Any, slope: float) -> None:
    strange = Strange(np.array([np.nan]), slope * ONE, np.eye(1))
    with pytest.raises(InputError, match="the belief is no longer finite"):
        track(filter_, Joined(MODEL.process, strange), ticks(1), SEEN[:1])


@pytest.mark.parametrize("filter_", [EKF(), EKF(5), UKF(), UKF("simplex"), Variational()])
def test_a_reading_that_leads_a_belief_nowhere_is_told(filter_: Any) -> None:
    far = pytest.raises(InputError, match="the belief is no longer finite")
    with far, np.errstate(all="ignore"):  # the model's own exponential
        track(filter_, Product(), ticks(3), np.array([[1.0, 1.0], [1e6, 1.0], [1.0, 1.0]]))


@pytest.mark.parametrize("filter_", [Kalman(), EKF(), UKF(), FixedLag(), Consider({"a", "b"})])
def test_a_sensor_of_infinite_noise_says_nothing(filter_: Any) -> None:
    deaf = Joined(MODEL.process, Strange(np.zeros(2), np.eye(2), np.diag([np.inf, 1.0])))
    half = Joined(MODEL.process, Strange(np.zeros(2), np.eye(2), np.eye(2)))
    silent = track(filter_, half, ticks(3), np.array([[np.nan, 1.0]] * 3))
    told = track(filter_, deaf, ticks(3), np.array([[5.0, 1.0]] * 3))
    np.testing.assert_allclose(told.mean, silent.mean, atol=1e-12)
    np.testing.assert_allclose(told.sd, silent.sd, atol=1e-12)


@pytest.mark.parametrize(
    "reading, said", [(1e12, "no likeliest setting"), (np.nan, r"d\[0\] is nan: takes finite")]
)
def test_a_search_that_finds_nothing_says_so(reading: float, said: str) -> None:
    """The likeliest offset is too far away, in thousandths, or nowhere."""

    def offset(setting: Array) -> Model:
        process = RandomWalk(("x",), Gaussian(np.zeros(1), np.eye(1)), np.zeros(1))
        seen = AffineObservation[Tick](1, lambda u: np.eye(1), np.eye(1), setting - reading)
        return Joined(process, seen)

    with pytest.raises(InputError, match=said):
        maximise_evidence(np.zeros(1), offset, ticks(3), np.zeros((3, 1)), scale=1e-3)
    with pytest.raises(InputError, match="scale"):
        maximise_evidence(np.zeros(1), offset, ticks(3), np.zeros((3, 1)), scale=0.0)


@pytest.mark.parametrize("filter_", [Kalman(), EKF(), UKF(), FixedLag(), None])
@pytest.mark.parametrize("vague", [1e8, 1e9])
def test_a_prior_too_vague_for_its_digits_is_no_certainty(filter_: Any, vague: float) -> None:
    """Two directions are seen, and one after the other is known to 1 beside `vague`."""
    prior = Gaussian(np.zeros(2), vague**2 * np.eye(2))
    seen = AffineObservation[Tick](2, lambda u: np.array([[1.0, u.dt]]), np.eye(1))
    model, inputs = Joined(RandomWalk(("a", "b"), prior, np.zeros(2)), seen), [Tick(1.0), Tick(2.0)]
    with pytest.raises(InputError, match="a prior that is less vague, or InformationFilter"):
        if filter_ is None:
            posterior_bound(model, inputs)
        track(filter_, model, inputs, np.ones((2, 1)))
    sd = track(InformationFilter(), model, inputs, np.ones((2, 1))).sd[-1]
    np.testing.assert_allclose(sd, np.sqrt([5.0, 2.0]), rtol=1e-9)


def test_steps_may_be_written_with_a_point() -> None:
    assert ramp_bound(1.0, 3, 5.0, 1.0, 1.0).shape == (5,)  # type: ignore[arg-type]


def test_states_that_are_learnt_may_be_listed() -> None:
    assert Consider(["a"]) == Consider(frozenset({"a"}))  # type: ignore[arg-type]
