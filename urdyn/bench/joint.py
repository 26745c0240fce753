"""The worn joint of the paper's scenario under every filter, compared with the bound.

Friction f and damping alpha show in the current (eq. 7), health z in its own sensor; nothing links
the two, so they are two models. The bound is for a filter that is told the onset.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.bench.paper import GROUPS
from urdyn.bench.spread import rms
from urdyn.dbn import AffineObservation, Joined, RandomWalk, Trend
from urdyn.dbn.widening import Widening
from urdyn.estimate import (
    EKF,
    UKF,
    Filter,
    ParticleFilter,
    Variational,
    posterior_bound,
    ramp_bank,
    track,
)
from urdyn.simulate.paper import (
    PAPER_GAIN,
    STEEPEST_FRICTION,
    STEEPEST_HEALTH,
    WORN,
    Life,
    Scenario,
    live,
)
from urdyn.types import Array, Gaussian

PAPER_RMSE = {group.symbol: group.rmse for group in GROUPS}
FRICTION = Gaussian(np.array([0.2, 0.0]), np.diag([0.2**2, 0.1**2]))  # before the first reading
HEALTH = Gaussian(np.ones(1), 0.05**2 * np.eye(1))
FILTERS: dict[str, Filter[Any]] = {
    "EKF": EKF(),
    "UKF": UKF(),
    "PF (1k particles)": ParticleFilter(1000, marginalise=False),
    "VI": Variational(),
}


@dataclass(frozen=True)
class Moment:
    """A step of the scenario."""

    velocity: float  # [rad/s]
    widen: bool  # tells the bound that a ramp begins after this step
    dt: float = 1.0  # [step]
    roughly: None = None  # its slope is unknown


@dataclass(frozen=True)
class Followed:
    """How well a parameter of the scenario was tracked."""

    symbol: str
    filter: str
    process: str
    rmse: float  # over lives and steps, in the scenario's units
    bound: float
    converged: int | None  # steps until the error stays below the paper's; None: never
    ms: float  # processor time per update

    @property
    def ratio(self) -> float:
        """Error in units of the bound."""
        return self.rmse / self.bound


def follow_friction(scenario: Scenario, lives: int, seed: int = 0) -> list[Followed]:
    """f and alpha tracked by the paper's filters on its random walk, and by the bank."""
    lived = _lived(scenario, lives, seed)
    still, seen = _still(("f", "alpha"), FRICTION), _current(scenario.sigma)
    steepest = min(STEEPEST_FRICTION, 0.5 * scenario.sigma)
    bound = _bound(still, seen, steepest, scenario, lived)
    walk = Joined(_walk(scenario.sigma), seen)
    found = []
    for name, filter_ in FILTERS.items():
        how = _Way(name, "random walk", filter_, walk)
        found += how.follow(scenario, lived, bound)
    bank = ramp_bank(scenario.sigma, steepest=steepest, names=still.names)
    ours = _Way("bank", "onset x rate", bank, Joined(still, seen))
    return found + ours.follow(scenario, lived, bound)


def follow_health(scenario: Scenario, lives: int, seed: int = 0) -> list[Followed]:
    """z tracked by the bank."""
    lived = _lived(scenario, lives, seed)
    still = _still(("z",), HEALTH)
    seen = AffineObservation[Moment](1, lambda _: np.eye(1), scenario.sigma**2 * np.eye(1))
    steepest = min(STEEPEST_HEALTH, 0.5 * scenario.sigma)
    bank = ramp_bank(scenario.sigma, -1, steepest=steepest, names=still.names, rate="z.rate")
    ours = _Way("bank", "onset x rate", bank, Joined(still, seen))
    return ours.follow(scenario, lived, _bound(still, seen, steepest, scenario, lived))


@dataclass(frozen=True, eq=False)
class _Way:
    """A filter on a model."""

    name: str
    process: str
    filter: Filter[Any]
    model: Joined[Moment]

    def follow(
        self, scenario: Scenario, lived: Sequence[Life], bound: dict[str, Array]
    ) -> list[Followed]:
        """Track every parameter that has a bound, (lives, N)."""
        begin = time.process_time()
        tracks = [
            track(self.filter, self.model, _moments(life, scenario), _seen(life, bound))
            for life in lived
        ]
        ms = 1e3 * (time.process_time() - begin) / (len(lived) * scenario.steps)
        told = []
        for symbol, sd in bound.items():
            error = np.array(
                [t[symbol] - _truth(life, symbol) for t, life in zip(tracks, lived, strict=True)]
            )
            converged = _converged(error, PAPER_RMSE[symbol])
            told.append(
                Followed(symbol, self.name, self.process, rms(error), rms(sd), converged, ms)
            )
        return told


def _lived(scenario: Scenario, lives: int, seed: int) -> list[Life]:
    return [live(scenario, np.random.default_rng([seed, k])) for k in range(lives)]


def _still(names: tuple[str, ...], prior: Gaussian) -> Trend:
    """A process without drift; the first parameter has a rate, for a ramp that may begin."""
    none = np.zeros(1)
    return Trend(names, prior, np.zeros(len(names)), np.array([0]), none, none)


def _walk(sigma: float) -> RandomWalk:
    """The paper's process, with the diffusion that gives its gain."""
    diffusion = PAPER_GAIN / np.sqrt(1.0 - PAPER_GAIN) * sigma
    return RandomWalk(("f", "alpha"), FRICTION, np.full(2, diffusion))


def _current(sigma: float) -> AffineObservation[Moment]:
    """Eq. 7."""
    return AffineObservation(2, lambda u: np.array([[u.velocity, 1.0]]), sigma**2 * np.eye(1))


def _bound(
    process: Trend,
    seen: AffineObservation[Moment],
    steepest: float,
    scenario: Scenario,
    lived: Sequence[Life],
) -> dict[str, Array]:
    """Bound of each parameter in each life, (lives, N); the rate has the bank's prior variance."""
    rate = np.array([len(process.parameters)])
    told = Widening(process, rate, np.array([steepest / np.sqrt(12.0)]))
    model = Joined[Moment](told, seen)
    found = [posterior_bound(model, _moments(life, scenario)) for life in lived]
    return {name: np.array([b[name] for b in found]) for name in process.parameters}


def _moments(life: Life, scenario: Scenario) -> list[Moment]:
    return [
        Moment(float(v), t == scenario.onset)
        for t, v in zip(life.t, life.velocity[:, WORN], strict=True)
    ]


def _seen(life: Life, bound: dict[str, Array]) -> Array:
    """Readings of these parameters' sensor, (N, 1)."""
    return (life.indicator if "z" in bound else life.current)[:, [WORN]]


def _truth(life: Life, symbol: str) -> Array:
    series = {"f": life.friction, "alpha": life.damping, "z": life.health}
    return series[symbol][:, WORN]


def _converged(error: Array, level: float) -> int | None:
    """Steps after which the RMS error (lives, N) over lives stays below `level`."""
    far = np.sqrt(np.mean(error**2, axis=0)) > level
    last = int(np.flatnonzero(far)[-1]) + 1 if far.any() else 0
    return None if last == len(far) else last
