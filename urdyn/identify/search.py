"""The search for an arm's dynamics.

First, plain least squares on an excerpt finds the shape of friction; then held-out likelihood
selects the terms of each joint's model; then comes the whole likelihood (coloured noise, heavy
tails); last, all data at once. Every step compresses the data at a point, solves, and moves the
point.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, count
from typing import NamedTuple

import numpy as np

from urdyn.identify.band import EVERYTHING, Band, common_band
from urdyn.identify.compress import absorbed_periodograms, compress, residuals, turnings
from urdyn.identify.excerpt import excerpt, folds
from urdyn.identify.expressions import dynamics, physical
from urdyn.identify.fit import Fit
from urdyn.identify.map_estimate import (
    Compressed,
    build_problem,
    coefficient_roots,
    posterior,
    solve,
)
from urdyn.identify.noise import GAUSSIAN, Noise, fit_noise, white_noise
from urdyn.identify.rank import data_rank
from urdyn.identify.select import select_terms
from urdyn.identify.typical_noise import typical_noise
from urdyn.identify.unknowns import PayloadPrior, Unknowns
from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import OPTIONAL, population
from urdyn.progress import Progress
from urdyn.signal.channels import mean_measured
from urdyn.signal.stretches import median_step
from urdyn.types import Array, Gaussian, Mask, Motion, V

EXCERPT = 24_000  # rows, at most, on which the shape of friction is sought
SHAPING = 8  # rounds of plain least squares to find the shape of friction
SETTLING = 2  # rounds of plain least squares where friction lost its fading term
ROUNDS = 3  # rounds of the whole likelihood on the excerpt
ALIKE = 1.2  # [-] ratio of sampling periods up to which rates count as equal
DAMPING = 0.5  # share of a shaping step to take: presliding and Stribeck trade off
FOLDS = 6
PROBE = 2e-3  # [s] to either side, in the search for when friction reverses
# [K] that temperatures have to vary: over less, the 2 % by which a sound joint's viscous friction
# strays otherwise from run to run would count for more than an arm's kind tells, ± 0.4 %/K.
WARMED = 5.0
MAX_LEAD = 0.03  # [s] largest known lead of a controller


@dataclass(frozen=True)
class Run:
    """A motion, and the arm's payload in it; None: none."""

    motion: Motion
    payload: PayloadPrior | None = None


class Laden(NamedTuple):
    """A run's motion, with the arm as loaded in it."""

    motion: Motion
    point: Dynamics
    payload: int | None  # index among the unknowns' payloads; None: none
    band: Band  # in which currents are compared


@dataclass(frozen=True, eq=False)
class State:
    """State of the search: a value, from which each step makes the next."""

    unknowns: Unknowns
    z: Array  # (P,) standard scores
    noises: tuple[Noise, ...]  # one per run, in its own rows; the same for equal rates
    temperature: Array  # (J,) [°C] mean over the runs, to which friction refers; NaN: not measured
    bands: tuple[Band, ...]  # likewise, in which currents are compared
    friction_time: float = 0.0  # [s] by which friction reverses before the recorded motion
    cov: Array | None = None  # (P, P) of z; None: not yet computed
    point: Dynamics = field(init=False)  # the arm at z, with its tool
    payloads: tuple[Array, ...] = field(init=False)  # inertials (10,) each

    def __post_init__(self) -> None:
        point, payloads = dynamics(self.unknowns, self.z, self.friction_time, self.temperature)
        object.__setattr__(self, "point", point)
        object.__setattr__(self, "payloads", payloads)

    def loaded(self, runs: Sequence[Run]) -> list[Laden]:
        """Every run with its load."""
        arms = [replace(self.point, payload=self.point.payload + own) for own in self.payloads]
        index, found = count(), list[Laden]()
        for run, band in zip(runs, self.bands, strict=True):
            k = next(index) if run.payload else None
            found.append(Laden(run.motion, self.point if k is None else arms[k], k, band))
        return found


