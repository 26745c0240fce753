"""From a commissioned fit to the model that filters run: its posterior is the twin's prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.dbn.joined import Joined
from urdyn.dbn.robot import RobotCurrents, RobotSlice, shown_directions
from urdyn.dbn.trend import Trend
from urdyn.dbn.widening import Widening
from urdyn.identify.fit import Fit
from urdyn.model.population import Population, population
from urdyn.types import Array, Gaussian, Index

TRACKED = {
    "f": "coulomb",
    "alpha": "viscous",
    "beta": "structural",
    "o": "offset",
    "rotor": "rotor_inertia",
}
DRIFTING = ("f", "alpha", "z")  # groups with a rate: what wears
ZERO_SD = 3e-4  # [rad] of a joint's zero on the first day
HEALTH_SD = 0.01  # [-] of health on the first day: gains are the commissioned ones
PAYLOAD_SD = np.array([3.0, 0.3, 0.3, 0.3, *[0.05] * 6])  # kg, kg m, kg m²: anything or nothing


@dataclass(frozen=True)
class Drift:
    """How fast parameters of a healthy arm stray; per √s, relative where logarithms are kept."""

    friction: float = 2e-3  # [1/√s] of f and alpha: temperature, load and grease
    structural: float = 1e-3  # [1/√s]
    health: float = 1e-4  # [1/√s]
    offset: float = 1e-3  # [1/√s], of the Coulomb friction
    zero: float = 1e-6  # [rad/√s]
    rate_sd: float = 1e-5  # [1/s] of the rates on the first day
    acceleration: float = 1e-7  # [1/s/√s] of the rates


def tracking_model(fit: Fit, drift: Drift | None = None) -> Joined[RobotSlice]:
    """Observation and process of the arm that was commissioned by `fit`.

    States: k, m, f, alpha, beta, z, o, rotor, payload, and the rates of f, alpha and z. Drive gains
    stay as commissioned and the prior is conditional on them: health is relative to them.
    """
    arms = population(fit.dynamics.arm)
    V, shown = shown_directions(arms, fit.dynamics, np.random.default_rng(0))
    currents = RobotCurrents(fit.dynamics, shown, _slow_noise(fit))
    prior = _prior(fit, arms, V, currents)
    process = _process(fit, currents, prior, drift or Drift())
    return Joined(Widening(process, _at(currents, "payload"), PAYLOAD_SD), currents)


def _slow_noise(fit: Fit) -> Array:
    """White noise that says as much of a parameter as the coloured noise of the log, (J,) [A].

    Its power is the spectral density at frequency zero, where parameters live.
    """
    noise = fit.noise
    power = noise.scale**2 * noise.dof / (noise.dof - 2.0)
    return np.asarray(np.sqrt(power) / np.abs(1.0 - noise.ar.sum(axis=1)))


def _prior(fit: Fit, arms: Population, V: Array, currents: RobotCurrents) -> Gaussian:
    """The fit's belief in the filter's states, (n,)."""
    names, joints = list(fit.names), fit.dynamics.arm.joint_names
    links = 10 * len(joints)
    tracked = [names.index(f"{j}.{field}") for field in TRACKED.values() for j in joints]
    free = [*range(links), *tracked]
    gains = [k for k, name in enumerate(names) if name.endswith(".gain")]
    cov = _given(fit.belief.cov, free, gains)
    T = np.zeros((len(currents.names), len(free)))
    T[currents.places["m"], :links] = V.T / arms.link_sd.ravel()
    for k, group in enumerate(TRACKED):
        columns = links + k * len(joints) + np.arange(len(joints))
        T[_at(currents, group), columns] = 1.0
    mean = T[:, links:] @ fit.belief.mean[tracked]
    mean[currents.places["m"]] = 0.0
    whole = T @ cov @ T.T
    for group, sd in (("k", ZERO_SD), ("z", HEALTH_SD), ("payload", PAYLOAD_SD)):
        at = _at(currents, group)
        whole[at, at] = np.broadcast_to(sd, at.shape) ** 2
    return Gaussian(mean, whole)


def _given(cov: Array, free: list[int], fixed: list[int]) -> Array:
    """Covariance of `free` where `fixed`, which may be nothing, is known."""
    cross = cov[np.ix_(free, fixed)]
    told = np.linalg.solve(cov[np.ix_(fixed, fixed)], cross.T)
    return np.asarray(cov[np.ix_(free, free)] - cross @ told)


def _at(currents: RobotCurrents, group: str) -> Index:
    place = currents.places[group]
    return np.arange(place.start, place.stop)


def _process(fit: Fit, currents: RobotCurrents, prior: Gaussian, drift: Drift) -> Trend:
    diffusion = np.zeros(len(currents.names))
    spread: dict[str, float | Array] = {
        "k": drift.zero,
        "f": drift.friction,
        "alpha": drift.friction,
        "beta": drift.structural,
        "z": drift.health,
        "o": drift.offset * fit.dynamics.drive.coulomb,
    }
    for group, values in spread.items():
        diffusion[currents.places[group]] = values
    drifting = np.concatenate([_at(currents, group) for group in DRIFTING])
    one = np.ones(len(drifting))
    rates, acceleration = drift.rate_sd * one, drift.acceleration * one
    return Trend(currents.names, prior, diffusion, drifting, rates, acceleration)
