"""What a live stream does to the causal twin, and what its gate refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import binom, norm
from streams import log_of, play, stacked, swing

from urdyn.signal import Causal, Gate, Sample, samples
from urdyn.signal.gate import FINEST

STEP = 0.01


def test_a_gap_and_a_clock_set_back_begin_anew() -> None:
    t = STEP * np.arange(90)
    q, v = swing(t)
    state, live = play(Causal(STEP, half=4), log_of(np.where(t < 0.295, t, t + 1.0), q, v))
    assert (state.restarts, len(live)) == (1, 22 + 52)
    twin = Causal(STEP, half=4)
    for sample in samples(log_of(t[:20], q[:20], v[:20])):
        state, instant = twin.step(state, sample)
    assert state.restarts == 2 and instant is not None


def test_a_repeated_stamp_is_left_out_and_counted() -> None:
    t = STEP * np.arange(40)
    twin, log = Causal(STEP, half=4), log_of(t, *swing(t))
    rows = list(samples(log))
    state, out = twin.init(3), []
    for sample in [row for row in rows for _ in range(2)]:
        state, instant = twin.step(state, sample)
        out += [instant] if instant else []
    assert state.repeats == 40
    assert np.array_equal(stacked(out, "a"), stacked(play(twin, log)[1], "a"))


def test_a_torn_sample_is_refused_and_nothing_else() -> None:
    t = STEP * np.arange(100)
    q, v = swing(t)
    q[60, 1], v[70, 2] = 40.0, -90.0
    state, live = play(Causal(STEP, half=4), log_of(t, q, v))
    assert state.refused == 2
    truth = swing(stacked(live, "t"))
    assert np.abs(stacked(live, "v") - truth[1]).max() < 1e-3 * 3.0
    torn = play(Causal(STEP, half=4, gate=None), log_of(t, q, v))[1]
    assert np.abs(stacked(torn, "v") - truth[1]).max() > 1.0


def test_samples_of_zeros_are_no_measurement() -> None:
    """All of them: the first would be refused as a jump, the others as an arm that stands at 0."""
    t = STEP * np.arange(200)
    log = log_of(t, *swing(t))
    told = ((t < t[100]) | (t > t[139]))[:, None]
    zeros = {name: x * told for name, x in log.channels.items()}
    state, live = play(Causal(STEP, half=4), replace(log, channels=zeros))
    assert state.refused == 40 * 6  # angles and speeds of three joints
    inside = [one for one in live if t[100] <= one.t <= t[139]]
    assert inside and all(np.isnan(one.current).all() for one in inside)
    assert all(np.isnan(one.q).any() or np.abs(one.q).max() > 0.5 for one in inside)


def test_a_step_that_is_real_costs_one_sample() -> None:
    t = STEP * np.arange(100)
    q, v = swing(t)
    q[50:] += 3.0
    state, live = play(Causal(STEP, half=4), log_of(t, q, v))
    assert state.refused == 3  # one a joint
    assert np.abs(stacked(live, "q")[-20:] - 3.0 - swing(t)[0][-24:-4]).max() < 1e-3


def test_a_sensor_that_is_always_rough_is_not_gated() -> None:
    t = STEP * np.arange(400)
    rough = np.random.default_rng(4).normal(scale=0.2, size=(2, 400, 3))
    log = log_of(t, *rough)
    by_reach, _ = play(Causal(STEP, half=18, gate=Gate(sigma=0.0)), log)
    by_both, _ = play(Causal(STEP, half=18), log)
    assert by_reach.refused > 0.2 * rough.size / 2  # of the angles
    # six sd of noise, were they known; 37 departures know a spread to 20 %: beyond four sd
    assert by_both.refused <= binom.ppf(1 - 1e-4, rough.size, 2 * norm.sf(4.0))


def test_states_are_values() -> None:
    t = STEP * np.arange(30)
    twin, rows = Causal(STEP, half=4), list(samples(log_of(t, *swing(t))))
    state = twin.init(3)
    for row in rows[:20]:
        state, _ = twin.step(state, row)
    before = state.rows.copy()
    first, second = twin.step(state, rows[20])[1], twin.step(state, rows[20])[1]
    assert first is not None and second is not None
    assert np.array_equal(first.a, second.a) and np.array_equal(state.rows, before, equal_nan=True)


def test_what_was_not_measured_is_never_made_up() -> None:
    t = STEP * np.arange(30)
    q, v = swing(t)
    q[10:], v[10:] = np.nan, np.nan
    _, live = play(Causal(STEP, half=4), log_of(t, q, v))
    assert np.isnan(live[-1].q).all() and np.isfinite(live[-1].current).all()


def test_a_gate_never_refuses_what_an_arm_can_do() -> None:
    gate, dt = Gate(acceleration=50.0), 0.002
    still, history = np.zeros((2, 1)), np.zeros((5, 2, 1))

    def refused(q: float, v: float) -> list[bool]:
        departure = gate.departure(still, np.array([[q], [v]]), dt)
        return gate.refuses(departure, history, dt, np.array([[0.0], [v]])).ravel().tolist()

    speed, way = 50.0 * dt, 50.0 * dt * dt
    assert refused(0.999 * way / 2, 0.999 * speed) == [False, False]  # the fastest start
    assert refused(0.999 * way / 4, 0.0) == [False, False]  # and the furthest there is without one
    assert refused(1.001 * way / 4 + FINEST, 0.0) == [True, False]
    assert refused(0.0, 1.001 * speed) == [False, True]


def test_a_sample_is_a_row() -> None:
    t = STEP * np.arange(3)
    log = log_of(t, *swing(t))
    first = next(iter(samples(log)))
    assert isinstance(first, Sample) and np.array_equal(first.q, log.channels["actual_q"][0])
    assert np.isnan(replace(first).temperature).all()
