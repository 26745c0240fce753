"""EM finds what made the data. Tolerances are the likelihood's own curvature (observed Fisher)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from affine_models import Model, simulate, ticks

from urdyn.dbn import (
    AffineObservation,
    Edge,
    Joined,
    Network,
    Node,
    RandomWalk,
    Smoothed,
    Tick,
    compile_linear,
    learn_diffusion,
    learn_measurement_noise,
    learn_network,
    observation_residuals,
    process_residuals,
)
from urdyn.dbn.movements import TINY
from urdyn.errors import InputError
from urdyn.estimate import (
    Kalman,
    Learnt,
    expectation_maximisation,
    maximise_evidence,
    parameter_cov,
    smooth,
    track,
)
from urdyn.types import Array, Gaussian

N = 300


def walking(setting: Array) -> Model:
    """One state seen through noise; setting: logarithms of diffusion and noise."""
    diffusion, noise = np.exp(setting)
    prior = Gaussian(np.zeros(1), np.eye(1))
    return Joined(
        RandomWalk(("x",), prior, np.array([diffusion])),
        AffineObservation(1, lambda u: np.eye(1), noise**2 * np.eye(1)),
    )


def curvature_sd(misfit: Callable[[Array], float], at: Array, h: float = 0.05) -> Array:
    """Standard errors of a maximum likelihood estimate, by finite differences, (p,)."""
    p, unit = len(at), h * np.eye(len(at))
    hessian = np.empty((p, p))
    for i in range(p):
        for j in range(p):
            corners = [
                a * b * misfit(at + a * unit[i] + b * unit[j]) for a in (1, -1) for b in (1, -1)
            ]
            hessian[i, j] = sum(corners) / (4 * h**2)
    return np.sqrt(np.diag(np.linalg.inv(hessian)))


TRUTH = np.log([0.2, 0.5])


@pytest.fixture(scope="module")
def life() -> Array:
    y = simulate(walking(TRUTH), ticks(N), np.random.default_rng(41))[1]
    y[::11] = np.nan
    return y


@pytest.fixture(scope="module")
def likeliest(life: Array) -> Learnt:
    return maximise_evidence(np.log([0.3, 0.4]), walking, ticks(N), life)


def test_em_recovers_noise_levels(life: Array) -> None:
    def maximise(setting: Array, history: Smoothed) -> Array:
        model, inputs = walking(setting), ticks(N)
        diffusion = learn_diffusion(process_residuals(model, inputs, history), np.ones(N))
        noise = learn_measurement_noise(observation_residuals(model, inputs, life, history))
        return np.log([diffusion[0], np.sqrt(noise[0])])

    found = expectation_maximisation(
        np.log([1.0, 1.0]), walking, maximise, ticks(N), life, 100, 1e-3
    )
    assert (np.diff(found.log_likelihood) > -1e-9).all()

    def misfit(setting: Array) -> float:
        return -track(Kalman(), walking(setting), ticks(N), life).log_likelihood

    assert (np.abs(found.setting - TRUTH) < 4 * curvature_sd(misfit, found.setting)).all()


def test_em_and_the_evidence_agree(life: Array, likeliest: Learnt) -> None:
    found = likeliest
    assert found.converged and found.log_likelihood[-1] > found.log_likelihood[0]

    def misfit(setting: Array) -> float:
        return -track(Kalman(), walking(setting), ticks(N), life).log_likelihood

    sd = curvature_sd(misfit, found.setting)
    assert (np.abs(found.setting - TRUTH) < 4 * sd).all()
    cov = parameter_cov(found.setting, walking, ticks(N), life)
    np.testing.assert_allclose(np.sqrt(np.diag(cov)), sd, rtol=0.05)
    for elsewhere, build in ((found.setting + 3.0, walking), (TRUTH, lambda _: walking(TRUTH))):
        with pytest.raises(InputError, match="no maximum"):
            parameter_cov(elsewhere, build, ticks(N), life)


@pytest.mark.parametrize("by, converged", [(1.0, False), (-1e-6, True)])
def test_what_makes_a_history_less_likely_is_not_learnt(
    life: Array, by: float, converged: bool
) -> None:
    found = expectation_maximisation(
        TRUTH, walking, lambda setting, _: setting + by, ticks(N), life
    )
    best = track(Kalman(), walking(TRUTH), ticks(N), life).log_likelihood
    np.testing.assert_array_equal(found.setting, TRUTH)
    np.testing.assert_allclose(found.log_likelihood, [best], rtol=1e-9)
    assert found.converged == converged


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_doubt_of_a_parameter_is_in_its_unit(unit: float) -> None:
    """A variance from N readings of nothing else: its own, times the root of 2 / N."""
    y = unit * np.random.default_rng(46).standard_normal((40, 1))

    def noise(setting: Array) -> Joined[Any]:
        known = Gaussian(np.zeros(1), np.zeros((1, 1)))
        seen = AffineObservation[Tick](1, lambda u: np.eye(1), setting[:, None])
        return Joined(RandomWalk(("x",), known, np.zeros(1)), seen)

    variance = np.mean(y**2, axis=0)
    cov = parameter_cov(variance[0], noise, ticks(40), y, scale=unit**2)
    np.testing.assert_allclose(np.sqrt(cov[0]), variance * np.sqrt(2 / 40), rtol=0.05)


FAMILY = Network(
    (
        Node("f", diffusion=0.3),
        Node("m", diffusion=0.2),
        Node("alpha", diffusion=0.1),
        Node("z", diffusion=0.2),
    ),
    (Edge("f", "alpha", 0.7), Edge("m", "alpha", -0.4), Edge("f", "z", -0.6, shared=True)),
)
SIZES = {"f": 2, "m": 2, "alpha": 2, "z": 2}


def test_edges_are_learnt_from_a_history_that_is_known() -> None:
    """Errors of regression: own movement over parent's, per root of the number of movements."""
    rng, steps = np.random.default_rng(42), 2000
    model = compile_linear(FAMILY, SIZES)
    L = np.linalg.cholesky(model.transition_cov(Tick()))
    x = np.cumsum(rng.standard_normal((steps + 1, 8)) @ L.T, axis=0)
    history = Smoothed(x, np.zeros((steps + 1, 8, 8)), np.zeros((steps, 8, 8)))
    blank = replace(FAMILY, edges=tuple(replace(e, coefficient=0.0) for e in FAMILY.edges))
    found = learn_network(blank, SIZES, history, np.ones(steps))
    moves = np.sqrt(2 * steps)
    coefficient = {e.ends: e.coefficient for e in found.edges}
    assert abs(coefficient["f", "alpha"] - 0.7) < 4 * 0.1 / 0.3 / moves
    assert abs(coefficient["m", "alpha"] + 0.4) < 4 * 0.1 / 0.2 / moves
    assert abs(coefficient["f", "z"] + 0.6) < 4 * (1 - 0.6**2) / moves
    for node in FAMILY.nodes:
        learnt = np.array(found[node.name].diffusion)
        np.testing.assert_allclose(learnt, node.diffusion, rtol=4 / np.sqrt(2 * steps))


