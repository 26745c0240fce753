"""Warm-up, pieces that come and go, and noise that lasts are no faults."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose import diagnose
from urdyn.diagnose.fast.sensor import SensorHealth
from urdyn.diagnose.fast.sensor_signs import noisier
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.load import carried
from urdyn.diagnose.load.loads import likeliest
from urdyn.diagnose.residual import warmth
from urdyn.diagnose.residual.space import space
from urdyn.diagnose.slow import loudness, steadiness
from urdyn.diagnose.slow.learning import Learnt
from urdyn.diagnose.slow.slow import Slow
from urdyn.diagnose.slow.slow_state import LearntBy
from urdyn.model.population import KAPPA
from urdyn.simulate import happening, observe, plan, real_sensors
from urdyn.tracking.belief.model import LAG

STEP = 2.0  # [s]


def lubricant(T: np.ndarray, lag: float, start: float) -> np.ndarray:
    """Temperature of a lubricant that follows a joint's, exact for straight lines between."""
    L, told = start, [start]
    for before, after in pairwise(T):
        L = after + (L - after) * np.exp(-STEP / lag) + (before - after) * 0.5 * STEP / lag
        told.append(L)
    return np.array(told)


def test_what_nobody_knows_of_warmth_is_its_first_derivative(shop: Shop) -> None:
    of, J = space(shop.fit), 6
    t = STEP * np.arange(1.0, 900.0)
    T = 22.0 + 12.0 * (1.0 - np.exp(-t / 1500.0))
    state = warmth.unfelt(J)
    for now, warm in zip(t, T, strict=True):
        state = warmth.felt(state, np.array([now]), np.full((1, J), warm))
        if now in (t[60], t[400], t[-1]):
            w = state.lubricant - of.reference.drive.temperature
            D = warmth.unknowns(of, np.stack([w, state.slope, state.left]))
            upto = T[: round(now / STEP)]
            alike = [lubricant(upto, LAG * np.exp(e), T[0])[-1] for e in (-1e-3, 1e-3)]
            slope = -KAPPA * (alike[1] - alike[0]) / 2e-3
            at = of.places["alpha"].start
            assert abs(D[at, J] - slope) < 0.02 * abs(slope) + 2e-4
            other = lubricant(upto, LAG, T[0] + 1.0)[-1] - lubricant(upto, LAG, T[0])[-1]
            assert abs(D[at, 2 * J] + KAPPA * other) < 1e-3 * KAPPA
            np.testing.assert_allclose(D[at, 0], -w[0])


def test_an_arm_that_comes_back_cold_is_cold_throughout_however_short_its_clock_says() -> None:
    state = warmth.felt(warmth.unfelt(6), np.array([0.0]), np.full((1, 6), 40.0))
    state = warmth.felt(state, np.array([60.0]), np.full((1, 6), 14.0))
    assert abs(KAPPA * (state.lubricant - 14.0)).max() < 0.01
    assert state.left.max() < 0.01  # what it was before is forgotten


def test_widened_information_is_that_of_the_states_as_they_are_now() -> None:
    rng = np.random.default_rng(0)
    H, D = rng.standard_normal((9, 4)), rng.standard_normal((4, 3))
    r = rng.standard_normal(9)
    A, b = warmth.widened(H.T @ H, H.T @ r, D)
    G = H @ np.hstack([np.eye(4), D])
    np.testing.assert_allclose(A, G.T @ G, atol=1e-12)
    np.testing.assert_allclose(b, G.T @ r, atol=1e-12)
    root = rng.standard_normal((7, 7))
    x, P = warmth.narrowed(rng.standard_normal(7), root @ root.T, D)
    np.testing.assert_allclose(P, np.hstack([np.eye(4), D]) @ (root @ root.T)
                               @ np.hstack([np.eye(4), D]).T, atol=1e-12)  # fmt: skip
    assert x.shape == (4,)


def test_an_arm_is_never_taken_for_less_steady_than_the_rules() -> None:
    rng, window, noise = np.random.default_rng(1), np.full(2, 0.02), np.full(2, 0.004)
    steady = steadiness.by_the_rules(2)
    assert (steady.share > 0.7).all()
    for _ in range(60):
        off = np.array([0.004, 0.2]) * rng.standard_normal(2)
        steady = steadiness.learnt(steady, off, noise, window)
    assert steady.share[0] < 0.2
    assert 0.99 < steady.share[1] <= 1.0


def test_a_blocks_level_tells_how_loud_noise_is_that_lasts() -> None:
    rng, truth = np.random.default_rng(2), np.array([1.0, 12.0])
    heard, noise, rest = loudness.first(np.full(2, 4.0)), np.full(2, 1e-4), np.full(2, 1e-5)
    for _ in range(100):
        off = np.sqrt(truth * noise + rest) * rng.standard_normal(2)
        heard = loudness.heard(heard, off, np.zeros(2), noise, rest)
    # 100 squares of a Gaussian have a relative sd of .14; the grid's step is .41
    assert abs(np.log(heard.power / truth)).max() < 0.5


