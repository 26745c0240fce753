"""An encoder's zero that jumps is told where it jumps, by how much, and nothing else is one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from streams import log_of, play, stacked, swing

from urdyn.signal import Causal, condition, half_window
from urdyn.signal.gate import FINEST, REACH, SHAKEN, furthest
from urdyn.signal.shifts import jumps

RATES = (20.0, 50.0, 100.0, 125.0, 250.0, 500.0)
QUICK = RATES[2:]  # no step is longer than a shake
JUMP = 0.03  # [rad]


def moving(rate: float, seconds: float = 2.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = np.arange(0.0, seconds, 1.0 / rate)
    return t, *swing(t, omega=2.0)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("joint", [0, 1, 2])
@pytest.mark.parametrize("way", [JUMP, -JUMP])
def test_a_jump_of_one_angle_is_told_as_large_as_it_is(rate: float, joint: int, way: float) -> None:
    t, q, v = moving(rate)
    at = len(t) // 2
    q[at:, joint] += way
    found = jumps(t, q, v, half_window(1.0 / rate)).shift
    assert np.argwhere(found).tolist() == [[at, joint]]
    # A trapezoid is wrong by at most the third derivative's bound, 2³ here.
    assert abs(found[at, joint] - way) < 8.0 / rate**3 / 12.0


@pytest.mark.parametrize("rate", QUICK)
@pytest.mark.parametrize("seed", range(3))
def test_no_motion_within_an_arms_reach_is_a_jump(rate: float, seed: int) -> None:
    """Accelerations that switch at random between the most and its opposite, from row to row."""
    rng, dt = np.random.default_rng(seed), 1.0 / rate
    fine = 8
    a = REACH * np.repeat(rng.choice([-1.0, 1.0], (500, 3)), fine // 2, axis=0)
    v = np.vstack([np.zeros(3), np.cumsum(a, axis=0) * dt / fine])
    q = np.vstack([np.zeros(3), np.cumsum(0.5 * (v[1:] + v[:-1]), axis=0) * dt / fine])
    q, v = q[::fine] + rng.uniform(-0.4, 0.4, q[::fine].shape) * FINEST, v[::fine]
    t = dt * np.arange(len(q))
    assert not jumps(t, q, v, half_window(dt)).shift.any()


@pytest.mark.parametrize("rate", RATES[:2])
@pytest.mark.parametrize("seed", range(3))
def test_nor_is_a_speed_that_goes_one_way_and_is_shaken(rate: float, seed: int) -> None:
    """Every step goes all of its way at the speed it begins or ends with, and a shake besides."""
    rng, dt = np.random.default_rng(seed), 1.0 / rate
    v = np.cumsum(rng.normal(scale=0.2, size=(500, 3)), axis=0)
    along = np.where(rng.random((499, 3)) < 0.5, v[1:], v[:-1])
    shake = rng.choice([-1.0, 1.0], (499, 3)) * 0.25 * REACH * SHAKEN**2
    q = np.vstack([np.zeros(3), np.cumsum(dt * along + shake, axis=0)])
    assert not jumps(dt * np.arange(500), q, v, half_window(dt)).shift.any()


def test_nor_is_a_swing_of_which_a_velocity_is_lost() -> None:
    """Trapezoids over two steps are further off than those of the rows beside them."""
    t, q, v = moving(500.0)
    most, w, half = 8e-3, 2.0 * np.pi * 60.0, half_window(1.0 / 500.0)
    q[:, 1] += most * np.sin(w * t)
    v[:, 1] += most * w * np.cos(w * t)
    for lost in range(500, 525):
        known = np.where((np.arange(len(t)) == lost)[:, None], np.nan, v)
        assert not jumps(t, q, known, half).shift.any()


def test_how_far_a_way_may_be_off_is_never_more_than_an_acceleration_allows() -> None:
    rng, dt = np.random.default_rng(0), np.geomspace(1e-3, 1.0, 50)[:, None]
    speed, change = rng.uniform(0.0, 3.0, (2, 50, 6))
    reach = furthest(dt, speed, change)
    assert (reach <= FINEST + 0.25 * REACH * dt**2).all()
    unknown = furthest(dt, np.nan * speed, change)
    assert np.array_equal(unknown, np.broadcast_to(FINEST + 0.25 * REACH * dt**2, unknown.shape))


def torn(t: np.ndarray, q: np.ndarray, v: np.ndarray, at: int) -> None:
    q[at, 1] += JUMP


def both(t: np.ndarray, q: np.ndarray, v: np.ndarray, at: int) -> None:
    q[at:, :2] += JUMP


def late(t: np.ndarray, q: np.ndarray, v: np.ndarray, at: int) -> None:
    """The robot went on for 20 ms of which the stamps know nothing."""
    q[at:], v[at:] = (x[at:] for x in swing(t + 0.02, omega=2.0))


def late_alone(t: np.ndarray, q: np.ndarray, v: np.ndarray, at: int) -> None:
    """The same of an arm of which one joint moves: it may as well be that."""
    late(t, q, v, at)
    q[:, 1:], v[:, 1:] = 0.0, 0.0


def elsewhere(t: np.ndarray, q: np.ndarray, v: np.ndarray, at: int) -> None:
    """After a pause of the recording an arm is anywhere."""
    t[at:] += 1.0
    q[at:] += 0.5


@pytest.mark.parametrize("rate", [100.0, 500.0])
@pytest.mark.parametrize("befalls", [torn, both, late, late_alone, elsewhere])
def test_what_may_be_something_else_is_no_jump(rate: float, befalls) -> None:
    t, q, v = moving(rate)
    befalls(t, q, v, len(t) // 2)
    assert not jumps(t, q, v, half_window(1.0 / rate)).shift.any()


def test_of_an_arm_at_rest_a_jump_is_told_whatever_the_stamps() -> None:
    t = 0.01 * np.arange(100)
    q, v = np.zeros((2, 100, 3))
    q[40:, 2] += JUMP
    assert np.argwhere(jumps(t, q, v, 4).shift).tolist() == [[40, 2]]


@pytest.mark.parametrize("rate", [100.0, 500.0])
def test_a_jump_moves_no_joint(rate: float) -> None:
    """Velocity and acceleration around it are as if it were not there; the angle jumps."""
    t, q, v = moving(rate)
    at, smooth = len(t) // 2, condition(log_of(t, q, v))
    q[at:, 1] += JUMP
    jumped = condition(log_of(t, q, v))
    shift = jumps(t, q, v, half_window(1.0 / rate)).shift[at, 1]
    # What the trapezoid is wrong by is left; of it derivatives make Markov's n²/s each.
    wrong, width = abs(shift - JUMP), half_window(1.0 / rate) / rate
    for order, name in enumerate(("q", "v", "a", "jerk")):
        apart = getattr(jumped, name) - getattr(smooth, name)
        if name == "q":
            apart[at:, 1] -= JUMP
        bound = 4.0 * wrong * (16.0 / width) ** order
        assert np.abs(apart).max() <= bound + 1e-12 * (16.0 / width) ** order


def test_an_angle_that_is_kept_within_a_turn_has_no_shift_and_goes_on() -> None:
    t, q, v = moving(500.0)
    smooth = condition(log_of(t, q, v))
    kept = (q + np.pi) % (2.0 * np.pi) - np.pi + 2.0 * np.pi * (q > 0.5)
    _, live = play(Causal(0.002), log_of(t, kept, v))
    assert np.abs(stacked(live, "shift")).max() < 8.0 * 0.004**3 / 12.0
    # A turn is known to a trapezoid's error, and derivatives make Markov's n²/s of it.
    bound = 4.0 * 8.0 * 0.002**3 / 12.0 * 16.0 / 0.036
    assert np.abs(condition(log_of(t, kept, v)).v - smooth.v).max() < bound


@pytest.mark.parametrize(
    ("rate", "jump"),
    [(20.0, JUMP), (20.0, 0.015), (100.0, JUMP), (100.0, 0.004), (500.0, JUMP), (500.0, 0.004)],
)
def test_live_tells_the_same_jump_once(rate: float, jump: float) -> None:
    t, q, v = moving(rate)
    within = len(t) // 4  # where the others are so quick that no stamp may be late
    at = within + int(np.abs(v[within:-within, 1]).argmin())
    q[at:, 1] += jump
    _, live = play(Causal(1.0 / rate), log_of(t, q, v))
    shift = stacked(live, "shift")
    (found,) = np.argwhere(shift).tolist()
    assert found[1] == 1
    assert live[found[0]].t == t[at]
    assert abs(shift[tuple(found)] - jump) < 8.0 / rate**3 / 12.0
    smooth = condition(log_of(*moving(rate)))
    error = stacked(live, "v") - smooth.v[half_window(1.0 / rate) : -half_window(1.0 / rate)]
    width = half_window(1.0 / rate) / rate
    assert np.abs(error).max() < 4.0 * 8.0 / rate**3 / 12.0 * 16.0 / width


@pytest.mark.parametrize("rate", [50.0, 100.0, 125.0, 500.0])
def test_a_jump_that_is_undone_leaves_nothing(rate: float) -> None:
    """However soon: a torn angle is no jump, and the way back from one is no shaking."""
    t, plain, v = moving(rate)
    at, told = len(t) // 2, []
    for lasting in (*range(1, 14), 20, 40):
        q = plain.copy()
        q[at : at + lasting, 1] += JUMP
        shift = jumps(t, q, v, half_window(1.0 / rate)).shift
        _, instants = play(Causal(1.0 / rate), log_of(t, q, v))
        live = stacked(instants, "shift")
        for each in (shift, live):
            # Two ways beside those before them, wrong by the second derivative, 4 at most.
            assert abs(each.sum(axis=0)).max() < 2.0 * 4.0 / rate**2, lasting
        told.append(bool(shift.any()) and bool(live.any()))
    assert told[-1] and not told[0]


def backward(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.diff(q, axis=0, prepend=q[:1]) / (t[1] - t[0])


def central(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.gradient(q, t[1] - t[0], axis=0)


def observed(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    """A first-order observer of 15 ms."""
    keep, v = np.exp(-(t[1] - t[0]) / 0.015), backward(t, q)
    return lfilter([1.0 - keep], [1.0, -keep], v, axis=0, zi=keep * v[:1])[0]


ALONG = [backward, central, observed]


@pytest.mark.parametrize("velocity", ALONG)
@pytest.mark.parametrize("rate", QUICK)
@pytest.mark.parametrize("way", [0.02, -0.02])
def test_a_jump_that_velocities_follow_is_told(rate: float, velocity, way: float) -> None:
    """From 6 mrad on at 100 Hz; of velocities that are means around their row, twice that."""
    t, q, _ = moving(rate)
    at = len(t) // 2
    sound = velocity(t, q)
    q[at:, 1] += way
    v = velocity(t, q)
    found = jumps(t, q, v, half_window(1.0 / rate))
    assert np.argwhere(found.shift).tolist() == [[at, 1]]
    # It is told beside the way before: an acceleration's worth off, 4 here.
    assert abs(found.shift[at, 1] - way) < 4.0 / rate**2
    reached = np.abs(v - sound) > 0.1 * np.abs(v - sound).max()
    assert not (reached & ~found.misled).any()


@pytest.mark.parametrize("velocity", ALONG)
@pytest.mark.parametrize("rate", [100.0, 500.0])
def test_a_torn_angle_is_no_jump_whatever_follows_it(rate: float, velocity) -> None:
    t, q, _ = moving(rate)
    torn(t, q, q, len(t) // 2)
    assert not jumps(t, q, velocity(t, q), half_window(1.0 / rate)).shift.any()


@pytest.mark.parametrize("most", [1e-3, 2e-3, 4e-3])
@pytest.mark.parametrize("velocity", ALONG)
def test_nor_is_a_ring_of_three_rows(velocity, most: float) -> None:
    """Near Nyquist's frequency every angle is beside both of its neighbours."""
    t, q, _ = moving(125.0)
    q[:, 1] += most * np.minimum(t, 1.0) * np.sin(2.0 * np.pi * 41.0 * t)
    assert not jumps(t, q, velocity(t, q), half_window(0.008)).shift.any()