def test_a_shared_disturbance_is_learnt_by_its_pattern() -> None:
    """Of two components of f one moves with z; the standard error is a correlation's."""
    rng, steps = np.random.default_rng(44), 2000
    sizes, patterns = {"f": 2, "z": 1}, {("f", "z"): np.array([[0.0, 1.0]])}
    shared = Edge("f", "z", -0.6, shared=True)
    network = Network((Node("f", diffusion=0.3), Node("z", diffusion=0.2)), (shared,))
    L = np.linalg.cholesky(compile_linear(network, sizes, patterns).transition_cov(Tick()))
    x = np.cumsum(rng.standard_normal((steps + 1, 3)) @ L.T, axis=0)
    history = Smoothed(x, np.zeros((steps + 1, 3, 3)), np.zeros((steps, 3, 3)))
    found = learn_network(network, sizes, history, np.ones(steps), patterns)
    assert abs(found.edges[0].coefficient + 0.6) < 4 * (1 - 0.6**2) / np.sqrt(steps)
    both = replace(network, edges=(Edge("f", "z", 0.5), shared))
    learnt = learn_network(both, sizes, history, np.ones(steps), patterns)
    assert [edge.shared for edge in learnt.edges] == [False, True]


def test_an_edge_is_learnt_through_noise() -> None:
    pair = Network(
        (Node("f", diffusion=0.3), Node("alpha", diffusion=0.1)), (Edge("f", "alpha", 0.7),)
    )

    def build(network: Network) -> Joined[Any]:
        process = compile_linear(network, {"f": 1, "alpha": 1})
        return Joined(process, AffineObservation(2, lambda u: np.eye(2), 0.04 * np.eye(2)))

    def led(c: float) -> Network:
        return replace(pair, edges=(Edge("f", "alpha", c),))

    y = simulate(build(pair), ticks(N), np.random.default_rng(43))[1]

    def maximise(network: Network, history: Smoothed) -> Network:
        learnt = learn_network(network, {"f": 1, "alpha": 1}, history, np.ones(N))
        return replace(learnt, nodes=pair.nodes)  # noise levels are known here

    found = expectation_maximisation(led(0.0), build, maximise, ticks(N), y, 60, 1e-3)
    assert found.converged
    coefficient = found.setting.edges[0].coefficient

    def misfit(c: Array) -> float:
        return -track(Kalman(), build(led(float(c[0]))), ticks(N), y).log_likelihood

    assert (np.diff(found.log_likelihood) > -1e-9).all()
    best = maximise_evidence(np.zeros(1), lambda c: build(led(float(c[0]))), ticks(N), y)
    assert best.converged
    assert best.log_likelihood[-1] - found.log_likelihood[-1] < 1e-2
    few = expectation_maximisation(led(0.0), build, maximise, ticks(N), y, 3, 1e-3)
    assert not few.converged
    assert best.log_likelihood[-1] - few.log_likelihood[-1] > 1e-2
    sd = curvature_sd(misfit, np.array([coefficient]))[0]
    assert abs(coefficient - 0.7) < 4 * sd


