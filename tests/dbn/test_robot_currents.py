"""The network's view of an arm: its currents are the equation's, its slopes their derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.dbn.arguments import Held
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_slice import packed
from urdyn.dbn.shown import shown_directions
from urdyn.identify.noise import Noise
from urdyn.model.arm import load_arm
from urdyn.model.population import population
from urdyn.signal import Instant
from urdyn.simulate import fourier
from urdyn.tracking.noise.colour import ORDER, first, whitened

LOAD = np.array([2.0, 0.02, -0.04, 0.16, *[0.01, 0.0, 0.01, 0.0, 0.0, 0.005]])


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur5e")


@pytest.fixture(scope="module")
def dynamics(arm):
    return population(arm).draw(np.random.default_rng(2), frozenset({"stribeck", "ripple_cos"}))


@pytest.fixture(scope="module")
def currents(arm, dynamics):
    _, shown = shown_directions(population(arm), dynamics, np.random.default_rng(0))
    return RobotCurrents(dynamics, shown, np.full(6, 0.1))


@pytest.fixture(scope="module")
def motion(arm):
    asked = fourier(arm, 4.0, 100.0, np.random.default_rng(1))
    return asked.at(asked.t)


def state(currents) -> np.ndarray:
    """The reference itself."""
    x, drive = np.zeros(len(currents.names)), currents.reference.drive
    for group, values in {
        "f": np.log(drive.coulomb),
        "alpha": np.log(drive.viscous),
        "beta": np.log(drive.structural),
        "rotor": np.log(drive.rotor_inertia),
        "o": drive.offset,
    }.items():
        x[currents.places[group]] = values
    return x


def at(currents, motion, row, speed=1.0):
    s = currents.reference.presliding(motion)[row]
    return currents.inputs(moment(motion, row, speed), s, 0.01)


def moment(motion, row, speed=1.0):
    fields = (motion.q, speed * motion.v, motion.a, motion.jerk, motion.current, motion.temperature)
    fields = (*fields, np.zeros_like(motion.q))
    return Instant(motion.t[row], *(x[row] for x in fields))


def test_at_the_reference_the_current_is_the_equations(currents, dynamics, motion):
    said = dynamics.current(motion)
    for row in range(50, 400, 35):
        seen = currents.observe(state(currents), at(currents, motion, row))
        np.testing.assert_allclose(seen, said[row], rtol=0, atol=1e-11)


@pytest.mark.parametrize("group", ["k", "m", "f", "alpha", "beta", "z", "o", "kappa"])
def test_no_current_depends_on_what_is_held(currents, motion, group):
    """Whatever its states are, all is as if they had the values at which they are held."""
    rng = np.random.default_rng(9)
    x = state(currents) + 1e-2 * rng.standard_normal(len(currents.names))
    at_, values = currents.places[group], np.full(len(x), np.nan)
    values[at_] = x[at_] + 0.05
    there = np.where(np.isnan(values), x, values)
    rates = np.r_[x, 1.0]  # what stands behind does not matter
    held = replace(currents, held=Held(values))
    u = replace(at(currents, motion, 150), warm=np.full(6, 5.0), felt=np.ones(6))
    assert np.abs(currents.observe(there, u) - currents.observe(x, u)).max() > 1e-4
    for inputs in (u, currents.near(u, there, LOAD)):
        seen, slope = held.linearised(x, inputs)
        wanted, H = currents.linearised(there, inputs)
        H[:, at_] = 0.0
        np.testing.assert_array_equal(seen, wanted)
        np.testing.assert_array_equal(slope, H)
        np.testing.assert_array_equal(held.observe(rates, inputs), wanted)
    np.testing.assert_array_equal(held.per_unit(x, u), currents.per_unit(there, u))
    np.testing.assert_array_equal(held.load(x, u), currents.load(there, u))
    near, wanted = held.near(u, x, LOAD), currents.near(u, there, LOAD)
    np.testing.assert_array_equal(near.carried.slope, wanted.carried.slope)
    side, now = np.sign(rng.standard_normal(6)), moment(motion, 150)
    loaded, wanted = held.inputs(now, side, 0.01, x), currents.inputs(now, side, 0.01, there)
    np.testing.assert_array_equal(loaded.side, wanted.side)


def test_currents_are_sums_of_what_is_packed(currents, motion):
    rng = np.random.default_rng(8)
    x = state(currents) + 1e-2 * rng.standard_normal(len(currents.names))
    x[currents.places["payload"]], x[currents.places["slow"]] = LOAD, 0.0
    for felt in (0.0, 1.0):
        u = replace(at(currents, motion, 150), warm=np.full(6, 5.0), felt=np.full(6, felt))
        drawn = (currents.per_unit(x, u) * u.packed).sum(axis=1)
        np.testing.assert_allclose(drawn, currents.observe(x, u), rtol=0, atol=1e-12)


def test_an_instrument_moves_the_slice_and_the_current_alike(currents, motion):
    rng, row = np.random.default_rng(8), 150
    x = state(currents) + 1e-2 * rng.standard_normal(len(currents.names))
    x[currents.places["k"]], x[currents.places["payload"]] = 0.0, LOAD
    s, instant = currents.reference.presliding(motion)[row], moment(motion, row)
    other = instant.a + 0.1 * rng.standard_normal(6)
    u, there = (currents.inputs(now, s, 0.01, x) for now in (instant, replace(instant, a=other)))
    packed = currents.instrumental(u, replace(instant, instrument=other))
    more = (currents.per_unit(x, u) * (packed - u.packed)).sum(axis=1)
    through = replace(u, packed=packed)
    rigid = slice(currents.places["k"].stop, None)
    for of in ("A", "A_hold"):
        had, told = (getattr(slice_, of)[:, rigid] for slice_ in (through, there))
        np.testing.assert_allclose(had, told, rtol=0, atol=1e-10)
    for of in ("load", "hold", "rest", "s", "v", "a", "one"):
        np.testing.assert_allclose(getattr(through, of), getattr(there, of), rtol=0, atol=1e-10)
    np.testing.assert_allclose(
        currents.observe(x, u) + more, currents.observe(x, there), rtol=0, atol=1e-10
    )
    assert np.abs(more).max() > 0.01
    assert currents.instrumental(u, instant) is u.packed


def test_what_a_zero_does_is_told_by_the_instrument_alone(currents, motion):
    """Noise of what the current is compared by would pass for a zero, the more the longer."""
    k, instant = currents.places["k"], moment(motion, 150)
    s = currents.reference.presliding(motion)[150]
    instant = replace(instant, instrument=instant.a)
    noisy = replace(instant, a=instant.a + np.random.default_rng(8).standard_normal(6))
    u, other = (currents.inputs(now, s, 0.01) for now in (instant, noisy))
    np.testing.assert_array_equal(u.A[:, k], other.A[:, k])
    assert np.abs(u.load - other.load).max() > 0.1


def test_a_skew_is_the_current_of_a_moment_later(currents, motion):
    """By differences of what the arm draws on its way, while friction turns over when it does.

    Ripples and a fading grip, which are no states, stay where they were; structural damping rides
    on the torque of rotors and damping too, which it does not on an arm.
    """
    row, h, x = 150, 1e-4, state(currents)
    s, now = currents.reference.presliding(motion)[row], moment(motion, row)
    told = replace(now, instrument=now.a, instrument_jerk=now.jerk)
    u = currents.inputs(told, s, 0.01, x)
    drawn = []
    for ahead in (-h, h):
        there = currents.inputs(moment(motion.ahead(ahead), row), s, 0.01, x)
        rest = packed(there.A, there.side, there.load, u.rest, s, there.v, there.a)
        drawn.append(currents.observe(x, replace(there, packed=rest)))
    drive = currents.reference.drive
    ridden = drive.viscous * now.a + drive.rotor_inertia * now.jerk
    slope = (drawn[1] - drawn[0]) / (2.0 * h) + drive.structural * u.side * ridden / drive.gain
    np.testing.assert_allclose(currents.observe_jacobian(x, u)[:, at_skew(currents)], slope, 1e-5)
    assert np.abs(slope).max() > 1.0
    without = currents.inputs(now, s, 0.01, x)
    assert not currents.observe_jacobian(x, without)[:, at_skew(currents)].any()


def at_skew(currents) -> int:
    return int(currents.places["skew"].start)


def test_a_constant_error_passes_a_filter_as_its_doubt_does(currents, motion):
    """Of a gear that grips more than is thought, or an acceleration that is off for long."""
    rng, u = np.random.default_rng(10), at(currents, motion, 150)
    off, ar = np.array([0.3, 0.1, -0.2, 0.05, 1.0, 0.4]), rng.uniform(-0.1, 0.2, (6, ORDER))
    noise = Noise(np.ones(6), np.ones(6), np.full(6, 100.0), np.zeros((6, 0)))
    colour = replace(first(noise, u.packed.shape[1], 0.01), ar=ar)
    drawn = currents.per_unit(state(currents), u)
    for _ in range(ORDER + 1):
        drawn_off = (drawn * u.packed).sum(axis=1) + off
        packed, y, _, colour = whitened(colour, u.packed, drawn_off, np.zeros(6, dtype=bool))
    left = y - (drawn * packed).sum(axis=1)
    doubtful = replace(u, gripped=0.5 * off**2, smeared=0.5 * off**2)
    white = doubtful.filtered(packed, np.zeros(6), np.zeros(6))
    np.testing.assert_allclose(white.unknown, left**2, rtol=1e-9)
    assert (np.abs(left) < np.abs(off)).all()


def test_slopes_are_derivatives(currents, motion):
    rng, h = np.random.default_rng(3), 1e-6
    u = replace(at(currents, motion, 123), warm=np.full(6, 5.0), felt=np.ones(6))
    x = state(currents) + 1e-3 * rng.standard_normal(len(currents.names))
    step = h * np.eye(len(x))
    slope = (currents.observe(x + step, u) - currents.observe(x - step, u)) / (2.0 * h)
    # A central difference is good to h² and to rounding over h.
    np.testing.assert_allclose(currents.observe_jacobian(x, u), slope.T, rtol=0, atol=1e-7)
    near = currents.near(u, x, LOAD)
    slope = (currents.observe(x + step, near) - currents.observe(x - step, near)) / (2.0 * h)
    np.testing.assert_allclose(currents.observe_jacobian(x, near), slope.T, rtol=0, atol=1e-7)


def test_sigma_points_are_one_call(currents, motion):
    u, x = at(currents, motion, 77), state(currents)
    points = x + 1e-3 * np.random.default_rng(4).standard_normal((2, 5, len(x)))
    together = currents.observe(points, u)
    alone = np.array([[currents.observe(p, u) for p in row] for row in points])
    np.testing.assert_allclose(together, alone, rtol=0, atol=1e-12)
    seen, H = currents.linearised(points, u)
    assert H.shape == (2, 5, 6, len(x))
    np.testing.assert_array_equal(seen, together)
    np.testing.assert_array_equal(H, currents.observe_jacobian(points, u))


def test_no_motion_shows_more_than_the_base_parameters(arm, dynamics, currents):
    V, shown = shown_directions(population(arm), dynamics, np.random.default_rng(9))
    assert shown.shape == (60, 36)
    np.testing.assert_allclose(V.T @ V, np.eye(36), rtol=0, atol=1e-12)


def test_a_payload_is_felt_as_by_the_equation(currents, dynamics, motion):
    row = 200
    s = dynamics.presliding(motion)
    x = state(currents)
    x[currents.places["payload"]] = LOAD
    said = replace(dynamics, payload=LOAD).torque(motion, s)[row] / dynamics.drive.gain
    seen = currents.observe(x, at(currents, motion, row))
    np.testing.assert_allclose(seen, said, rtol=0, atol=1e-10)


def test_a_stronger_drive_feels_less_of_what_is_carried(currents, motion):
    """And the same of the arm, of which commissioning got as much wrong."""
    u, x = at(currents, motion, 200), state(currents)
    gain = np.array([1.1, 0.9, 1.02, 0.95, 1.3, 1.0])
    laden = x.copy()
    laden[currents.places["payload"]] = LOAD
    felt = currents.observe(laden, u) - currents.observe(x, u)
    weighed = currents.load(laden, u) - currents.load(x, u)
    for each in (x, laden):
        each[currents.places["gain"]] = np.log(gain)
    there = currents.observe(laden, u) - currents.observe(x, u)
    np.testing.assert_allclose(there, felt / gain, rtol=0, atol=1e-12)
    told = currents.load(laden, u) - currents.load(x, u)
    np.testing.assert_allclose(told, weighed / gain, rtol=0, atol=1e-12)


def test_near_a_payload_its_products_are_straight(currents, motion):
    """There the currents are the equation's; away from it, by its slopes, whatever the drive is."""
    rng, x, at_payload = np.random.default_rng(6), state(currents), currents.places["payload"]
    x += 1e-2 * rng.standard_normal(len(x))
    exact = at(currents, motion, 200)
    u = currents.near(exact, x, LOAD)
    x[at_payload] = LOAD + 0.1 * rng.standard_normal(10)
    np.testing.assert_allclose(currents.observe(x, u), currents.observe(x, exact), rtol=1e-12)
    loaded = x.copy()
    loaded[at_payload] = LOAD
    H, there = currents.observe_jacobian(x, u), currents.observe_jacobian(loaded, exact)
    np.testing.assert_allclose(H, there, rtol=1e-9, atol=1e-12)
    tired = x.copy()
    tired[currents.places["z"]] -= 0.2
    felt = [currents.observe(each, u) for each in (tired, x)]
    for each in (tired, x):
        each[at_payload] += LOAD
    more = [currents.observe(each, u) for each in (tired, x)]
    np.testing.assert_allclose(more[0] - felt[0], more[1] - felt[1], rtol=1e-9)


def test_a_tired_drive_takes_more_current(currents, motion):
    u, x = at(currents, motion, 90), state(currents)
    tired = x.copy()
    tired[currents.places["z"]] = np.log(0.8)
    np.testing.assert_allclose(currents.observe(tired, u), currents.observe(x, u) / 0.8)


def test_a_creeping_joint_is_doubted(currents, motion):
    u, still = at(currents, motion, 90), at(currents, motion, 90, speed=0.0)
    noise = [np.diag(currents.observe_cov(v)) for v in (u, still)]
    assert (noise[1] > noise[0]).all() and (noise[0] > 0.1**2).all()


def test_what_friction_is_off_by_in_a_joint_that_slides_is_in_the_noise_already(currents, motion):
    rows = range(0, len(motion), 10)
    gripped = np.array([at(currents, motion, row).gripped for row in rows])
    slides = np.abs(motion.v[::10]) > 0.2
    assert slides.any() and (gripped[slides] < 1e-3 * currents.noise.min() ** 2).all()
