"""Many lives by the paper's eq. 5 to 7, and every detector's performance on them.

Runs are parallel streams: a guarantee of one alarm in N steps over R of them is one in N R for
each. Only growth relative to noise counts, so lives are in units of their sigma, and one baseline
serves all noise levels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from urdyn.bench.fault_noises import NOISES, Noise
from urdyn.faults import (
    GLR,
    Algorithm2,
    Baseline,
    Cusum,
    Detector,
    Interval,
    ShiryaevRoberts,
    Whitened,
    calibrated,
    foresee,
    learn_baseline,
    oracle_cusum,
    run,
    tuned_algorithm2,
)
from urdyn.faults.onset import follow, kinks
from urdyn.report.bench.faults import Kept, Predicted
from urdyn.report.bench.figure_four import Foreseen
from urdyn.report.bench.table_three import TOGETHER, Row
from urdyn.simulate import paper
from urdyn.types import Array

PROMISE = 10_000.0  # [steps]
STEPS = 1000  # of a baseline, and of a healthy run
FAULTS = {
    "friction increase": paper.FRICTION_INCREASE,
    "health degradation": paper.HEALTH_DEGRADATION,
}
AS_PUBLISHED = "Algorithm 2, as in the paper"
PREDICTED_AT = (25, 40)  # [steps] after the onset
FIGURE_NOISE = 0.025  # sigma in Figure 4


@dataclass(frozen=True)
class Trials:
    """`runs` lives of each kind, a multiple of the number of joints."""

    runs: int
    seed: int = 0

    @cached_property
    def healthy(self) -> tuple[Array, Array]:
        """Baselines and healthy runs [sigma], (STEPS, runs) each."""
        rng = np.random.default_rng(self.seed)
        calm = replace(paper.HEALTHY, steps=2 * STEPS, motion="steady", sigma=1.0)
        lives = range(self.runs // paper.JOINTS)
        whole = np.hstack([_seen(paper.live(calm, rng), calm) for _ in lives])
        return whole[:STEPS], whole[STEPS:]

    @cached_property
    def baseline(self) -> Baseline:
        """The healthy baseline, learnt for each run."""
        return learn_baseline(self.healthy[0])

    def arms(self, scenario: paper.Scenario, lives: int) -> Array:
        """All joints' parameters as measured [sigma], (N, lives, J); any fault makes them rise."""
        rng = np.random.default_rng(self.seed + 1)
        return np.stack([_seen(paper.live(scenario, rng), scenario) for _ in range(lives)], axis=1)

    def detectors(self, ratio: float) -> dict[str, Detector[Any]]:
        """All detectors, at the guaranteed false alarm rate where they have one."""
        each = PROMISE / self.runs
        warning, critical = (ratio * (x - paper.ONSET) for x in (60, 80))
        return {
            "Shiryaev-Roberts": Whitened(self.baseline, ShiryaevRoberts(each, side=1.0)),
            "CUSUM": Whitened(self.baseline, Cusum(each, side=1.0)),
            "GLR": Whitened(self.baseline, GLR(each, side=1.0)),
            "Algorithm 2, tuned": tuned_algorithm2(self.healthy[0], critical, each),
            AS_PUBLISHED: Algorithm2(warning, critical, 0.5 * ratio, ratio, gain=paper.PAPER_GAIN),
        }


def _seen(life: paper.Life, scenario: paper.Scenario) -> Array:
    """Deviation of what wears from its healthy value [sigma], (N, J): friction, or lost health.

    Friction is by eq. 7, at velocity 1 throughout.
    """
    if scenario.health_rate:
        return (scenario.health - life.indicator) / scenario.sigma
    return (life.current - scenario.friction - scenario.damping) / scenario.sigma


