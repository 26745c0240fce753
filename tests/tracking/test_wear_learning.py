"""How an arm strays, and what leads what, learnt from what its currents told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from workshop import at_work, commissioned

from urdyn.dbn import (
    AffineObservation,
    Edge,
    Joined,
    Smoothed,
    Tick,
    compile_linear,
    figure2,
    learn_network,
)
from urdyn.errors import InputError
from urdyn.estimate import EKF, Kalman, track
from urdyn.signal import Instant, samples
from urdyn.tracking import Drift, Tracker, drift_of, learn_edges, learn_wear, tracking_model
from urdyn.tracking.belief.model import patterns_of
from urdyn.tracking.learning import sizes_of, strays, summed_up, wearing

TRUE = {("f", "alpha"): 0.8, ("f", "z"): -0.5}
DRIFT = Drift(
    0.02, 0.015, 0.0, structural=0.0, health=0.01, offset=0.0, rate_sd=0.0, acceleration=0.0
)
STEPS = 80


def with_coefficients(network, values):
    """The network with some of its edges' coefficients."""
    edges = (replace(e, coefficient=values.get(e.ends, e.coefficient)) for e in network.edges)
    return replace(network, edges=tuple(edges))


def coefficients(network):
    return {e.ends: e.coefficient for e in network.edges}


def lived(model, at, rng):
    """A second at a time: what strays moves, and a dozen currents are seen at that moment."""
    currents, x = model.observation, model.prior.mean.copy()
    for _ in range(STEPS):
        for k in range(12):
            q, v, a = rng.uniform(-1.5, 1.5, (3, 6))
            now = Instant(0.0, q, v, a, np.zeros(6), np.zeros(6), np.full(6, np.nan), np.zeros(6))
            u = replace(currents.inputs(now, np.sign(v), float(k == 0)), blind=False)
            u = replace(u, noise=0.3 * u.noise)
            if k == 0:
                Q = model.transition_cov(u)[np.ix_(at, at)]
                x[at] += rng.multivariate_normal(np.zeros(len(at)), Q)
            sd = np.sqrt(np.diag(currents.observe_cov(u)))
            yield u, model.observe(x, u) + sd * rng.standard_normal(6), x[: len(currents.names)]


@pytest.fixture(scope="module")
def learnt(workshop):
    """From edges of nothing, on a life with TRUE ones; and the life's stretches."""
    fit = workshop.fit
    true = with_coefficients(figure2(), TRUE)
    model = tracking_model(fit, DRIFT, true)
    currents = model.observation
    blank = wearing(with_coefficients(true, dict.fromkeys(TRUE, 0.0)), fit, DRIFT)
    at = strays(blank, currents)
    start = model.prior.mean[: len(currents.names)]
    told = summed_up(lived(model, at, np.random.default_rng(0)), currents, start, at, 1.0)
    assert wearing(blank, fit, DRIFT) == blank  # as is learnt from again
    return learn_edges(blank, currents, told, 30), currents, told


def test_edges_and_diffusions_are_found_from_currents(workshop, learnt):
    """To four of the likelihood's own standard deviations; EM never goes down."""
    found, currents, told = learnt
    assert (np.diff(found.log_likelihood) > -1e-6).all()
    moving = [n for n in found.setting.parameters if n.name in ("f", "alpha", "z")]
    few = replace(
        found.setting,
        nodes=tuple(moving),
        edges=tuple(e for e in found.setting.edges if e.ends in TRUE),
    )
    sizes = sizes_of(few, currents)
    n = sum(sizes.values())
    seen = AffineObservation(n, lambda u: u.H, np.eye(n))

    def likelihood(values):
        model = Joined(compile_linear(with_coefficients(few, values), sizes), seen)
        return track(Kalman(), model, told, [s.y for s in told]).log_likelihood

    best, h = coefficients(found.setting), 0.1
    for edge, true in TRUE.items():
        steps = [likelihood({**best, edge: best[edge] + d}) for d in (-h, 0.0, h)]
        sd = h / np.sqrt(2.0 * steps[1] - steps[0] - steps[2])
        print(edge, best[edge], "+-", sd)
        assert abs(best[edge] - true) < 4.0 * sd and sd < 0.15
    drift = drift_of(found.setting, workshop.fit, DRIFT)
    # Six joints and STEPS moves of each, through noise that takes no more than half of them.
    tolerance = 4.0 / np.sqrt(2.0 * 6.0 * STEPS / 2.0)
    for field in ("friction", "damping", "health"):
        assert getattr(drift, field) == pytest.approx(getattr(DRIFT, field), rel=tolerance)
    assert drift.bodies == drift.structural == drift.offset == 0.0


