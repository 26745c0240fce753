"""A joint's friction against its speed, with the posterior's band."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from urdyn.identify import Fit
from urdyn.model.population import population
from urdyn.types import Array

DRAWS = 400
BAND = (0.05, 0.95)
SHAPING = ("coulomb", "viscous", "offset", "stribeck", "stribeck_velocity")


@dataclass(frozen=True, eq=False)
class Curve:
    """Sliding friction of one joint without load."""

    v: Array  # (G,) [rad/s]
    torque: Array  # (G,) [N·m], at the posterior's maximum
    low: Array  # (G,) [N·m], of the 90 % band
    high: Array  # (G,) [N·m]


def friction(c: Mapping[str, ArrayLike], v: Array) -> Array:
    """(f + g exp(-|v|/v_s)) sign(v) + alpha v + o, [N·m]; broadcasts coefficients with v."""
    f, alpha, o, g, v_s = (np.asarray(c[name]) for name in SHAPING)
    return np.asarray((f + g * np.exp(-np.abs(v) / v_s)) * np.sign(v) + alpha * v + o)


def friction_curve(fit: Fit, joint: int, v: Array, rng: np.random.Generator) -> Curve:
    """Friction of one joint at speeds `v`, (G,) [rad/s], with its 90 % band."""
    draws = friction({k: x[:, None] for k, x in _draw(fit, joint, rng).items()}, v)
    low, high = np.quantile(draws, BAND, axis=0)
    return Curve(v, friction(coefficients(fit, joint), v), low, high)


def coefficients(fit: Fit, joint: int) -> dict[str, float]:
    """The joint's estimates that determine the curve."""
    return {name: float(getattr(fit.dynamics.drive, name)[joint]) for name in SHAPING}


def _draw(fit: Fit, joint: int, rng: np.random.Generator) -> dict[str, Array]:
    """Draws of those coefficients from the posterior, (DRAWS,) each; constant if not estimated."""
    name = fit.dynamics.arm.joint_names[joint]
    sought = [field for field in SHAPING if f"{name}.{field}" in fit.names]
    at = [fit.names.index(f"{name}.{field}") for field in sought]
    marginal = fit.belief.cov[np.ix_(at, at)]
    x = rng.multivariate_normal(fit.belief.mean[at], marginal, DRAWS, method="eigh")
    prior = population(fit.dynamics.arm).drive
    found = {k: np.full(DRAWS, value) for k, value in coefficients(fit, joint).items()}
    for k, field in enumerate(sought):
        found[field] = np.exp(x[:, k]) if prior[field].positive else x[:, k]
    return found
