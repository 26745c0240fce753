"""The model that a commissioned arm is tracked by: its process, and the network's edges in it."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from urdyn.dbn import Edge, figure2
from urdyn.estimate import EKF, UKF
from urdyn.model.friction import WORKING_SPEED
from urdyn.signal import Instant
from urdyn.tracking import Drift, tracking_model
from urdyn.tracking.belief.blocks import Blocks
from urdyn.tracking.belief.commissioned import gains_of, given, taken_for_known
from urdyn.tracking.belief.model import ANYTHING, DAY, GAIN_SD, PAYLOAD_SD, SKEW_SD, by_taken
from urdyn.tracking.belief.physical import quantities
from urdyn.tracking.output.announce import by_part
from urdyn.types import Gaussian

JOINT = 2


@pytest.fixture(scope="module")
def model(workshop):
    return tracking_model(workshop.fit)


@pytest.fixture(scope="module")
def slices(workshop, model):
    """Inputs of the model at some moments of a motion."""
    J = workshop.fit.dynamics.arm.joints
    rng = np.random.default_rng(4)

    def at(dt, speed=1.0):
        q, v, a, jerk = rng.uniform(-1.5, 1.5, (4, J))
        v = speed * v
        now = Instant(0.0, q, v, a, jerk, np.zeros(J), np.full(J, np.nan), np.zeros(J))
        return model.observation.inputs(now, np.sign(v), dt)

    return at


def state(model, name):
    return model.names.index(name)


@pytest.mark.parametrize("first, second", [(0.3, 1.1), (1e-3, 2e-3), (20.0, 500.0)])
def test_two_steps_of_wear_are_one(model, slices, first, second):
    u = slices(first)
    one, two, both = u, replace(u, span=second), replace(u, span=first + second)
    x = model.prior.mean + 0.1
    F = model.transition_jacobian(x, two)
    np.testing.assert_allclose(
        model.transition(model.transition(x, one), two), model.transition(x, both)
    )
    np.testing.assert_allclose(
        F @ model.transition_cov(one) @ F.T + model.transition_cov(two),
        model.transition_cov(both),
        rtol=1e-9,
        atol=1e-18,
    )


def test_when_currents_are_told_is_doubted_as_in_commissioning(workshop, model):
    """And with the damping that looks like it; a twin that tells nothing of it is not sure."""
    fit, places, cov = workshop.fit, model.observation.places, model.prior.cov
    offset, elbow = (fit.names.index(n) for n in ("time_offset", "elbow_joint.viscous"))
    told = given(fit.belief.cov, [offset, elbow], taken_for_known(fit))
    skew, alpha = places["skew"].start, places["alpha"].start + JOINT
    assert model.prior.mean[skew] == 0.0
    np.testing.assert_allclose(cov[skew, [skew, alpha]], told[0], rtol=1e-9)
    assert told[0, 1] != 0.0
    few = [k for k in range(len(fit.names)) if k != offset]
    belief = Gaussian(fit.belief.mean[few], fit.belief.cov[np.ix_(few, few)])
    older = replace(fit, names=tuple(fit.names[k] for k in few), belief=belief)
    assert tracking_model(older).prior.sd[skew] == SKEW_SD


def test_what_is_taken_for_known_is_doubted_where_quantities_are_told(workshop, model):
    """So that friction is no surer on the first day than its fit and another day are together."""
    fit, currents = workshop.fit, model.observation
    coulomb = [fit.names.index(f"{j}.coulomb") for j in fit.dynamics.arm.joint_names]
    of_fit, at = fit.belief.cov[coulomb, coulomb], currents.places["f"]
    more = by_taken(fit, currents)
    assert np.linalg.eigvalsh(more)[0] > -1e-12
    assert (more.diagonal()[at] > 1e-3 * of_fit).all()
    whole = (model.prior.cov[: len(more), : len(more)] + more).diagonal()
    np.testing.assert_allclose(whole[at], of_fit + DAY["f"] ** 2, rtol=1e-9)
    of = quantities(fit, currents)
    mean, sd = of.of(model.prior)
    told = [of.names.index(f"{j}.coulomb") for j in fit.dynamics.arm.joint_names]
    np.testing.assert_allclose(sd[told] / mean[told], np.sqrt(whole[at]), rtol=1e-9)


def test_friction_is_as_sure_on_the_first_day_as_its_fit_and_another_day(workshop, model):
    """All of it, at a working speed: what its terms trade off leaves it as it is."""
    fit, of = workshop.fit, quantities(workshop.fit, model.observation)
    drive, commissioned = fit.dynamics.drive, fit.friction(WORKING_SPEED)
    at = [of.names.index(f"{j}.friction") for j in fit.dynamics.arm.joint_names]
    mean, sd = of.of(model.prior)
    by_day = DAY["f"] * drive.coulomb, DAY["alpha"] * drive.viscous * WORKING_SPEED
    np.testing.assert_allclose(mean[at], commissioned.mean, rtol=1e-9)
    np.testing.assert_allclose(sd[at], np.hypot(commissioned.sd, np.hypot(*by_day)), rtol=1e-6)


@pytest.mark.parametrize("group", ["f", "alpha"])
def test_friction_grows_by_whichever_of_its_terms_does(workshop, model, group):
    """Half as much again of viscous friction is as much a change as that of Coulomb friction."""
    fit, of = workshop.fit, quantities(workshop.fit, model.observation)
    drive, worn = fit.dynamics.drive, np.array(model.prior.mean)
    worn[model.observation.places[group]] += np.log(1.5)
    more = 0.5 * (drive.coulomb if group == "f" else drive.viscous * WORKING_SPEED)
    at = [of.names.index(f"{j}.friction") for j in fit.dynamics.arm.joint_names]
    grown = of.of(Gaussian(worn, model.prior.cov))[0] - of.of(model.prior)[0]
    np.testing.assert_allclose(grown[at], more, rtol=1e-9)


def test_friction_that_fades_with_speed_counts_as_far_as_a_working_speed_leaves_it(workshop, model):
    fit, at = workshop.fit, model.observation
    own = fit.dynamics.drive
    drive = replace(own, stribeck=0.5 * own.coulomb, stribeck_velocity=np.linspace(0.1, 0.6, 6))
    reference = replace(at.reference, drive=drive)
    of = (
        quantities(fit, at),
        replace(quantities(fit, at), currents=replace(at, reference=reference)),
    )
    without, faded = (each.of(model.prior)[0] for each in of)
    told = [of[0].names.index(f"{j}.friction") for j in fit.dynamics.arm.joint_names]
    before = own.stribeck * np.exp(-WORKING_SPEED / own.stribeck_velocity)
    more = drive.stribeck * np.exp(-WORKING_SPEED / drive.stribeck_velocity) - before
    np.testing.assert_allclose((faded - without)[told], more, rtol=1e-9)


@pytest.mark.parametrize("group", ["m", "payload"])
def test_weights_are_no_surer_than_the_gain_that_weighed_them(workshop, model, group):
    """Of links, and of what was put on the flange; of a tool that was named, nothing is doubted."""
    tool, at = np.r_[1.5, 0.0, 0.0, 0.1, np.zeros(6)], model.observation
    named = replace(at, reference=replace(at.reference, payload=tool))
    of, mean = quantities(workshop.fit, named), np.array(model.prior.mean)
    mean[at.places["payload"].start] = 2.0
    links = [f"{link}.mass" for link in workshop.fit.dynamics.arm.link_names]
    told = [of.names.index(name) for name in (links if group == "m" else ["payload.mass"])]
    sds = []
    for by_gain in (0.0, 0.05):
        doubted = replace(of, taken=of.taken | {group: np.full(1, by_gain)})
        masses, sd = doubted.of(Gaussian(mean, model.prior.cov))
        sds.append(sd[told])
    weighed = masses[told] if group == "m" else masses[told] - 1.5
    np.testing.assert_allclose(sds[1] ** 2 - sds[0] ** 2, (0.05 * weighed) ** 2, rtol=1e-6)


def test_links_are_as_sure_on_the_first_day_as_their_fit(workshop, model):
    """What motion shows of them, what none does, and what hangs on what is taken for known.

    But for what bodies that were fitted differ from those of the type, whose hidden part it is.
    """
    fit, links = workshop.fit, workshop.fit.dynamics.arm.link_names
    of, told = quantities(fit, model.observation), [f"{link}.mass" for link in links]
    _, sd = of.of(model.prior)
    spread, mass = (np.array([each(name) for name in told]) for each in (fit.spread, fit.value))
    np.testing.assert_allclose(sd[[of.names.index(name) for name in told]], spread, rtol=0.1)
    at = [fit.names.index(f"{link}.alpha") for link in links]
    left = given(fit.belief.cov, at, taken_for_known(fit)).diagonal()
    share = 1.0 - left / fit.belief.cov[at, at]
    np.testing.assert_allclose(of.taken["m"], spread / mass * np.sqrt(share), rtol=1e-6)


def test_a_joints_name_changes_no_number(workshop, model):
    """Though a URDF's names may have dots, as a parameter's has before its quantity."""

    def dotted(names):
        return tuple(name.replace("_joint", ".joint") for name in names)

    fit, arm = workshop.fit, workshop.fit.dynamics.arm
    dynamics = replace(fit.dynamics, arm=replace(arm, joint_names=dotted(arm.joint_names)))
    other = replace(fit, names=dotted(fit.names), dynamics=dynamics)
    renamed, told = tracking_model(other), []
    np.testing.assert_array_equal(renamed.prior.cov, model.prior.cov)
    for one, tracked in ((fit, model), (other, renamed)):
        of = quantities(one, tracked.observation)
        mean, sd = of.of(tracked.prior)
        now = SimpleNamespace(names=of.names, units=of.units, mean=mean, sd=sd)
        parts, _, _ = by_part(now, one.dynamics.arm.joint_names)
        told.append([*parts.values()])
    assert told[0] == told[1]


def test_weights_are_told_by_the_gain_that_is_known_best(workshop, model):
    """However large another is: a base bears nothing that would tell its gain."""
    fit, at = workshop.fit, model.observation.places
    sd = fit.belief.sd[gains_of(fit)]
    best = int(sd.argmin())
    gain = np.where(np.arange(len(sd)) == best, 1.0, 2.0) * fit.dynamics.drive.gain.max()
    drive = replace(fit.dynamics.drive, gain=gain)
    other = replace(fit, dynamics=replace(fit.dynamics, drive=drive))
    believed = tracking_model(other).prior.sd[at["gain"]]
    assert believed.argmin() == best and believed[best] == pytest.approx(GAIN_SD)
    told = quantities(other, model.observation).taken["payload"]
    np.testing.assert_allclose(told, sd[best])


def test_wear_is_linear_and_its_noise_a_covariance(model, slices):
    u, rng = slices(0.4), np.random.default_rng(0)
    points = rng.standard_normal((2, 3, len(model.names)))
    moved = model.transition(points, u)
    F = model.transition_jacobian(points[0, 0], u)
    np.testing.assert_allclose(moved, points @ F.T, rtol=0, atol=1e-12)
    assert np.linalg.eigvalsh(model.transition_cov(u))[0] > -1e-18
    assert np.linalg.eigvalsh(model.prior.cov)[0] > 0.0


def whose_rates_meet():
    """f and z, which have rates, both lead alpha, and f leads z beside it."""
    drawn = figure2()
    arrows = tuple(edge for edge in drawn.edges if not edge.shared)
    return replace(drawn, edges=(*arrows, Edge("f", "z", -0.3), Edge("z", "alpha", 0.2)))


@pytest.mark.parametrize("network", [None, whose_rates_meet()])
@pytest.mark.parametrize("span", [0.08, 20.0])
@pytest.mark.parametrize("befalls", [{}, {"jolted": np.eye(6)[JOINT], "wears": True}])
def test_a_belief_is_carried_on_as_points_are(workshop, slices, network, span, befalls):
    """F P Fᵀ + Q, whatever of it is known to be zero."""
    model = tracking_model(workshop.fit, network=network)
    u = replace(slices(span), stray=np.full(6, 0.1), taken=PAYLOAD_SD, **befalls)
    root = np.random.default_rng(4).standard_normal((len(model.names),) * 2)
    before = Gaussian(model.prior.mean + 0.1, root @ root.T)
    F = model.transition_jacobian(before.mean, u)
    after = model.predicted(before, u)
    cov = F @ before.cov @ F.T + model.transition_cov(u)
    sd = np.sqrt(cov.diagonal())
    np.testing.assert_array_equal(after.mean, model.transition(before.mean, u))
    assert (np.abs(after.cov - cov) < 1e-12 * np.outer(sd, sd)).all()  # n roundings of 1e-16
    np.testing.assert_array_equal(after.cov, after.cov.T)
    assert model.predicted(before, replace(u, widen=True)) is None


def test_only_a_payload_is_taken_up_at_once(model, slices):
    u = slices(0.1)
    more = model.transition_cov(replace(u, widen=True)) - model.transition_cov(u)
    changed = {model.names[k].rpartition("_")[0] for k in np.flatnonzero(more.any(axis=0))}
    assert changed == {"payload"}


def test_another_payload_has_nothing_of_the_one_before(model, slices):
    u = replace(slices(0.1), widen=True)
    rng, n = np.random.default_rng(1), len(model.names)
    of_payload = np.array(["payload" in name for name in model.names])
    x = rng.standard_normal((2, n))
    moved, F = model.transition(x, u), model.transition_jacobian(x[0], u)
    np.testing.assert_allclose(moved, x @ F.T, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(moved[:, of_payload], 0.0)
    roughly = rng.standard_normal(10)
    found = model.observation.near(u, x[0, : len(model.observation.names)], roughly)
    np.testing.assert_array_equal(model.transition(x, found)[:, of_payload], [roughly, roughly])
    for told in (u, found):  # what was found out is where belief begins, and no evidence
        np.testing.assert_allclose(
            model.transition_cov(told)[of_payload],
            ANYTHING[:, None] ** 2 * np.diag(model.prior.cov.diagonal())[of_payload],
            rtol=1e-12,
        )


@pytest.mark.parametrize(
    "filter_", [EKF(), pytest.param(UKF(), marks=pytest.mark.slow)], ids=["ekf", "ukf"]
)
def test_ever_new_payloads_do_not_tell_the_gain_that_they_are_felt_through(model, slices, filter_):
    """One joint's current alone: all of them heavier, and the drive that much stronger, is as much.

    Each of a hundred is begun a little wrong, as evidence of a noisy moment is, and then measured.
    """
    rng, currents, prior, joint = np.random.default_rng(5), model.observation, 0.05, 2
    gain, payload = (currents.places[group].start for group in ("gain", "payload"))
    truth, cov = np.array(model.prior.mean), np.array(model.prior.cov)
    cov[gain + joint, gain + joint] = prior**2
    wear = replace(model.process.process, prior=Gaussian(truth, cov))
    model = replace(model, process=replace(model.process, process=wear))
    state, information = filter_.init(model), prior**-2
    for _ in range(100):
        truth[payload] = rng.uniform(0.0, 8.0)
        roughly = np.zeros(10)
        roughly[0] = truth[payload] + 0.5 * rng.standard_normal()
        # All that is known of it besides is that it is within so many kilograms of this.
        information += (roughly[0] / (ANYTHING * PAYLOAD_SD)[0]) ** 2
        for k in range(20):
            u = replace(slices(1e-6), widen=k == 0)
            u = currents.near(u, filter_.belief(state).mean[: len(currents.names)], roughly)
            y = np.full(len(u.noise), np.nan)
            seen = currents.observe(truth[: len(currents.names)], replace(u, carried=None))
            y[joint] = seen[joint] + u.noise[joint] * rng.standard_normal()
            state, _ = filter_.step(model, state, u, y)
    np.testing.assert_allclose(filter_.belief(state).sd[gain + joint], information**-0.5, rtol=0.05)


def test_damping_strays_more_where_nobody_measures_temperatures(model, slices):
    u = slices(0.1)
    more = model.transition_cov(replace(u, blind=True)) - model.transition_cov(
        replace(u, blind=False)
    )
    changed = {model.names[k].rpartition("_")[0] for k in np.flatnonzero(more.any(axis=0))}
    assert changed == {"alpha"}


def inferred(fit, slices, network):
    """How far each state is moved by the news that one joint's friction has risen."""
    worn = Drift(friction=0.05, health=0.05)
    model = tracking_model(fit, worn, network)
    u = replace(slices(10.0), blind=False)
    predicted = model.transition_cov(u)
    f = state(model, f"f_{JOINT}")
    return partial(lambda name: predicted[state(model, name), f] / predicted[f, f])


