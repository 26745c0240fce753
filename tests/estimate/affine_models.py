"""Models on which the truth is known, shared by the tests of this room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.dbn import AffineObservation, Joined, Tick
from urdyn.estimate import (
    EKF,
    UKF,
    FixedLag,
    InformationFilter,
    Kalman,
    ParticleFilter,
    Variational,
)
from urdyn.types import Array, Gaussian, Mask

Model = Joined[Any]

# Filters that are Kalman's on an affine model, up to rounding. A new one is added here.
EXACT = [
    Kalman(),
    EKF(),
    EKF(iterations=3),
    UKF(),
    UKF("merwe", alpha=1e-2),
    UKF(alpha=1.0, beta=0.0),
    UKF("simplex"),
    InformationFilter(),
    Variational(),
    Variational(rule="simplex", iterations=40, step_size=0.5),
    ParticleFilter(count=7),
    FixedLag(lag=0),
]


@dataclass(frozen=True, eq=False)
class AffineProcess:
    """x' = F x + b + w, the same in every slice whatever its inputs."""

    names: tuple[str, ...]  # n
    prior: Gaussian  # (n,), (n, n)
    F: Array  # (n, n)
    Q: Array  # (n, n)
    b: Array  # (n,)

    @property
    def linear(self) -> Mask:
        return np.ones(len(self.names), dtype=bool)

    def transition(self, x: Array, u: Any) -> Array:
        return x @ self.F.T + self.b

    def transition_jacobian(self, x: Array, u: Any) -> Array:
        return self.F

    def transition_cov(self, u: Any) -> Array:
        return self.Q


@dataclass(frozen=True, eq=False)
class Regressors:
    """Inputs of a slice for a model that is linear in its parameters."""

    Y: Array  # (m, n)
    dt: float = 1.0


def random_model(rng: np.random.Generator, n: int, m: int) -> Model:
    """A stable affine model without symmetry of any kind."""
    turn = rng.standard_normal((n, n))
    F = 0.95 * turn / np.abs(np.linalg.eigvals(turn)).max()
    H, d = rng.standard_normal((m, n)), rng.standard_normal(m)
    prior = Gaussian(rng.standard_normal(n), random_cov(rng, n))
    names = tuple(f"x{i}" for i in range(n))
    process = AffineProcess(names, prior, F, 0.1 * random_cov(rng, n), rng.standard_normal(n))
    return Joined(process, AffineObservation(n, lambda u: H, random_cov(rng, m), d))


def random_cov(rng: np.random.Generator, n: int) -> Array:
    root = rng.standard_normal((n, n))
    return root @ root.T + 0.1 * np.eye(n)


def simulate(model: Model, inputs: list[Any], rng: np.random.Generator) -> tuple[Array, Array]:
    """One life of the model: states (N, n) and observations (N, m)."""
    x = rng.multivariate_normal(model.prior.mean, model.prior.cov)
    states, seen = [], []
    for u in inputs:
        x = rng.multivariate_normal(model.transition(x, u), model.transition_cov(u))
        states.append(x)
        seen.append(rng.multivariate_normal(model.observe(x, u), model.observe_cov(u)))
    return np.array(states), np.array(seen)


def ticks(count: int) -> list[Tick]:
    return [Tick()] * count