def test_what_does_not_stray_keeps_its_edges(learnt):
    found = learnt[0]
    assert coefficients(found.setting)["m", "alpha"] == coefficients(figure2())["m", "alpha"]


def test_an_arrow_beside_a_disturbance_that_its_ends_share_stays_an_arrow(learnt):
    found, currents, told = learnt
    both = replace(found.setting, edges=(*found.setting.edges, Edge("f", "z", 0.1)))
    edges = learn_edges(both, currents, told[:8], 1).setting.edges
    assert [(e.joins, e.shared) for e in edges] == [(e.joins, e.shared) for e in both.edges]


def test_disturbances_that_cannot_be_shared_so_track_no_arm(workshop):
    pairs = {("f", "alpha"): 0.9, ("f", "z"): 0.9, ("alpha", "z"): -0.9}
    shared = tuple(Edge(*ends, of, shared=True) for ends, of in pairs.items())
    with pytest.raises(InputError, match=r"correlated like this: .*alpha <-> z \(-0.9\)"):
        tracking_model(workshop.fit, DRIFT, replace(figure2(), edges=shared))


def test_masses_that_lead_damping_are_found_in_a_history_that_is_known(workshop):
    """Errors of regression: own movement over that of the carried mass, by moves of six joints."""
    fit, rng, steps = workshop.fit, np.random.default_rng(2), 2000
    network = with_coefficients(figure2(), {("m", "alpha"): 1.5})
    model = tracking_model(fit, replace(DRIFT, bodies=0.3), network)
    currents = model.observation
    whole = wearing(network, fit, replace(DRIFT, bodies=0.3))
    names = ("m", "f", "alpha", "z")
    few = replace(
        whole,
        nodes=tuple(whole[name] for name in names),
        edges=tuple(e for e in whole.edges if {*e.ends} <= {*names}),
    )
    sizes, patterns = sizes_of(few, currents), patterns_of(currents)
    n = sum(sizes.values())
    moves = np.linalg.cholesky(compile_linear(few, sizes, patterns).transition_cov(Tick()))
    x = np.cumsum(rng.standard_normal((steps + 1, n)) @ moves.T, axis=0)
    history = Smoothed(x, np.zeros((steps + 1, n, n)), np.zeros((steps, n, n)))
    blank = with_coefficients(few, dict.fromkeys(coefficients(few), 0.0))
    found = learn_network(blank, sizes, history, np.ones(steps), patterns)
    carried = 0.3 * np.linalg.norm(patterns["m", "alpha"])
    sd = DRIFT.damping / (carried * np.sqrt(steps))
    assert abs(coefficients(found)["m", "alpha"] - 1.5) < 4.0 * sd
    assert sd < 0.1


def test_a_history_that_is_too_short_is_refused(workshop):
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    with pytest.raises(InputError, match="stretches"):
        learn_wear(tracker, lambda: samples(workshop.log.slice(0, 100)))


def test_a_tracked_log_teaches_its_tracker(workshop):
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    log = workshop.log.slice(0, 500)
    found = learn_wear(tracker, lambda: samples(log), 3, 1.0)
    assert (np.diff(found.log_likelihood) > -1e-3).all()  # of some hundreds; rounding
    drift = drift_of(found.setting, workshop.fit)
    assert drift.friction > 0.0 and drift.damping > 0.0
    again = Tracker(workshop.fit, EKF(), 0.01, drift, found.setting)
    assert again.model.process.names == tracker.model.process.names


def test_another_payload_is_no_wear():
    """Stretches are as likely as those of an empty tool, but for the second in which it is learnt.

    About what is carried at the end, three kilograms that came halfway are told as wear before.
    """
    dynamics, fit = commissioned(0)
    likelihood = []
    for faults in ((), ("payload_change:mass=3,com=0/0/0.08,onset=4",)):
        log, tracker = at_work(dynamics, 0, 9, 8.0, *faults), Tracker(fit, EKF(), 0.01)
        found = learn_wear(tracker, lambda log=log: samples(log), 1, 1.0)
        likelihood.append(found.log_likelihood[0])
    # The stretch in which it comes costs four times as much as each of the other seven, at most.
    assert likelihood[1] == pytest.approx(likelihood[0], rel=3.0 / 8.0)