@pytest.mark.parametrize(
    "edge, state_, moved", [(("f", "alpha"), "alpha", 0.5), (("f", "z"), "z", -0.3)]
)
def test_an_edge_that_is_removed_changes_what_is_inferred(workshop, slices, edge, state_, moved):
    """One joint's friction moves its damping and its drive's health, as the edges say."""
    with_edge = inferred(workshop.fit, slices, figure2())
    without = inferred(workshop.fit, slices, figure2().without(*edge))
    assert with_edge(f"{state_}_{JOINT}") == pytest.approx(moved, rel=0.05)
    assert without(f"{state_}_{JOINT}") == 0.0
    assert with_edge(f"{state_}_{JOINT + 1}") == 0.0


def test_a_link_that_grows_heavier_damps_the_joints_below_it(workshop, slices):
    """m -> alpha: by the mass that a joint carries; without the edge, by nothing."""
    fit, u = workshop.fit, replace(slices(10.0), blind=False)
    found = []
    for network in (figure2(), figure2().without("m", "alpha")):
        model = tracking_model(fit, Drift(bodies=0.1), network)
        Q = model.transition_cov(u)
        at = model.observation.places
        found.append(Q[at["alpha"], at["m"]] / (0.1**2 * 10.0))
    with_edge, without = found
    inertials = model.observation.reference.inertials
    carried = np.cumsum(inertials[::-1, 0])[::-1]
    np.testing.assert_allclose(
        with_edge[0], 0.1 * model.observation.shown[::10].sum(0) / carried[0]
    )
    last = model.observation.shown[50] / inertials[5, 0]
    np.testing.assert_allclose(with_edge[5], 0.1 * last)
    assert not without.any()