def search(
    arm: Arm, runs: Sequence[Run], gain: Array | None, tool: Array | None, progress: Progress
) -> Fit:
    """The fit to all runs, which `identify` has checked."""
    brief = [replace(run, motion=excerpt(run.motion, EXCERPT // len(runs))) for run in runs]
    state = _start(arm, runs, gain, np.zeros(10) if tool is None else tool)
    state = _shape(state, brief, progress)
    progress("terms of the model", 0.5)
    state = _select(_with_noise(state, brief), brief)
    for _ in range(SETTLING):
        state = _settle(state, brief)
    for k in range(ROUNDS):
        progress("colour of the noise", 0.6 + 0.2 * k / ROUNDS)
        state = _sure_step(_with_noise(state, brief), brief)
    progress("all data", 0.8)
    fit = _finish(_with_noise(state, brief), runs)
    return replace(fit, tool_known=tool is not None)


def _start(arm: Arm, runs: Sequence[Run], gain: Array | None, tool: Array) -> State:
    payloads = tuple(run.payload for run in runs if run.payload)
    temperature = mean_measured(np.concatenate([run.motion.temperature for run in runs]))
    terms = tuple(OPTIONAL if told else OPTIONAL - {"thermal"} for told in _warmed(runs))
    unknowns = Unknowns(population(arm), terms, gain, payloads, tool)
    one = np.ones(arm.joints)
    unit = Noise(one, one, GAUSSIAN * one, np.zeros((arm.joints, 0)))
    rates = _rates(runs)

    def band(rate: int) -> Band:
        pairs = zip(runs, rates, strict=True)
        return common_band([run.motion for run, its in pairs if its == rate])

    start, noises = np.zeros(len(unknowns.mean)), (unit,) * len(runs)
    return State(unknowns, start, noises, temperature, _of_each(rates, band))


def _warmed(runs: Sequence[Run]) -> Mask:
    """Joints whose temperature varied enough to tell the effect of warmth on friction, (J,)."""
    seen = np.concatenate([run.motion.temperature for run in runs])
    coldest, warmest = np.fmin.reduce(seen), np.fmax.reduce(seen)  # NaN where none was measured
    return np.asarray(warmest - coldest >= WARMED)


def _shape(state: State, runs: Sequence[Run], progress: Progress) -> State:
    """The state with the shape of friction found.

    Where a joint sticks at a reversal, friction that fades at next to no speed explains most of the
    residuals. No later round would leave such a shape, so reversals are weighted separately from
    the first round on.
    """
    for k in range(SHAPING):
        progress("shape of friction", 0.5 * k / SHAPING)
        state = _step(_with_noise(state, runs, plain=True), runs, DAMPING if k else 1.0)
        state = _align(state, runs)
    return state


def _with_noise(state: State, runs: Sequence[Run], plain: bool = False) -> State:
    """The same point with the noise of its residuals, by sampling rate; `plain`: white, Gaussian.

    Near reversals it is scaled separately.
    """
    noises = _of_each(_rates(runs), lambda k: _noise(state, _of_rate(state, runs, k), plain))
    return replace(state, noises=noises)


def _of_each(rates: Sequence[int], of: Callable[[int], V]) -> tuple[V, ...]:
    """What belongs to each run by its rate, worked out once for each rate."""
    each = [of(rate) for rate in range(max(rates) + 1)]
    return tuple(each[rate] for rate in rates)


def _of_rate(state: State, runs: Sequence[Run], rate: int) -> list[Laden]:
    """The runs with one of the rates."""
    pairs = zip(state.loaded(runs), _rates(runs), strict=True)
    return [one for one, its in pairs if its == rate]


def _rates(runs: Sequence[Run]) -> list[int]:
    """Index of each run's sampling rate, 0 the fastest.

    The correlation of noise between rows depends on their distance in time: one noise for two rates
    would make the rows of one log count too much.
    """
    steps = np.array([median_step(run.motion.t) for run in runs])
    order = np.argsort(steps)
    slower = steps[order][1:] > ALIKE * steps[order][:-1]
    rates = np.zeros(len(runs), dtype=int)
    rates[order[1:]] = np.cumsum(slower)
    return rates.tolist()


def _noise(state: State, loaded: Sequence[Laden], plain: bool = False, apart: bool = True) -> Noise:
    """Noise of the point's residuals in runs of one rate; `apart`: near reversals separately."""
    left = _joint_by_joint(residuals(run.point, run.motion, run.band) for run in loaded)
    step = float(np.mean([median_step(run.motion.t) * run.band.every for run in loaded]))
    usual, near = typical_noise(state.point.arm, step), _turnings(loaded) if apart else None
    if plain:
        return white_noise(left, step, usual, near)
    return fit_noise(left, step, usual, _absorbed(state, loaded), near)


def _turnings(loaded: Sequence[Laden]) -> list[list[Mask]]:
    """Which rows of the residuals are near a reversal."""
    return _joint_by_joint(turnings(run.point, run.motion, run.band) for run in loaded)


def _absorbed(state: State, loaded: Sequence[Laden]) -> list[list[Array]] | None:
    """Noise absorbed by the last step's fit, as periodograms; None: no covariance yet."""
    if state.cov is None:
        return None
    belief, joints = Gaussian(state.z, state.cov), range(state.point.arm.joints)

    def of_run(run: Laden) -> list[list[Array]]:
        places = [(j, run.payload) for j in joints]
        roots = coefficient_roots(state.unknowns, places, run.point, belief)
        return absorbed_periodograms(run.point, run.motion, roots, run.band)

    return _joint_by_joint(map(of_run, loaded))


def _joint_by_joint(runs: Iterable[list[list[V]]]) -> list[list[V]]:
    """Stretches of all runs, joined by joint."""
    return [list(chain.from_iterable(of)) for of in zip(*runs, strict=True)]


def _blocks(state: State, runs: Sequence[Run]) -> list[Compressed]:
    return [
        block
        for run, noise in zip(state.loaded(runs), state.noises, strict=True)
        for block in compress(run.point, run.motion, noise, run.payload, run.band)
    ]


def _step(state: State, runs: Sequence[Run], damping: float) -> State:
    problem = build_problem(state.unknowns, _blocks(state, runs), state.point)
    return replace(state, z=state.z + damping * (solve(problem, state.z) - state.z))


def _sure_step(state: State, runs: Sequence[Run]) -> State:
    """An undamped step, with its covariance."""
    belief = _belief(state, _blocks(state, runs))
    return replace(state, z=belief.mean, cov=belief.cov)


def _belief(state: State, blocks: list[Compressed]) -> Gaussian:
    """The posterior of z, from these data and the prior."""
    problem = build_problem(state.unknowns, blocks, state.point)
    return posterior(problem, solve(problem, state.z))


def _align(state: State, runs: Sequence[Run]) -> State:
    """The state with `friction_time` at the minimum of a parabola through three misfits.

    Friction switches sign within a sample, so that finite differences are needed. It is not one of
    the scores z: residuals at reversals are so large that they would also determine `time_offset`,
    which the other rows should.
    """
    misfits = [
        _misfit(replace(state, friction_time=state.friction_time + h), runs)
        for h in (-PROBE, 0.0, PROBE)
    ]
    curvature = misfits[0] - 2.0 * misfits[1] + misfits[2]
    slope = misfits[2] - misfits[0]
    step = -0.5 * slope / curvature if curvature > 0.0 else -np.sign(slope)
    found = state.friction_time + PROBE * float(np.clip(step, -1.0, 1.0))
    return replace(state, friction_time=float(np.clip(found, -MAX_LEAD, MAX_LEAD)))


def _misfit(state: State, runs: Sequence[Run]) -> float:
    """Squared residuals of all joints, each in units of its noise."""
    total = 0.0
    for run, noise in zip(state.loaded(runs), state.noises, strict=True):
        for joint, stretches in enumerate(residuals(run.point, run.motion, run.band)):
            total += sum(float(r @ r) for r in stretches) / noise.sd[joint] ** 2
    return total


def _select(state: State, runs: Sequence[Run]) -> State:
    """The state with only those terms that predict held-out current, and the offset held.

    Rows near reversals do not count: a term must not explain mispredicted friction there.
    """
    never = np.full(state.point.arm.joints, np.inf)
    told = replace(state, noises=tuple(replace(noise, turning=never) for noise in state.noises))
    cuts = [[replace(run, motion=part) for part in folds(run.motion, FOLDS)] for run in runs]
    data = [_blocks(told, fold) for fold in zip(*cuts, strict=True)]
    terms = select_terms(state.unknowns, data, state.point, state.z)
    unknowns = replace(state.unknowns, terms=terms)
    return replace(state, unknowns=unknowns, z=unknowns.score(state.point, state.payloads))


def _settle(state: State, runs: Sequence[Run]) -> State:
    """The state with a new level of friction for joints whose fading term was dropped.

    What that term explained would otherwise pass for coloured noise, which would hide it.
    """
    unknowns = state.unknowns
    lost = {j for j, terms in enumerate(unknowns.terms) if "stribeck" not in terms}
    first = unknowns.prior.link_mean.size
    moved = [first + k for k, (_, joint) in enumerate(unknowns.drive) if joint in lost]
    z = state.z.copy()
    z[moved] = _step(_with_noise(state, runs, plain=True), runs, 1.0).z[moved]
    return replace(state, z=z)


def _finish(state: State, runs: Sequence[Run]) -> Fit:
    blocks, unknowns = _blocks(state, runs), state.unknowns
    belief = _belief(state, blocks)
    last = replace(state, z=belief.mean, cov=belief.cov, bands=(EVERYTHING,) * len(runs))
    parameters, jacobian = physical(unknowns, belief.mean)
    prior, prior_jacobian = physical(unknowns, np.zeros_like(belief.mean))
    rank, columns = data_rank(blocks, last.point.arm.joints)
    return Fit(
        dynamics=last.point,
        payloads=last.payloads,
        parameters=parameters,
        sd=np.sqrt(np.einsum("ij,jk,ik->i", jacobian, belief.cov, jacobian)),
        prior=prior.values,
        prior_sd=np.linalg.norm(prior_jacobian, axis=1),
        names=unknowns.names,
        belief=Gaussian(
            unknowns.mean + unknowns.sd * belief.mean,
            unknowns.sd[:, None] * belief.cov * unknowns.sd,
        ),
        terms=unknowns.terms,
        noise=_noise(last, _of_rate(last, runs, 0), apart=False),
        sources=tuple(run.motion.source for run in runs),
        n_samples=sum(len(run.motion) for run in runs),
        rank=rank,
        n_parameters=columns,
    )
