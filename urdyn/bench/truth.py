"""Whether a twin's stated errors are true: virtual arms, identified and then tracked.

The arm is drawn from identification's population, commissioned with known drive gains, and strays
by the twin's own process while it is tracked. So the truth is drawn from the filter's prior, as far
as identification made that right.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.bench.coloured import Coloured
from urdyn.bench.life import Life, commissioned_states, drawn
from urdyn.bench.spread import interval, of_root, reach, scatter
from urdyn.dbn.robot import RobotCurrents
from urdyn.estimate import Filter
from urdyn.estimate.bound import posterior_bound
from urdyn.identify import identify
from urdyn.identify.fit import Fit
from urdyn.model.arm import load_arm
from urdyn.model.dynamics import Dynamics
from urdyn.signal import condition, samples
from urdyn.simulate import fourier, observe, typical_sensors, virtual_arm
from urdyn.simulate.sensors import Sensors, real_sensors
from urdyn.tracking.belief.model import by_taken
from urdyn.tracking.belief.physical import quantities
from urdyn.tracking.belief.reading import Reading
from urdyn.tracking.step.tracker import Tracker
from urdyn.types import NORMAL90, Array, Gaussian

COMMISSIONING = 25.0  # [s]
MOMENTS = 5  # of the run, at which beliefs are compared with the truth
SENSORS = {"white": typical_sensors, "real": real_sensors}
STATES = ("k", "f", "alpha", "beta", "z", "o")  # besides m, of which few directions show
COVERS = 0.03  # [-] tolerance of coverage
COIN = 0.5  # [-] coverage that arms must exclude for a verdict
NEAR = 1.06  # [-] of the bound, required of friction
TOLD = 0.25  # [-] of the population's variance, below which a direction of m counts as observed


@dataclass(frozen=True, eq=False)
class Trial:
    """Errors of one group at MOMENTS of one run, in the filter's coordinates."""

    error: Array  # (M, d)
    sd: Array  # (M, d)
    bound: Array  # (M, d)
    nees: Array  # (M, 2) normalised error squared, and its number of directions


@dataclass(frozen=True)
class Trials:
    """One arm's run."""

    groups: dict[str, Trial]  # by symbol; "mass" [kg] of links, "all": all observed directions
    nis: tuple[float, int]  # sum, and number of currents


def trials(
    robot: str, noise: str, seed: int, duration: float, rate: float, how: Filter[Any]
) -> Trials:
    """One virtual arm, with this seed, tracked by the filter `how` for `duration` [s]."""
    dynamics = virtual_arm(load_arm(robot), seed)
    sensors = SENSORS[noise](dynamics.arm)
    fit = _commissioned(dynamics, sensors, seed, rate)
    tracker = Tracker(fit, how, 1.0 / rate)
    life = drawn(tracker.model, 0.0, duration, np.random.default_rng([seed, 2]))
    today = life.on_the_day(dynamics)
    log = observe(today, *_asked(dynamics, sensors, seed, 1, duration, rate), (life,))
    state, readings, beliefs = tracker.init(), [], []
    due = (log.t[0] + duration * (np.arange(MOMENTS) + 1.0) / MOMENTS - 0.5).tolist()
    at: list[int] = []
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        if reading is None:
            continue
        readings.append(reading)
        if due and reading.t >= due[0]:
            due.pop(0)
            beliefs.append(reading.belief)
            at.append(len(readings) - 1)
    start = commissioned_states(dynamics, fit, tracker.currents)
    bound = _bound(tracker, sensors, life, start, readings)
    truths = start + life.at(np.array([readings[k].t - life.begin for k in at]))
    news = [r.innovation for r in readings if r.innovation.measured]
    nis = (sum(i.nis for i in news), sum(i.measured for i in news))
    masses = _masses(tracker, beliefs, dynamics)
    told = _told(tracker, beliefs)
    groups = dict(_groups(tracker.currents, told, truths, bound[at]))
    return Trials(groups | {"mass": masses}, nis)


def _asked(
    dynamics: Dynamics, sensors: Sensors, seed: int, run: int, duration: float, rate: float
) -> tuple[Any, Sensors, np.random.Generator]:
    """The arm's `run`-th motion and its noise."""
    motion, noise = (np.random.default_rng([seed, run, k]) for k in range(2))
    return fourier(dynamics.arm, duration, rate, motion), sensors, noise


def _commissioned(dynamics: Dynamics, sensors: Sensors, seed: int, rate: float) -> Fit:
    log = observe(dynamics, *_asked(dynamics, sensors, seed, 0, COMMISSIONING, rate))
    return identify(dynamics.arm, condition(log), gain=dynamics.drive.gain)


def _bound(
    tracker: Tracker[Any], sensors: Sensors, life: Life, start: Array, readings: list[Reading]
) -> Array:
    """The posterior Cramer-Rao bound along the true life, (N, n)."""
    true = Coloured(tracker.model, tracker.currents.places["slow"], sensors, tracker.period)
    x = start + life.at(np.array([r.t - life.begin for r in readings]))
    lives = np.zeros((len(x), 1, len(true.names)))
    lives[:, 0, : x.shape[1]] = x
    seen = np.array([r.innovation.residual for r in readings])
    found = posterior_bound(true, [r.inputs for r in readings], seen, lives)
    return found.sd[:, : x.shape[1]]