@pytest.mark.parametrize("time_constant", [np.inf, 5.0])
def test_of_what_nothing_moves_no_rounding_is_learnt(time_constant: float) -> None:
    pair = Network(
        (Node("f", sd=0.1), Node("alpha", sd=0.1, time_constant=time_constant)),
        (Edge("f", "alpha", 0.5),),
    )
    model, inputs = told_by(pair, {"f": 1, "alpha": 1}, np.array([0.1, 0.2])), ticks(60)
    y = simulate(model, inputs, np.random.default_rng(47))[1]
    history, _ = smooth(model, inputs, y)
    learnt = learn_diffusion(process_residuals(model, inputs, history), np.ones(60))
    np.testing.assert_array_equal(learnt, 0.0)
    found = learn_network(pair, {"f": 1, "alpha": 1}, history, np.ones(60))
    still = [node for node in found.nodes if node.time_constant == np.inf]  # no mean fades
    assert all(node.diffusion[0] <= TINY**0.5 for node in still)


def told_by(network: Network, sizes: dict[str, int], noise: Array) -> Model:
    """A network of which every component is seen with `noise`, (n,)."""
    n = len(noise)
    sight = AffineObservation(n, lambda u: np.eye(n), np.diag(noise**2))
    return Joined(compile_linear(network, sizes), sight)


def learnt_from(
    truth: Network, start: Network, sizes: dict[str, int], steps: int, seed: int
) -> tuple[Learnt[Network], Callable[[Network], float]]:
    noise = 1e-3 * np.sqrt(compile_linear(truth, sizes).transition_cov(Tick()).diagonal())
    y = simulate(told_by(truth, sizes, noise), ticks(steps), np.random.default_rng(seed))[1]

    def maximise(network: Network, history: Smoothed) -> Network:
        return learn_network(network, sizes, history, np.ones(steps))

    def evidence(network: Network) -> float:
        return track(Kalman(), told_by(network, sizes, noise), ticks(steps), y).log_likelihood

    def build(network: Network) -> Model:
        return told_by(network, sizes, noise)

    found = expectation_maximisation(start, build, maximise, ticks(steps), y, 60, 1e-3)
    return found, evidence