def test_an_arm_that_a_jump_has_shaken_has_no_other() -> None:
    """A loop that answers moves its neighbours in ways that trapezoids do not explain."""
    t, q, _ = moving(125.0)
    at = len(t) // 2
    q[at:, 1] += 0.015
    v = observed(t, q)
    q[at + 5 :, 2] += 0.004
    log = log_of(t, q, v)
    assert np.argwhere(condition(log).shift).tolist() == [[at, 1]]
    assert [i.t for i in play(Causal(0.008), log)[1] if i.shift.any()] == [t[at]]


@pytest.mark.parametrize("rate", [100.0, 500.0])
@pytest.mark.parametrize("velocity", [backward, observed])
def test_live_and_batch_tell_of_it_alike(rate: float, velocity) -> None:
    t, q, _ = moving(rate)
    at = len(t) // 2
    q[at:, 1] += 0.015
    log = log_of(t, q, velocity(t, q))
    _, live = play(Causal(1.0 / rate), log)
    batch, half = condition(log), half_window(1.0 / rate)
    shift = stacked(live, "shift")
    assert np.argwhere(shift).tolist() == [[at - half, 1]]
    assert np.allclose(shift, batch.shift[half:-half])
    # Live, two windows of all do not see the row on both sides of the jump: its first, its last.
    apart = np.abs(stacked(live, "a") - batch.a[half:-half])[:, 1]
    assert np.sort(apart)[-3] < 0.5


