"""Statistics of identification on virtual arms, against the least error that anyone can have.

The bound is the Bayesian Cramér-Rao bound [VanTrees2013]_ of one who is told the true motion and
the true noise: the prior's information and the data's, at the truth. What `identify` gets is noisy
angles, and it has to find noise, time offset and terms by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom, chi2, norm
from scipy.stats import f as fisher

from urdyn.identify import Fit, Noise, identify
from urdyn.identify.compress import compress
from urdyn.identify.expressions import physical
from urdyn.identify.map_estimate import build_problem, posterior
from urdyn.identify.unknowns import Unknowns
from urdyn.model.arm import Arm, load_arm, with_inertials
from urdyn.model.consistency import is_consistent
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import population
from urdyn.signal import condition
from urdyn.simulate import Sensors, Trajectory, fourier, observe, typical_sensors, virtual_arm
from urdyn.simulate.sensors import real_sensors
from urdyn.types import Array, Log

CHANCE = 0.01  # that a test fails although its claim holds
SLACK = 1.1  # above the bound: what angles with noise and an unknown offset may cost
FRICTION = ("coulomb", "viscous")
FEW, MANY = 1, 20
LONG = [pytest.mark.slow, pytest.mark.timeout(1200)]

CASES = [
    pytest.param("ur5e", True, FEW, id="a few ur5e"),
    pytest.param("ur5e", True, MANY, id="ur5e", marks=LONG),
    pytest.param("ur10e", False, MANY, id="ur10e, gain unknown", marks=LONG),
]
every_case = pytest.mark.parametrize(("robot", "gain_known", "seeds"), CASES)


@dataclass(frozen=True)
class Trial:
    """One virtual arm, identified."""

    fit: Fit
    truth: Array  # (Q,) of the fit's parameters
    bound: Array  # (Q,) least standard deviation

    def places(self, *fields: str) -> list[int]:
        """Where the parameters of these fields stand."""
        names = self.fit.parameters.names
        return [k for k, name in enumerate(names) if name.rpartition(".")[2] in fields]

    def error(self, *fields: str) -> Array:
        """Estimate less truth."""
        at = self.places(*fields)
        return self.fit.parameters.values[at] - self.truth[at]

    def excess(self, *fields: str) -> Array:
        """Errors over their bound, standard normal where the bound is reached."""
        return self.error(*fields) / self.bound[self.places(*fields)]

    def score(self, *fields: str) -> Array:
        """Errors over the standard deviation that the fit claims."""
        return self.error(*fields) / self.fit.sd[self.places(*fields)]


@pytest.mark.slow
def test_friction_that_turns_over_early_moves_no_gravity() -> None:
    """One time for both would lie between, and viscous friction pay for what gravity does then."""
    arm = virtual_arm(load_arm("ur5e"), 7)
    arm = replace(arm, drive=replace(arm.drive, friction_lead=0.01))
    rng = np.random.default_rng(7)
    log = observe(arm, fourier(arm.arm, 25.0, 100.0, rng), typical_sensors(arm.arm), rng)
    fit = identify(arm.arm, condition(log), gain=arm.drive.gain)
    found = fit.dynamics.drive  # to some of the ten milliseconds between rows
    assert abs(found.time_offset) < 1e-3 and abs(found.friction_lead - 0.01) < 3e-3
    sd = np.array([fit.spread(f"{joint}.viscous") for joint in arm.arm.joint_names])
    assert chi2.sf(np.sum(((found.viscous - arm.drive.viscous) / sd) ** 2), 6) > CHANCE


@cache
def trial(robot: str, gain_known: bool, seed: int) -> Trial:
    """Thirty seconds of excitation at 100 Hz."""
    dynamics, sensors, trajectory, log = recorded(robot, seed, 30.0)
    gain = dynamics.drive.gain if gain_known else None
    fit = identify(dynamics.arm, condition(log), gain=gain)
    unknowns = Unknowns(population(dynamics.arm), (frozenset(),) * 6, gain)
    truth, bound = bounded(unknowns, dynamics, sensors, trajectory, log)
    return Trial(fit, truth, bound)


def trials(robot: str, gain_known: bool, seeds: int) -> list[Trial]:
    return [trial(robot, gain_known, seed) for seed in range(seeds)]


def recorded(
    robot: str,
    seed: int,
    duration: float,
    period: float = 20.0,
    sensors_of: Callable[[Arm], Sensors] = typical_sensors,
) -> tuple[Dynamics, Sensors, Trajectory, Log]:
    """A virtual arm, how it is observed, what it does, and the log of that."""
    arm = load_arm(robot)
    dynamics, sensors = virtual_arm(arm, seed), sensors_of(arm)
    motion_rng, sensor_rng = np.random.default_rng(seed).spawn(2)
    bodies = with_inertials(arm, dynamics.loaded())
    trajectory = fourier(bodies, duration, 100.0, motion_rng, period=period)
    return dynamics, sensors, trajectory, observe(dynamics, trajectory, sensors, sensor_rng)


def bounded(
    unknowns: Unknowns, dynamics: Dynamics, sensors: Sensors, trajectory: Trajectory, log: Log
) -> tuple[Array, Array]:
    """True physical parameters and their least standard deviations, (Q,) each."""
    motion = replace(trajectory.at(log.t), current=log.joint("actual_current"))
    gaussian, white = np.full(6, 1e9), np.zeros((6, 0))
    noise = Noise(sensors.current_noise, sensors.current_noise, gaussian, white)
    z = unknowns.score(dynamics, ())
    belief = posterior(build_problem(unknowns, compress(dynamics, motion, noise), dynamics), z)
    truth, J = physical(unknowns, z)
    return truth.values, np.sqrt(np.einsum("ij,jk,ik->i", J, belief.cov, J))


@every_case
def test_friction_reaches_the_cramer_rao_bound(robot: str, gain_known: bool, seeds: int) -> None:
    excess = np.concatenate([t.excess(*FRICTION) for t in trials(robot, gain_known, seeds)])
    n = len(excess)
    assert np.sqrt(np.mean(excess**2)) <= SLACK * np.sqrt(chi2.ppf(1.0 - CHANCE, n) / n)


@every_case
@pytest.mark.parametrize("fields", [FRICTION, ("mass",)], ids=" and ".join)
def test_ninety_percent_intervals_hold_the_truth_nine_times_of_ten(
    fields: tuple[str, ...], robot: str, gain_known: bool, seeds: int
) -> None:
    scores = np.concatenate([t.score(*fields) for t in trials(robot, gain_known, seeds)])
    low, high = binom.interval(1.0 - CHANCE, len(scores), 0.9)
    assert low <= np.sum(np.abs(scores) < 1.645) <= high


@every_case
def test_nobody_claims_to_know_the_mass_of_the_first_link(
    robot: str, gain_known: bool, seeds: int
) -> None:
    for t in trials(robot, gain_known, seeds):
        assert t.fit.informed(f"{t.fit.dynamics.arm.link_names[0]}.mass") < 0.02


@every_case
def test_every_identified_link_is_a_solid_body(robot: str, gain_known: bool, seeds: int) -> None:
    for t in trials(robot, gain_known, seeds):
        assert is_consistent(t.fit.dynamics.inertials).all()


@every_case
def test_no_term_is_chosen_where_there_is_none(robot: str, gain_known: bool, seeds: int) -> None:
    chosen = sum(len(terms) > 0 for t in trials(robot, gain_known, seeds) for terms in t.fit.terms)
    assert chosen <= binom.ppf(1.0 - CHANCE, 6 * seeds, 0.01)  # eight nats: one joint of a hundred


@pytest.mark.slow
def test_noise_of_accelerations_is_not_taken_for_a_lack_of_inertia() -> None:
    """Coloured currents are whitened, and with them what angles and velocities are wrong by."""
    scores = []
    for seed in range(6):
        dynamics, _, _, log = recorded("ur5e", seed, 25.0, sensors_of=real_sensors)
        drive = dynamics.drive
        fit = identify(dynamics.arm, condition(log), gain=drive.gain)
        for joint, truth in zip(dynamics.arm.joint_names[:3], drive.rotor_inertia, strict=False):
            name = f"{joint}.rotor_inertia"
            scores.append((fit.value(name) - truth) / fit.spread(name))
    # Rotors were 5 to 10 % small, by 1.5 sd, where the regressor had the noise of what it met.
    assert abs(np.mean(scores)) < norm.isf(CHANCE / 2.0) / np.sqrt(len(scores)), scores


@pytest.mark.slow
def test_error_falls_as_the_root_of_the_samples() -> None:
    """The same ten seconds of motion once and four times: half the error."""
    once, often = zip(*(ten_and_forty_seconds(seed) for seed in range(8)), strict=True)
    ratio = np.sqrt(np.mean(np.square(once)) / np.mean(np.square(often)))
    # The ratio of two mean squares of n values each: Coulomb and viscous errors of a joint trade
    # off against one another, so the two count for one.
    n = np.size(once) // 2
    low, high = 2.0 * np.sqrt(fisher.ppf([CHANCE / 2.0, 1.0 - CHANCE / 2.0], n, n))
    assert low <= ratio <= high


def ten_and_forty_seconds(seed: int) -> tuple[Array, Array]:
    """Errors of friction from the first quarter of a log and from all of it, on one yardstick."""
    dynamics, _, _, log = recorded("ur5e", seed, 40.0, period=10.0)
    arm, gain = dynamics.arm, dynamics.drive.gain
    names = [f"{joint}.{field}" for field in FRICTION for joint in arm.joint_names]
    truth = np.concatenate([getattr(dynamics.drive, field) for field in FRICTION])
    fits = [
        identify(arm, condition(part), gain=gain) for part in (log.slice(0, len(log) // 4), log)
    ]
    yardstick = np.array([fits[0].spread(name) for name in names])
    once, often = (np.array([fit.value(name) for name in names]) - truth for fit in fits)
    return once / yardstick, often / yardstick