@pytest.mark.parametrize("unit", [1.0, 1e8])
def test_an_edge_is_learnt_by_each_component_as_far_as_that_tells_of_it(unit: float) -> None:
    """Of two components one moves a thousand times as much by itself, and tells next to nothing.

    The standard error is that of the quiet one alone: its own movement over the parent's.
    """
    sizes = {"p": 2, "q": 2}

    def pair(c: float, q: tuple[float, float]) -> Network:
        nodes = (Node("p", sd=1.0 / unit, diffusion=1.0 / unit), Node("q", diffusion=q))
        return Network(nodes, (Edge("p", "q", c * unit),))

    found, evidence = learnt_from(pair(0.8, (10.0, 0.01)), pair(0.0, (1.0, 1.0)), sizes, N, 51)
    assert abs(found.setting.edges[0].coefficient / unit - 0.8) < 4 * 0.01 / np.sqrt(N)
    assert (np.diff(found.log_likelihood) > -1e-6).all()
    assert evidence(found.setting) > evidence(pair(0.8, (10.0, 0.01)))


def test_shared_disturbances_are_ones_that_variables_can_have() -> None:
    """Read pair by pair, .7 beside .7 would now and then have no third correlation left."""
    sizes = dict.fromkeys("abc", 1)

    def chain(rho: float) -> Network:
        nodes = tuple(Node(name, diffusion=1.0) for name in "abc")
        edges = (Edge("a", "b", rho, shared=True), Edge("b", "c", rho, shared=True))
        return Network(nodes, edges)

    for seed in range(4):
        found, evidence = learnt_from(chain(0.7), chain(0.0), sizes, 100, seed)
        assert evidence(found.setting) > evidence(chain(0.7)) - 1e-6
        assert (np.diff(found.log_likelihood) > -1e-6).all()


def test_what_was_learnt_before_a_fall_is_returned(life: Array) -> None:
    worse = [TRUTH, TRUTH + 0.5]
    found = expectation_maximisation(
        TRUTH + 0.2, walking, lambda setting, history: worse.pop(0), ticks(N), life
    )
    assert found.setting is TRUTH and len(found.log_likelihood) == 2


def coupled(setting: Array) -> Joined[Tick]:
    """Friction and the damping that it leads, seen: a coefficient and logarithms of noise."""
    coefficient, friction, damping, noise = setting
    nodes = (Node("f", diffusion=np.exp(friction)), Node("alpha", diffusion=np.exp(damping)))
    process = compile_linear(
        Network(nodes, (Edge("f", "alpha", coefficient),)), {"f": 1, "alpha": 1}
    )
    return Joined(process, AffineObservation(2, lambda u: np.eye(2), np.exp(2 * noise) * np.eye(2)))


@pytest.mark.slow
def test_a_search_may_begin_without_any_coupling() -> None:
    """A coordinate of 0 is moved like any other: wherever it begins, it ends on one top."""
    truth = np.array([-0.7, -2.3, -1.6, -2.3])
    y = simulate(coupled(truth), ticks(120), np.random.default_rng(44))[1]
    tops = []
    for start in ([0.0, -2.3, -1.6, -2.3], [-1.0, -2.0, -2.0, -2.0]):
        found = maximise_evidence(np.array(start), coupled, ticks(120), y)
        assert found.converged
        tops.append(found)
    cov = parameter_cov(tops[0].setting, coupled, ticks(120), y)  # refuses what is no maximum
    one, other = tops
    assert abs(other.log_likelihood[-1] - one.log_likelihood[-1]) < 5e-3
    assert (np.abs(other.setting - one.setting) < 0.1 * np.sqrt(np.diag(cov))).all()
    assert abs(one.setting[0] - truth[0]) < 4 * np.sqrt(cov[0, 0])


def test_a_scale_is_the_unit_of_a_parameter(life: Array, likeliest: Learnt) -> None:
    """In thousandths of a logarithm, the same search."""
    one = likeliest
    fine = maximise_evidence(
        1e3 * np.log([0.3, 0.4]), lambda x: walking(1e-3 * x), ticks(N), life, scale=1e3
    )
    np.testing.assert_allclose(fine.setting, 1e3 * one.setting, rtol=1e-6)
    assert len(fine.log_likelihood) == len(one.log_likelihood)