def blocks_to_adapt(calm: int) -> int:
    """Blocks of noise 16 times white until half of that is believed, after so many of twice."""
    rng, noise, rest = np.random.default_rng(7), np.full(1, 1e-4), np.full(1, 1e-6)
    heard = loudness.first(np.full(1, 4.0))
    for block in range(20 * calm):
        truth = 2.0 if block < calm else 16.0
        seen = np.sqrt(truth * noise + rest) * rng.standard_normal(1)
        heard = loudness.heard(heard, seen, np.zeros(1), noise, rest)
        if block >= calm and heard.power[0] > 8.0:
            return block - calm
    return 20 * calm


def test_louder_noise_is_learnt_as_soon_after_a_day_as_after_an_hour() -> None:
    """Each such block tells some .2 nats; without forgetting it takes as long as it was calm."""
    after_an_hour, after_a_day = blocks_to_adapt(720), blocks_to_adapt(10_000)
    assert 0 < after_a_day < 2 * after_an_hour < 720


def test_an_arm_is_believed_to_be_unsteady_as_soon_after_a_day_as_after_an_hour() -> None:
    def blocks(calm: int) -> int:
        rng, steady = np.random.default_rng(8), steadiness.by_the_rules(1)
        for block in range(20 * calm):
            sd = 0.004 if block < calm else 0.02
            off = sd * rng.standard_normal(1)
            steady = steadiness.learnt(steady, off, np.full(1, 0.004), np.full(1, 0.02))
            if block >= calm and steady.share[0] > 0.5:
                return block - calm
        return 20 * calm

    assert 0 < blocks(10_000) < 2 * blocks(720) < 720


def test_what_is_off_by_as_much_in_every_block_is_no_noise() -> None:
    rng, truth = np.random.default_rng(4), np.array([1.0, 12.0])
    heard, noise, rest = loudness.first(np.full(2, 4.0)), np.full(2, 1e-4), np.full(2, 1e-5)
    for block in range(100):
        sd = np.sqrt(truth * noise + rest)
        off = sd * (rng.standard_normal(2) + 4.0 * (block >= 50))
        heard = loudness.heard(heard, off, np.zeros(2), noise, rest)
    # as above; blocks are compared with their neighbours, so that half as many squares count
    assert abs(np.log(heard.power / truth)).max() < 0.6


def test_what_is_believed_of_late_makes_no_noise() -> None:
    """Where the arm was seen is compared with where it was seen, whatever was expected since."""
    rng, truth = np.random.default_rng(5), np.array([1.0, 12.0])
    noise, rest = np.full(2, 1e-4), np.full(2, 1e-5)
    plain = believed = loudness.first(np.full(2, 4.0))
    for block in range(20):
        seen = np.sqrt(truth * noise + rest) * rng.standard_normal(2)
        plain = loudness.heard(plain, seen, np.zeros(2), noise, rest)
        believed = loudness.heard(believed, seen, np.full(2, float(block > 0)), noise, rest)
    np.testing.assert_array_equal(believed.power, plain.power)


def test_what_was_unsaid_is_no_noise_either(shop: Shop) -> None:
    quiet, loud = (
        Learnt(loudness.first(power), loudness.first(power), steadiness.by_the_rules(6))
        for power in (np.full(6, 2.0), np.full(6, 50.0))
    )
    slow = Slow(space(shop.fit), 0.01, read_rules())
    state = replace(slow.init(), heard=(LearntBy(5.0, quiet), LearntBy(10.0, loud)))
    assert state.unheard(7.0).learnt is quiet
    assert state.unheard(12.0).learnt is loud
    assert state.unheard(0.0).learnt is quiet  # as far back as is known


def test_the_path_through_modes_is_the_best_of_all_paths() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        fits, was = 12.0 * rng.standard_normal((4, 3)), int(rng.integers(3))
        scores = {
            path: sum(fits[n, k] for n, k in enumerate(path))
            - carried.CHANGED * sum(a != b for a, b in zip((was, *path[:-1]), path, strict=True))
            for path in product(range(3), repeat=4)
        }
        score, path = likeliest(fits, was)
        assert path == max(scores, key=lambda p: scores[p])
        assert abs(score - max(scores.values())) < 1e-9


@pytest.mark.parametrize("seed", [7, pytest.param(8, marks=pytest.mark.slow)])
def test_pieces_that_come_and_go_in_a_warming_shift_at_20_hz_are_work(
    shop: Shop, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    work = plan("shift", shop.dynamics.arm, 150.0, 20.0, rng)
    sensors = real_sensors(shop.dynamics.arm)
    lived = happening(shop.dynamics, work, (), True)
    log = observe(shop.dynamics, work.trajectory, sensors, rng, lived)
    assert [f.text for f in diagnose(shop.fit, log)] == []


def test_an_arm_that_shakes_is_no_noisy_sensor_and_one_noisy_joint_is(shop: Shop) -> None:
    health = SensorHealth(space(shop.fit), 0.01, read_rules().fast.sensor_silent)
    alone, shaking = np.array([1.0, 4.0, 1, 1, 0.9, 1]), np.array([1.0, 4.0, 1, 3.5, 2, 1])
    assert np.flatnonzero(noisier(alone) > health.rule.noisy).tolist() == [1]
    assert not (noisier(shaking) > health.rule.noisy).any()