def _told(tracker: Tracker[Any], beliefs: list[Gaussian]) -> list[Gaussian]:
    """Beliefs with the uncertainty of what is assumed known added, as in quantities."""
    p, more = len(tracker.currents.names), np.zeros_like(beliefs[0].cov)
    more[:p, :p] = by_taken(tracker.fit, tracker.currents)
    return [Gaussian(belief.mean, belief.cov + more) for belief in beliefs]


def _groups(
    currents: RobotCurrents, beliefs: list[Gaussian], truths: Array, bound: Array
) -> Iterator[tuple[str, Trial]]:
    """Every group's errors, and those of all observed directions together."""
    at, n = currents.places, truths.shape[1]
    every: list[list[Array]] = [[] for _ in beliefs]
    for group in (*STATES, "m"):
        rows, nees = np.eye(n)[at[group]], []
        for k, belief in enumerate(beliefs):
            few = rows
            if group == "m":
                variance, ways = np.linalg.eigh(belief.cov[at["m"], at["m"]])
                few = ways[:, variance < TOLD].T @ rows
            every[k].append(few)
            nees.append(_nees(belief, truths[k], few))
        error = np.array([b.mean for b in beliefs]) - truths
        sd = np.array([b.sd for b in beliefs])
        here = at[group]
        yield group, Trial(error[:, here], sd[:, here], bound[:, here], np.array(nees))
    together = [
        _nees(b, x, np.concatenate(few)) for b, x, few in zip(beliefs, truths, every, strict=True)
    ]
    nothing = np.zeros((len(beliefs), 0))
    yield "all", Trial(nothing, nothing, nothing, np.array(together))


def _nees(belief: Gaussian, truth: Array, rows: Array) -> tuple[float, int]:
    error = rows @ (belief.mean - truth)
    return float(error @ np.linalg.solve(rows @ belief.cov @ rows.T, error)), len(error)


def _masses(tracker: Tracker[Any], beliefs: list[Gaussian], dynamics: Dynamics) -> Trial:
    """Errors of link masses [kg]; what no motion shows keeps its prior."""
    of = quantities(tracker.fit, tracker.currents)
    at = [of.names.index(f"{link}.mass") for link in dynamics.arm.link_names]
    told = np.array([np.stack(of.of(belief))[:, at] for belief in beliefs])
    error = told[:, 0] - dynamics.inertials[:, 0]
    unknown = np.full_like(error, np.nan)
    return Trial(error, told[:, 1], unknown, np.full((len(beliefs), 2), np.nan))


@dataclass(frozen=True)
class Truth:
    """A group's figures over arms and moments; NaN where one arm is not enough."""

    symbol: str
    arms: int
    coverage: float  # [-] of 90 % intervals
    coverage_low: float  # [-] 95 % interval of coverage, see `spread`
    coverage_high: float
    ratio: float  # [-] root mean square error over bound
    ratio_sd: float  # its standard error over arms
    nees: float  # [-] per direction
    nees_sd: float

    @property
    def honest(self) -> bool | None:
        """Whether coverage may be as stated, and friction's error as near the bound as required.

        False: refuted, by 95 % intervals over arms; None: these do not exclude COIN.
        """
        if not np.isfinite(self.coverage_low):
            return None
        covers = self.coverage_low < 0.9 + COVERS and self.coverage_high > 0.9 - COVERS
        near = self.symbol != "f" or self.ratio < NEAR + reach(self.arms) * self.ratio_sd
        if covers and near:
            return True if self.coverage_low > COIN else None
        return False


def truths(runs: Sequence[Trials]) -> list[Truth]:
    """Figures of every group; spreads are over arms, which are independent."""
    return [_truth(symbol, [run.groups[symbol] for run in runs]) for symbol in runs[0].groups]


def _truth(symbol: str, parts: list[Trial]) -> Truth:
    covered = [_mean(np.where(np.abs(p.error) < NORMAL90 * p.sd, 1.0, 0.0)) for p in parts]
    size = [_mean((p.error / p.bound) ** 2) for p in parts]
    nees = [float(p.nees[:, 0].sum() / p.nees[:, 1].sum()) for p in parts]
    return Truth(
        symbol,
        len(parts),
        float(np.mean(covered)),
        *interval(covered, parts[0].error.shape[1]),
        float(np.sqrt(np.mean(size))),
        of_root(size),
        float(np.mean(nees)),
        scatter(nees),
    )


def surprise(runs: Sequence[Trials]) -> tuple[float, float]:
    """Normalised innovation squared per current, and its spread over arms; 1 for known noise."""
    each = [total / count for total, count in (run.nis for run in runs)]
    return float(np.mean(each)), scatter(each)


def _mean(x: Array) -> float:
    return float(np.mean(x)) if x.size else np.nan