def test_friction_that_is_seen_to_rise_moves_what_follows_it(workshop, slices):
    """The same through a filter: slow strokes tell of Coulomb friction, and damping follows."""
    fit, found = workshop.fit, {}
    for name, network in (("edge", figure2()), ("none", figure2().without("f", "alpha"))):
        model = tracking_model(fit, Drift(friction=0.05), network)
        filter_, rng = EKF(), np.random.default_rng(8)
        belief = filter_.init(model)
        grown = model.prior.mean.copy()
        grown[state(model, f"f_{JOINT}")] += 0.3
        for _ in range(60):
            u = replace(slices(0.5, speed=0.05), blind=False)
            y = model.observe(grown, u) + 0.01 * rng.standard_normal(6)
            belief, _ = filter_.step(model, belief, u, y)
        alpha = state(model, f"alpha_{JOINT}")
        found[name] = belief.mean[alpha] - model.prior.mean[alpha]
    assert found["edge"] > found["none"] + 0.05


ALONE = figure2().without("f", "alpha").without("f", "z").without("f", "curr")


@pytest.mark.parametrize("filter_", [EKF(), UKF(), Blocks()], ids=repr)
def test_what_no_current_shows_is_not_learnt_from_currents(workshop, slices, filter_):
    """f without its edges is d-separated from the current, and its belief only widens with time."""
    assert ALONE.d_separated("f", "curr") and ALONE.d_separated("f'", "curr'", "curr", "z", "m")
    assert not ALONE.d_separated("z", "curr")
    drift, rng = Drift(friction=0.01, health=0.01), np.random.default_rng(8)
    whole, model = (tracking_model(workshop.fit, drift, n) for n in (figure2(), ALONE))
    grown = model.prior.mean.copy()
    for group, by in (("f", 0.3), ("z", -0.1)):
        grown[state(model, f"{group}_{JOINT}")] += by
    belief = known = filter_.init(model)
    for _ in range(40):
        u = replace(slices(0.5, speed=0.05), blind=False)
        y = whole.observe(grown, u) + 0.01 * rng.standard_normal(6)
        belief, _ = filter_.step(model, belief, u, y)
        known, _ = filter_.step(model, known, u, np.full(6, np.nan))
    after, nobody = filter_.belief(belief), filter_.belief(known)
    f = [state(model, name) for name in model.names if name.startswith("f_")]
    np.testing.assert_allclose(after.mean[f], nobody.mean[f], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(after.sd[f], nobody.sd[f], rtol=1e-9)
    assert (after.sd[f[:6]] > model.prior.sd[f[:6]]).all()
    z = state(model, f"z_{JOINT}")
    assert after.mean[z] < -0.02 and after.sd[z] < nobody.sd[z]


def test_what_shows_by_another_alone_is_learnt_by_it(workshop, slices):
    """f without its edge to the current, but with that to damping, which the current shows."""
    network = figure2().without("f", "curr")
    assert not network.d_separated("f", "curr")
    drift, filter_, rng = Drift(friction=0.05), EKF(), np.random.default_rng(8)
    model = tracking_model(workshop.fit, drift, network)
    f, alpha = (state(model, f"{group}_{JOINT}") for group in ("f", "alpha"))
    grown = model.prior.mean.copy()
    grown[alpha] += 0.4
    belief = filter_.init(model)
    for _ in range(60):
        u = replace(slices(0.5), blind=False)
        y = model.observe(grown, u) + 0.01 * rng.standard_normal(6)
        belief, _ = filter_.step(model, belief, u, y)
    assert belief.mean[alpha] > model.prior.mean[alpha] + 0.2
    assert belief.mean[f] > model.prior.mean[f] + 0.02


def test_mass_leads_damping_through_a_filter_where_masses_stray(workshop, slices):
    """A link that is seen to grow heavier damps; by default none does: the edge says nothing."""
    fit, led = workshop.fit, {}
    moments = [replace(slices(0.5, speed=0.05), blind=False) for _ in range(60)]
    for bodies in (0.0, 0.1):
        for name, network in (("edge", figure2()), ("none", figure2().without("m", "alpha"))):
            model = tracking_model(fit, Drift(bodies=bodies), network)
            filter_, rng = EKF(), np.random.default_rng(8)
            heavier, belief = model.prior.mean.copy(), filter_.init(model)
            heavier[model.observation.places["m"]] += 1.0
            for u in moments:
                y = model.observe(heavier, u) + 0.01 * rng.standard_normal(6)
                belief, _ = filter_.step(model, belief, u, y)
            led[bodies, name] = belief.mean[model.observation.places["alpha"]]
    np.testing.assert_array_equal(led[0.0, "edge"], led[0.0, "none"])
    # By how much hangs on how well the twin knows its masses; round-off is some 1e-12.
    assert np.abs(led[0.1, "edge"] - led[0.1, "none"]).max() > 1e-6
