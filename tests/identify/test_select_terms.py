"""A term is in the model if it is in the joint, and not otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from urdyn.identify import Noise, identify
from urdyn.identify.compress import compress
from urdyn.identify.design import standing, turning
from urdyn.identify.excerpt import folds
from urdyn.identify.map_estimate import build_problem, posterior, prior_information, solve
from urdyn.identify.search import Run, _select, _shape, _start, _with_noise
from urdyn.identify.select import _evidence, _linear, _without, select_terms
from urdyn.identify.unknowns import Unknowns
from urdyn.model.arm import Arm, load_arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import OPTIONAL, STRIBECK_VELOCITY, population
from urdyn.progress import silent
from urdyn.signal import condition
from urdyn.simulate import Payload, fourier, observe, simulate, typical_sensors, virtual_arm
from urdyn.types import Array, Motion

NOTHING: tuple[frozenset[str], ...] = (frozenset(),) * 6
WITH_TERM = np.array([True, False, True, True, False, False])
FADES = 0.4  # of Coulomb friction, by which it falls with speed


def planted(arm: Arm, seed: int, share: float) -> Dynamics:
    """A virtual arm, some joints of which have friction that fades with speed.

    It fades well within the speeds of the run, else it could not be told from viscous friction.
    """
    drawn = virtual_arm(arm, seed)
    stribeck = share * drawn.drive.coulomb * WITH_TERM
    speed = np.full(6, STRIBECK_VELOCITY)
    return replace(drawn, drive=replace(drawn.drive, stribeck=stribeck, stribeck_velocity=speed))


def excited(point: Dynamics, seed: int, sd: Array) -> Motion:
    """Thirty seconds at 100 Hz with white noise on the current."""
    rng = np.random.default_rng(seed)
    trajectory = fourier(point.arm, 30.0, 100.0, rng)
    going = trajectory.at(trajectory.t)
    warm = np.linspace(25.0, 40.0, len(going))[:, None] + np.zeros(6)
    going = replace(going, temperature=warm)
    return replace(going, current=point.current(going) + sd * rng.standard_normal(going.q.shape))


def selected(point: Dynamics, seed: int) -> tuple[frozenset[str], ...]:
    """Terms chosen at the true point."""
    sd = typical_sensors(point.arm).current_noise
    noise = Noise(sd, sd, np.full(6, 1e9), np.zeros((6, 0)))
    unknowns = Unknowns(population(point.arm), (OPTIONAL,) * 6, gain=point.drive.gain)
    cut = [compress(point, part, noise) for part in folds(excited(point, seed, sd), 6)]
    return select_terms(unknowns, cut, point, unknowns.score(point, ()))


@pytest.mark.parametrize("seed", range(3))
def test_friction_that_fades_with_speed_is_found_where_it_is(seed: int, ur5e: Arm) -> None:
    wanted = tuple(frozenset({"stribeck"} if there else ()) for there in WITH_TERM)
    assert selected(planted(ur5e, seed, FADES), seed) == wanted


def test_evidence_is_the_likelihood_whatever_the_scores() -> None:
    """A z - b has unit noise, z unit scatter: so b scatters by 1 + A A^T."""
    rng, left = np.random.default_rng(5), [0, 2, 3]
    folds_ = [(rng.standard_normal((9, 5)), rng.standard_normal(9)) for _ in range(3)]
    A, b = (np.concatenate(part) for part in zip(*folds_, strict=True))
    whole = multivariate_normal(cov=np.eye(27) + A @ A.T).logpdf(b)
    less = multivariate_normal(cov=np.eye(27) + A[:, left] @ A[:, left].T).logpdf(b)
    gain = _evidence(folds_) - _evidence(_without(folds_, {1, 4}))
    assert gain == pytest.approx(whole - less)


def test_terms_are_chosen_by_the_prior_that_the_fit_has(ur5e: Arm) -> None:
    """About its maximum the linear problem has that maximum, with a tool that nobody named, too."""
    bare = virtual_arm(ur5e, 0, Payload(2.0, np.array([0.0, 0.0, 0.1])))
    links = np.vstack([bare.inertials[:-1], bare.inertials[-1] + bare.payload])
    point = replace(bare, inertials=links, payload=np.zeros(10))
    sd = typical_sensors(ur5e).current_noise
    noise = Noise(sd, sd, np.full(6, 1e9), np.zeros((6, 0)))
    unknowns = Unknowns(population(ur5e), NOTHING)
    data = compress(point, excited(point, 0, sd).slice(0, 1000), noise)
    problem = build_problem(unknowns, data, point)
    z = solve(problem, unknowns.score(point, ()))
    A, b = _linear(unknowns, data, point, z)
    known = prior_information(unknowns.contradictable, z)
    found = np.linalg.solve(A.T @ A + np.eye(len(z)), A.T @ b) / np.sqrt(known)
    assert np.abs((found - z) / posterior(problem, z).sd).max() < 1e-3
    assert known.min() < 0.2


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_found_where_there_is_nothing(seed: int, ur5e: Arm) -> None:
    assert selected(planted(ur5e, seed, 0.0), seed) == NOTHING


@pytest.mark.parametrize(
    ("terms", "share"), [(("ripple_cos", "ripple_sin"), 0.1), (("thermal",), 0.02)]
)
def test_ripple_and_warmth_are_found_and_taken_for_nothing_else(
    terms: tuple[str, ...], share: float, ur5e: Arm
) -> None:
    plain = virtual_arm(ur5e, 2)
    size = share * (plain.drive.viscous if terms == ("thermal",) else plain.drive.coulomb)
    point = replace(plain, drive=replace(plain.drive, **dict.fromkeys(terms, size)))
    assert selected(point, 2) == (frozenset(terms),) * 6


@pytest.mark.parametrize(("over", "sought"), [(1.0, False), (15.0, True), (np.nan, False)])
def test_warmth_is_sought_only_where_temperatures_vary_more_than_friction_does_without(
    over: float, sought: bool, ur5e: Arm
) -> None:
    """Two runs a kelvin apart differ in friction anyway; in the others it is the kind's."""
    motion = excited(planted(ur5e, 2, 0.0), 2, np.zeros(6)).slice(0, 300)
    apart = np.where(np.arange(6) < 3, over, 0.0)
    warmer = replace(motion, temperature=motion.temperature + apart)
    terms = _start(ur5e, [Run(motion), Run(warmer)], None, np.zeros(10)).unknowns.terms
    assert ["thermal" in of for of in terms] == [sought] * 3 + [False] * 3


