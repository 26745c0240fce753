"""A sensor that repeats itself while its joint moves measures nothing, and nothing else is one."""

from __future__ import annotations

import numpy as np
import pytest
from streams import log_of, play, swing

from urdyn.signal import Causal, condition, samples, stream
from urdyn.signal.stuck import APART, OFFSET, ROWS, ever_stuck, stuck

RATES = (20.0, 50.0, 100.0, 125.0, 250.0, 500.0)
ANGLE, SPEED = 0, 1


def moving(rate: float, seconds: float = 4.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles rounded to 1e-5 rad, as recorders do, and speeds with noise of their own."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    q, v = swing(t, omega=1.0)
    return t, np.round(q, 5), v + 2e-3 * np.random.default_rng(0).standard_normal(v.shape)


def held(values: np.ndarray, joint: int, rate: float) -> slice:
    """A second in which a sensor says what it did before."""
    rows = slice(int(1.5 * rate), int(2.5 * rate))
    values[rows, joint] = values[rows.start, joint]
    return rows


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("joint", [0, 1, 2])
@pytest.mark.parametrize("sensor", [ANGLE, SPEED])
def test_it_is_marked_from_where_the_other_went_on_without_it(
    rate: float, joint: int, sensor: int
) -> None:
    t, q, v = moving(rate)
    way = np.cumsum((v[:, joint] if sensor == ANGLE else np.gradient(q[:, joint], t)) / rate)
    rows = held((q, v)[sensor], joint, rate)
    ill = ever_stuck(t, q, v)
    assert not np.delete(ill.reshape(len(t), -1), sensor * 3 + joint, axis=1).any()
    marked = np.flatnonzero(ill[:, sensor, joint])
    assert marked[-1] == rows.stop - 1
    assert np.array_equal(marked, np.arange(marked[0], rows.stop))
    # What it lacks by then is no more than an offset makes: all beyond that is marked.
    lacked = way[marked[0] - 1] - way[rows.start]
    if sensor == SPEED:
        lacked -= v[rows.start, joint] * (t[marked[0] - 1] - t[rows.start])
    assert abs(lacked) <= OFFSET * (t[marked[0]] - t[rows.start]) + 2.0 * APART


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("rounded", [1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("seed", range(3))
def test_no_slow_joint_is_however_angles_are_rounded(
    rate: float, rounded: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, 1.0 / rate)
    omega, size = rng.uniform(0.2, 3.0, 6), 10.0 ** rng.uniform(-3.0, 0.0, 6)
    phase = omega * t[:, None] + rng.uniform(0.0, 6.0, 6)
    q = np.round(size * np.sin(phase) / rounded) * rounded
    v = size * omega * np.cos(phase)
    q[:, 0], v[:, 0] = 0.5, 0.0  # one stands, and its velocity may say otherwise
    v += rng.uniform(-0.5, 0.5, 6) * OFFSET + 5e-3 * rng.standard_normal(v.shape)
    assert not ever_stuck(t, q, v).any()


def test_nor_one_that_goes_on_at_one_speed_nor_one_whose_zero_jumps_meanwhile() -> None:
    t = np.arange(0.0, 4.0, 0.01)
    v = np.full((len(t), 2), 0.5)
    q = t[:, None] * v
    q[200:, 1] += 3.0 * APART  # one row is no run
    assert ROWS > 1
    assert not ever_stuck(t, q, v).any()


def test_a_recorder_that_repeats_rows_is_not_read_between_them() -> None:
    """Its angles stand for some rows and jump; what it says in the last of these is no angle."""
    t, q, v = moving(500.0)
    again = np.arange(len(t)) // 25 * 25
    ill = ever_stuck(t, q[again], v[again])
    assert not ill[::25].any()


def resting(rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints that swing, and come to rest at 2 s."""
    t = np.arange(0.0, 4.0, 1.0 / rate)
    size, omega = np.array([0.2, 0.5, 1.0]), np.pi * np.array([1.0, 2.0, 1.0])
    phase = omega * np.minimum(t, 2.0)[:, None]
    return t, np.round(size * np.cos(phase), 5), -size * omega * np.sin(phase)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("off", [0.05, -0.3])
def test_a_velocity_that_is_off_in_motion_condemns_no_joint_that_comes_to_rest(
    rate: float, off: float
) -> None:
    t, q, v = resting(rate)
    v[:, 1] += off
    assert not ever_stuck(t, q, v).any()


@pytest.mark.parametrize("rate", RATES)
def test_a_velocity_that_is_stuck_is_no_witness_that_a_resting_joint_moves(rate: float) -> None:
    t, q, v = resting(rate)
    v[t >= 0.75, 1] = v[np.searchsorted(t, 0.75), 1]
    ill = ever_stuck(t, q, v)
    assert ill[-1, SPEED, 1] and not np.delete(ill.reshape(len(t), -1), 3 + 1, axis=1).any()


@pytest.mark.parametrize("rate", RATES[1:])
def test_an_angle_that_sticks_at_rest_is_found_once_its_joint_goes_on_slowly(rate: float) -> None:
    t, q, v = resting(rate)
    v[t >= 3.0, 1] = 0.1 * (t[t >= 3.0] - 3.0)  # [rad/s]
    ill = ever_stuck(t, q, v)
    assert ill[-1, ANGLE, 1] and not np.delete(ill.reshape(len(t), -1), 1, axis=1).any()


@pytest.mark.parametrize("rate", RATES[1:])  # at 20 Hz a window is shorter than what it takes
@pytest.mark.parametrize("sensor", [ANGLE, SPEED])
def test_live_and_at_once_know_of_the_same_rows(rate: float, sensor: int) -> None:
    t, q, v = moving(rate)
    held((q, v)[sensor], 1, rate)
    log = log_of(t, q, v)
    motion = condition(log)
    twin = Causal(1.0 / rate, gate=None)
    _, live = play(twin, log)
    at = np.searchsorted(motion.t, [now.t for now in live])
    unknown = np.array([np.isnan(now.q) for now in live])
    assert np.array_equal(unknown, np.isnan(motion.q[at]))
    assert unknown[:, 1].any() == (sensor == ANGLE)
    assert not np.delete(unknown, 1, axis=1).any()


def test_live_and_at_once_know_alike_by_how_much_a_velocity_was_off() -> None:
    t, q, v = resting(100.0)
    v[:, 1] += 0.05
    v[t >= 3.0, :2] += 0.1 * (t[t >= 3.0, None] - 3.0)  # both angles are stuck from then on
    twin, ill, live = Causal(0.01, gate=None), ever_stuck(t, q, v), []
    state = twin.init(3)
    for sample in samples(log_of(t, q, v)):
        state, _ = twin.step(state, sample)
        live.append(stuck(state.held))
    first = np.argmax(live, axis=0)
    assert first[ANGLE, 0] > 300 and first[ANGLE, 1] > 300
    assert all(ill[k, ANGLE, j] for j in (0, 1) for k in range(first[ANGLE, j], len(t)))
    assert np.array_equal(live[-1], ill[-1])


def test_a_stream_of_motion_has_the_same_numbers_at_once() -> None:
    t, q, v = moving(100.0)
    held(q, 1, 100.0)
    log = log_of(t, q, v)
    parts = [part.q for part in stream(log, rows=37)]
    assert np.array_equal(np.concatenate(parts), condition(log).q, equal_nan=True)


def test_where_a_velocity_is_stuck_angles_alone_tell_the_motion() -> None:
    t, q, v = moving(100.0)
    true = condition(log_of(t, q, np.full_like(v, np.nan))).v
    rows = held(v, 1, 100.0)
    inner = slice(rows.start + 20, rows.stop - 20)
    found = condition(log_of(t, q, v)).v
    # Windows of both kinds of log differ; a cosine's fourth derivative bounds what either misses.
    assert np.abs(found[inner, 1] - true[inner, 1]).max() < 5e-3
