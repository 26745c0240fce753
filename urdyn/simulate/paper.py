"""The paper's own evaluation as data: a growing fault (eq. 5, 6) and its observation (eq. 7).

    f(t)    = f0 + r_f max(t - onset, 0)       friction, eq. 5
    z(t)    = z0 - r_z max(t - onset, 0)       health, eq. 6
    curr(t) = f(t) vel(t) + alpha + eps        current, eq. 7

Time counts in steps, as the paper's does. The paper states r_f = 0.0025, r_z = 0.005, the joint
that wears (its joint 3 is number 2 here), the onset at step 20, and that the true friction crosses
the warning level at step 60 and the critical one at step 80. The rest is reconstructed and listed
by `reconstruction`: the length of a life, first values, velocities, noise, and a sensor for z.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from urdyn.types import Array, freeze

JOINTS = 6
WORN = 2  # the paper's joint 3
ONSET, WARNING_STEP, CRITICAL_STEP = 20, 60, 80  # Figure 4 and its text
FRICTION_RATE, HEALTH_RATE = 0.0025, 0.005  # [1/step] eq. 5 and 6
# [1/step] upper limits of ramps: the only prior knowledge of their rates
STEEPEST_FRICTION, STEEPEST_HEALTH = 4.0 * FRICTION_RATE, 4.0 * HEALTH_RATE
NOISE_LEVELS = (0.01, 0.025, 0.05, 0.1, 0.25)  # r_f / sigma from 0.25 down to 0.01
# A random-walk filter of gain K lags r (1 - K) / K behind a ramp: 0.03, as the paper found.
PAPER_GAIN = FRICTION_RATE / (FRICTION_RATE + 0.03)


@dataclass(frozen=True)
class Scenario:
    """What happens to the worn joint, and the noise of its observation."""

    friction_rate: float = FRICTION_RATE  # [A·s/rad/step]
    health_rate: float = 0.0  # [1/step]
    onset: int = ONSET  # [step] last healthy one
    steps: int = 100
    sigma: float = 0.05  # of the current [A], and of the health indicator
    friction: float = 0.1  # [A·s/rad] before the onset, of every joint
    damping: float = 0.05  # [A] alpha of eq. 7, of every joint
    health: float = 1.0  # before the onset
    motion: Literal["swinging", "steady"] = "swinging"  # steady: vel = 1 throughout

    @property
    def warning(self) -> float:
        """Friction at which the paper warns: the true one at step 60."""
        return self.friction + FRICTION_RATE * (WARNING_STEP - ONSET)

    @property
    def critical(self) -> float:
        """Critical friction: the true one at step 80."""
        return self.friction + FRICTION_RATE * (CRITICAL_STEP - ONSET)

    @property
    def health_warning(self) -> float:
        """Health at which to warn: that of eq. 6 at the same step."""
        return self.health - HEALTH_RATE * (WARNING_STEP - ONSET)

    @property
    def health_critical(self) -> float:
        """Critical health."""
        return self.health - HEALTH_RATE * (CRITICAL_STEP - ONSET)


FRICTION_INCREASE = Scenario()
HEALTH_DEGRADATION = Scenario(friction_rate=0.0, health_rate=HEALTH_RATE)
HEALTHY = Scenario(friction_rate=0.0)


@dataclass(frozen=True, eq=False)
class Life:
    """One run of a scenario: the truth, and the sensors' readings."""

    t: Array  # (N,) [step] from 1
    friction: Array  # (N, J) [A·s/rad]
    damping: Array  # (N, J) [A]
    health: Array  # (N, J) [-]
    velocity: Array  # (N, J) [rad/s]
    current: Array  # (N, J) [A] as measured, eq. 7
    indicator: Array  # (N, J) [-] health as measured

    def __post_init__(self) -> None:
        freeze(self)


def ramp(t: Array, onset: float, rate: float) -> Array:
    """The growth of eq. 5 at steps t, (N,): 0 up to the onset, then `rate` per step."""
    return np.asarray(rate * np.maximum(t - onset, 0.0))


def live(scenario: Scenario, rng: np.random.Generator) -> Life:
    """One run of `scenario`; the same generator gives the same life."""
    t = np.arange(1.0, scenario.steps + 1.0)
    shape = (scenario.steps, JOINTS)
    friction, health = np.full(shape, scenario.friction), np.full(shape, scenario.health)
    friction[:, WORN] += ramp(t, scenario.onset, scenario.friction_rate)
    health[:, WORN] -= ramp(t, scenario.onset, scenario.health_rate)
    damping, velocity = np.full(shape, scenario.damping), _velocity(scenario, t, rng)
    noise = scenario.sigma * rng.standard_normal((2, *shape))
    current = friction * velocity + damping + noise[0]
    return Life(t, friction, damping, health, velocity, current, health + noise[1])


def _velocity(scenario: Scenario, t: Array, rng: np.random.Generator) -> Array:
    """Sines of mean square 1, one period per joint, so that sigma is that of friction per step."""
    if scenario.motion == "steady":
        return np.ones((len(t), JOINTS))
    period, phase = 7.0 + 2.0 * np.arange(JOINTS), rng.uniform(0.0, 2.0 * np.pi, JOINTS)
    return np.asarray(np.sqrt(2.0) * np.sin(2.0 * np.pi * t[:, None] / period + phase))


def reconstruction(scenario: Scenario) -> dict[str, str]:
    """What the paper does not state, and what is assumed here, in words."""
    swing = "sines of mean square 1 with periods of 7, 9, ... 17 steps and random phases"
    return {
        "length of a life": f"{scenario.steps} steps (Figure 4 ends after its critical level)",
        "friction before the onset": f"{scenario.friction:g} A s/rad in every joint",
        "alpha of eq. 7": f"{scenario.damping:g} A in every joint, not changing",
        "health before the onset": f"{scenario.health:g}",
        "levels of friction": f"warning {scenario.warning:g}, critical {scenario.critical:g}: "
        f"eq. 5 at steps {WARNING_STEP} and {CRITICAL_STEP}",
        "levels of health": f"warning {scenario.health_warning:g}, critical "
        f"{scenario.health_critical:g}: eq. 6 at the same steps",
        "velocities": swing if scenario.motion == "swinging" else "1 rad/s throughout",
        "noise": f"white and Gaussian, sigma {scenario.sigma:g}; others: "
        f"{', '.join(f'{sigma:g}' for sigma in NOISE_LEVELS)}. With the gain below, 0.25 gives the "
        "paper's RMSE of 0.058",
        "sensor of z": "read as it is, with the same noise: eq. 7 does not contain it",
        "known before": f"a step adds at most {STEEPEST_FRICTION:g} to friction, takes at most "
        f"{STEEPEST_HEALTH:g} from health, and neither changes by more than half of sigma",
        "the paper's filter": f"random walks, steady gain {PAPER_GAIN:.3f}: what is 0.03 low on "
        "eq. 5's ramp",
    }