def sticking(point: Dynamics, seed: int) -> list[Run]:
    """Joints that half of the friction they slide with holds for 30 ms after they turned round."""
    rng = np.random.default_rng(seed)
    trajectory = fourier(point.arm, 20.0, 250.0, rng)
    going = trajectory.at(trajectory.t)
    way, t = np.sign(going.v), going.t[:, None]
    turns = np.diff(way, axis=0, prepend=way[:1]) != 0.0
    stuck = t - np.maximum.accumulate(np.where(turns, t, -np.inf)) < 0.03
    held = 0.5 * stuck * way * point.drive.coulomb / point.drive.gain
    noise = typical_sensors(point.arm).current_noise * rng.standard_normal(way.shape)
    return [Run(replace(going, current=point.current(going) - held + noise))]


def test_a_joint_that_sticks_as_it_turns_has_no_friction_that_fades(ur5e: Arm) -> None:
    point = planted(ur5e, 4, FADES)
    runs = sticking(point, 4)
    shaped = _shape(_start(ur5e, runs, point.drive.gain, np.zeros(10)), runs, silent)
    found = _select(_with_noise(shaped, runs), runs).unknowns.terms
    assert [("stribeck" in terms) for terms in found] == WITH_TERM.tolist()


def test_what_happens_in_turns_alone_is_no_term(ur5e: Arm) -> None:
    """Not even where their noise is thought to be no louder than any other."""
    point = planted(ur5e, 4, 0.0)
    sound = excited(point, 4, typical_sensors(ur5e).current_noise)
    stick = np.sign(sound.v) * point.drive.coulomb / point.drive.gain
    held = replace(sound, current=sound.current - 0.5 * stick * turning(sound, standing(sound)))
    start = _start(ur5e, [Run(sound)], point.drive.gain, np.zeros(10))
    there = replace(start, z=start.unknowns.score(point, ()))
    state = _with_noise(there, [Run(sound)], plain=True)
    assert _select(state, [Run(held)]).unknowns.terms == NOTHING


@pytest.mark.slow
def test_the_whole_search_finds_them(ur5e: Arm) -> None:
    point, rng = planted(ur5e, 4, FADES), np.random.default_rng(4)
    trajectory = fourier(ur5e, 30.0, 100.0, rng)
    log = observe(point, trajectory, typical_sensors(ur5e), rng)
    fit = identify(ur5e, condition(log), gain=point.drive.gain)
    assert [("stribeck" in terms) for terms in fit.terms] == WITH_TERM.tolist()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [106, 112])
def test_friction_of_these_arms_fades_by_chance_alone(seed: int) -> None:
    """Two of forty at random: what is held out tells 9 and 14 nats, had the fit no doubt."""
    drawn = virtual_arm(load_arm("ur10e"), seed)
    motion, noise = (np.random.default_rng([seed, 0, k]) for k in range(2))
    asked = fourier(drawn.arm, 25.0, 100.0, motion)
    log = observe(drawn, asked, typical_sensors(drawn.arm), noise)
    assert identify(drawn.arm, condition(log), gain=drawn.drive.gain).terms == NOTHING


@pytest.mark.slow
def test_a_program_with_rests_has_no_friction_that_fades(ur5e: Arm) -> None:
    """Nor does what holds its joints make friction at rest, or presliding, look too sure."""
    log, truth = simulate(ur5e, 20.0, 125.0, 0, motion="point_to_point")
    fit = identify(ur5e, condition(log))
    assert not any("stribeck" in terms for terms in fit.terms)
    told = [f"{joint['name']}.presliding_distance" for joint in truth["joints"]]
    true = [joint["presliding_distance"] for joint in truth["joints"]]
    off = [(fit.value(name) - x) / fit.spread(name) for name, x in zip(told, true, strict=True)]
    assert np.abs(off).max() < 3.5  # one of 360 draws of six is beyond that by chance