def first_alarms(detector: Detector[Any], series: Array, each: int = 1) -> Array:
    """Row of each run's first alarm; the series' length where there is none.

    Args:
        series: (N, runs * each): each run consists of `each` adjacent streams.
    """
    steps, streams = series.shape
    state, first = detector.init(streams), np.full(streams // each, steps)
    for row, values in enumerate(series):
        state, verdict = detector.step(state, values)
        evidence = verdict.streams.reshape(-1, each).sum(axis=1)
        first = np.where((evidence >= 1.0) & (first == steps), row, first)
    return first


def rated(trials: Trials, levels: tuple[float, ...] = paper.NOISE_LEVELS) -> Iterator[Row]:
    """Every detector on every fault at every noise level."""
    quiet = {
        name: first_alarms(detector, trials.healthy[1])
        for name, detector in trials.detectors(1.0).items()
        if name != AS_PUBLISHED  # its thresholds depend on the noise
    }
    together = Whitened(
        trials.baseline, ShiryaevRoberts(PROMISE * paper.JOINTS / trials.runs, side=1.0)
    )
    quiet[TOGETHER] = first_alarms(together, trials.healthy[1], paper.JOINTS)
    for fault, scenario in FAULTS.items():
        for sigma in levels:
            now = replace(scenario, sigma=sigma, motion="steady", steps=paper.ONSET + 200)
            yield from _rows(trials, fault, now, quiet)


def _rows(
    trials: Trials, fault: str, scenario: paper.Scenario, quiet: dict[str, Array]
) -> Iterator[Row]:
    """One fault at one noise level; the oracle first."""
    ratio = max(scenario.friction_rate, scenario.health_rate) / scenario.sigma
    arms = trials.arms(scenario, trials.runs)
    series, calm = arms[:, :, paper.WORN], trials.healthy[1]
    known = oracle_cusum(calm, ratio)
    above = oracle_cusum(series, ratio) >= calibrated(known, PROMISE)
    best = np.where(above.any(axis=0), above.argmax(axis=0), len(series))
    found, delay, lives = _outcome(best, series)
    oracle = Row(fault, scenario.sigma, ratio, "oracle CUSUM", found, delay, 1.0,
                 1000.0 / PROMISE, lives)  # fmt: skip
    yield oracle
    for name, detector in trials.detectors(ratio).items():
        found, delay, lives = _outcome(first_alarms(detector, series), series)
        false = quiet[name] if name in quiet else first_alarms(detector, calm)
        over = delay / oracle.delay
        yield Row(fault, scenario.sigma, ratio, name, found, delay, over, _rate(false), lives)
    count = trials.runs // paper.JOINTS
    whole = arms[:, :count].reshape(len(arms), -1)
    together = Whitened(trials.baseline, ShiryaevRoberts(PROMISE / count, side=1.0))
    found, delay, lives = _outcome(first_alarms(together, whole, paper.JOINTS), whole)
    row = Row(fault, scenario.sigma, ratio, TOGETHER, found, delay, delay / oracle.delay,
              _rate(quiet[TOGETHER]), lives)  # fmt: skip
    yield row


def _outcome(first: Array, series: Array) -> tuple[float, float, int]:
    """Share found in time, mean delay [steps], and number of lives without alarm before onset.

    NaN where there are none.
    """
    told = first[first >= paper.ONSET] + 1 - paper.ONSET
    if not len(told):
        return np.nan, np.nan, 0
    in_time = float((told <= paper.WARNING_STEP - paper.ONSET).mean())
    ever = told <= len(series) - paper.ONSET
    delay = float(told[ever].mean()) if ever.mean() > 0.99 else np.nan
    return in_time, delay, len(told)


def _rate(first: Array) -> float:
    """Alarms per 1000 healthy steps: their number over the steps up to them."""
    return 1000.0 * float((first < STEPS).sum()) / float(np.minimum(first + 1, STEPS).sum())


def kept(runs: int, seed: int) -> Iterator[Kept]:
    """The guarantee under every kind of noise."""
    for name, noise in NOISES.items():
        rng = np.random.default_rng(seed)
        yield Kept(name, alarmed(noise, runs, rng), 1.0 - float(np.exp(-STEPS / PROMISE)), runs)


def alarmed(noise: Noise, runs: int, rng: np.random.Generator) -> float:
    """Share of healthy runs with an alarm, each with its own baseline."""
    baseline = learn_baseline(noise.draw(rng, STEPS, runs))
    detector = Whitened(baseline, ShiryaevRoberts(PROMISE / runs))
    first = first_alarms(detector, noise.draw(rng, STEPS, runs, noise.scale))
    return float((first < STEPS).mean())


def predicted(trials: Trials, sigmas: tuple[float, ...] = (0.01, 0.05)) -> Iterator[Predicted]:
    """Forecasts of the critical crossing compared with the truth."""
    for sigma in sigmas:
        scenario = replace(paper.FRICTION_INCREASE, sigma=sigma, motion="steady")
        series = trials.arms(scenario, trials.runs)[:, :, paper.WORN]
        state = kinks(trials.baseline)
        end = trials.baseline.typical + (scenario.critical - scenario.friction) / sigma
        for step, values in enumerate(series, 1):
            state = follow(trials.baseline, state, values)
            if step - paper.ONSET in PREDICTED_AT:
                left = float(paper.CRITICAL_STEP - step)
                made = [one.critical for one in foresee(trials.baseline, state, end, end)]
                error = np.median([abs(one.median - left) / left for one in made])
                inside = np.mean([one.low <= left <= one.high for one in made])
                age = step - paper.ONSET
                yield Predicted(sigma, age, left, float(error), float(inside), len(made))


def figure4(seed: int) -> Foreseen:
    """One life: truth, the paper's filter, ours, and the expected end."""
    scenario = replace(paper.FRICTION_INCREASE, sigma=FIGURE_NOISE, motion="steady")
    rng = np.random.default_rng(seed)
    calm = replace(paper.HEALTHY, sigma=FIGURE_NOISE, motion="steady", steps=STEPS)
    baseline = learn_baseline(_friction(paper.live(calm, rng)))
    life = paper.live(scenario, rng)
    y, end = _friction(life), scenario.critical
    state, filtered = kinks(baseline), scenario.friction
    rows: list[tuple[float, ...]] = []
    for step, value in enumerate(y, 1):
        state = follow(baseline, state, value)
        made = foresee(baseline, state, np.array([scenario.warning]), np.array([end]))[0]
        filtered += paper.PAPER_GAIN * (float(value[0]) - filtered)
        now = baseline.typical[0] + _told(made.change)
        rows.append((filtered, *now, *(step + _told(made.critical))))
    columns = np.array(rows).T
    alarm = run(Whitened(baseline, ShiryaevRoberts(PROMISE)), y).alarm
    return Foreseen(
        life.t, life.friction[:, paper.WORN], columns[0], columns[1:4].T, columns[4:].T,
        scenario.warning, end, paper.ONSET, None if alarm is None else alarm + 1, FIGURE_NOISE,
    )  # fmt: skip


def _friction(life: paper.Life) -> Array:
    """Friction of the worn joint by eq. 7 with known damping, (N, 1) [A s/rad]."""
    j = paper.WORN
    return ((life.current - life.damping) / life.velocity)[:, j : j + 1]


def _told(interval: Interval) -> Array:
    """Median and limits, (3,)."""
    return np.array([interval.median, interval.low, interval.high])
