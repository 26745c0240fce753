"""The paper's scenario: its equations, and the figures that the reconstruction gives back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.simulate.paper import (
    CRITICAL_STEP,
    FRICTION_INCREASE,
    HEALTH_DEGRADATION,
    HEALTHY,
    ONSET,
    PAPER_GAIN,
    WARNING_STEP,
    WORN,
    Scenario,
    live,
    reconstruction,
)


def test_levels_are_crossed_when_the_paper_says() -> None:
    for scenario, sign in ((FRICTION_INCREASE, 1.0), (HEALTH_DEGRADATION, -1.0)):
        life = live(scenario, np.random.default_rng(0))
        truth = sign * (life.friction if sign > 0 else life.health)[:, WORN]
        levels = (
            (scenario.warning, scenario.critical)
            if sign > 0
            else (-scenario.health_warning, -scenario.health_critical)
        )
        crossed = [int(life.t[truth >= level - 1e-12][0]) for level in levels]
        assert crossed == [WARNING_STEP, CRITICAL_STEP]
        assert np.ptp(truth[: ONSET - 1]) == 0.0


def test_only_the_worn_joint_wears_and_a_healthy_life_has_none() -> None:
    rng = np.random.default_rng(1)
    life, healthy = live(FRICTION_INCREASE, rng), live(HEALTHY, rng)
    assert np.ptp(np.delete(life.friction, WORN, axis=1)) == np.ptp(life.health) == 0.0
    assert np.ptp(healthy.friction) == np.ptp(healthy.health) == 0.0


def test_a_seed_is_a_life() -> None:
    lives = [live(Scenario(), np.random.default_rng(seed)).current for seed in (5, 5, 6)]
    np.testing.assert_array_equal(lives[0], lives[1])
    assert (lives[0] != lives[2]).all()


@pytest.mark.parametrize("motion", ["swinging", "steady"])
def test_eq_7_leaves_white_noise(motion: str) -> None:
    """Chi-square of 600 readings of current and as many of health, four standard deviations."""
    scenario = Scenario(motion=motion, health_rate=0.005)  # type: ignore[arg-type]
    life = live(scenario, np.random.default_rng(2))
    left = (
        life.current - life.friction * life.velocity - life.damping,
        life.indicator - life.health,
    )
    for noise in left:
        assert (noise**2).sum() / scenario.sigma**2 == pytest.approx(600, abs=4 * np.sqrt(1200))


def test_the_reconstructed_filter_is_as_late_as_the_papers() -> None:
    """0.03 low on the ramp, and at sigma = 0.25 an RMSE of 0.058 once the fault is detected."""
    scenario, errors = Scenario(sigma=0.25, motion="steady"), []
    for seed in range(100):
        life = live(scenario, np.random.default_rng(seed))
        estimate, followed = scenario.friction, []
        for y in life.current[:, WORN] - scenario.damping:
            estimate += PAPER_GAIN * (y - estimate)
            followed.append(estimate)
        errors.append(np.array(followed) - life.friction[:, WORN])
    # The mean of 100 runs over 40 correlated steps scatters by 0.05 / 10; the RMSE by 4 %.
    assert np.mean(errors, axis=0)[60:].mean() == pytest.approx(-0.03, abs=0.01)
    assert np.sqrt(np.mean(np.square(errors)[:, 38:])) == pytest.approx(0.058, rel=0.1)


def test_what_was_reconstructed_is_told_with_its_figures() -> None:
    told = reconstruction(replace(FRICTION_INCREASE, sigma=0.07))
    assert "0.07" in told["noise"] and "0.2," in told["levels of friction"]