def test_a_stamp_that_no_other_joint_bears_out_is_no_excuse() -> None:
    """What they would show lies within what an arm can do, and they show nothing of it."""
    t = 0.01 * np.arange(300)
    q, v = swing(t, omega=2.0)
    q, v = q * [0.2, 1.0, 0.2], v * [0.2, 1.0, 0.2]
    at = 100 + int(np.abs(v[100:200, 1]).argmax())
    q[at:, 1] += 0.02 * np.sign(v[at, 1])
    assert np.argwhere(jumps(t, q, v, 4).shift).tolist() == [[at, 1]]


@pytest.mark.parametrize("stamp", [False, True])
def test_slow_joints_tell_a_wrong_stamp_by_what_encoders_resolve(stamp: bool) -> None:
    """A quick joint jumps by what it goes in 2.5 ms; of the others none goes 2 mrad in that."""
    rng, rate, v = np.random.default_rng(4), 500.0, np.array([1.2, -0.15, 0.4, 0.7])  # [rad/s]
    t = np.arange(200) / rate
    jump = 2.5e-3 * v * np.array([1.0, stamp, stamp, stamp])
    at = np.arange(200)[:, None] == 100 if stamp else np.arange(200)[:, None] >= 100
    q = t[:, None] * v + at * jump + rng.uniform(-6e-6, 6e-6, (200, 4))
    found = jumps(t, q, np.tile(v, (200, 1)), half_window(1.0 / rate)).shift
    assert np.argwhere(found).tolist() == ([] if stamp else [[100, 0]])
