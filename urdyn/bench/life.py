"""How a true arm strays while it works: by the twin's own process, since only then should a 90 %
interval cover the truth nine times in ten.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.dbn.joined import Joined
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.identify.fit import Fit
from urdyn.model.dynamics import Dynamics
from urdyn.model.moments import generic_moments
from urdyn.signal import Instant
from urdyn.simulate.schedule import Course
from urdyn.tracking.belief.model import DAY
from urdyn.types import Array

STEP = 0.5  # [s] between drawn states, with linear interpolation
MOVED = ("k", "z", "kappa", "lubricant")  # groups that are off their mean when the log begins
HELD = ("beta", "o")  # groups that a course cannot change: constant over the log


@dataclass(frozen=True, eq=False)
class Life:
    """An event: every state's deviation from the commissioned arm."""

    begin: float  # [s]
    t: Array  # (M,) [s] since
    x: Array  # (M, n) f, alpha, beta, o and rotors relative to the commissioned; others absolute
    currents: RobotCurrents

    @property
    def onset(self) -> float:
        """Time before which nothing strays [s]."""
        return self.begin

    def at(self, t: Array | float) -> Array:
        """All states at times [s] since it began, (..., n)."""
        rows = [np.interp(t, self.t, column) for column in self.x.T]
        return np.stack(rows, axis=-1)

    def on_the_day(self, dynamics: Dynamics) -> Dynamics:
        """The commissioned arm, with HELD groups as they are when this life begins."""
        drive, at, x = dynamics.drive, self.currents.places, self.x[0]
        structural = drive.structural * np.exp(x[at["beta"]])
        return replace(
            dynamics, drive=replace(drive, structural=structural, offset=drive.offset + x[at["o"]])
        )

    def befall(self, course: Course) -> Course:
        """Change friction, damping, health and zeros; the lubricant's own warmth lowers damping."""
        at, x = self.currents.places, self.at(course.t - self.begin)
        x = np.where((course.t >= self.begin)[:, None], x, 0.0)
        softer = x[:, at["kappa"]] * x[:, at["lubricant"]]
        return replace(
            course,
            coulomb=course.coulomb * np.exp(x[:, at["f"]]),
            viscous=course.viscous * np.exp(x[:, at["alpha"]] - softer),
            health=course.health * np.exp(x[:, at["z"]]),
            encoder_offset=course.encoder_offset - x[:, at["k"]],
        )


def drawn(
    model: Joined[RobotSlice], begin: float, duration: float, rng: np.random.Generator
) -> Life:
    """One life of the model's process from `begin` [s] on, its first state drawn from the prior.

    Except for what the fit estimates, as the arm itself is that draw, and for the payload, of which
    there is none.
    """
    currents = model.observation
    assert isinstance(currents, RobotCurrents)
    u, at, sd = _passing(currents), currents.places, model.prior.sd
    x = np.zeros(len(model.names))
    for group in MOVED:
        x[at[group]] = model.prior.mean[at[group]] + sd[at[group]] * rng.standard_normal(
            at[group].stop - at[group].start
        )
    for group, spread in DAY.items():
        one = currents.reference.drive.coulomb if group == "o" else 1.0
        x[at[group]] = one * spread * rng.standard_normal(at[group].stop - at[group].start)
    rates = slice(len(currents.names), None)
    x[rates] = rng.multivariate_normal(0.0 * x[rates], model.prior.cov[rates, rates])
    # An exact square root, since Q is singular: some states never move.
    variance, ways = np.linalg.eigh(model.transition_cov(u))
    root = ways * np.sqrt(np.maximum(variance, 0.0))
    t = np.arange(0.0, duration + 2.0 * STEP, STEP)
    path = [x]
    for _ in t[1:]:
        path.append(model.transition(path[-1], u) + root @ rng.standard_normal(len(x)))
        for group in HELD:
            path[-1][at[group]] = x[at[group]]
    return Life(begin, t, np.array(path), currents)


def commissioned_states(dynamics: Dynamics, fit: Fit, currents: RobotCurrents) -> Array:
    """States and rates of the commissioned arm, (n,), relative to the fit."""
    drive, at = dynamics.drive, currents.places
    x = np.zeros(len(currents.names) + 2 * dynamics.arm.joints)
    for group, value in (
        ("f", drive.coulomb),
        ("alpha", drive.viscous),
        ("beta", drive.structural),
        ("rotor", drive.rotor_inertia),
    ):
        x[at[group]] = np.log(value)
    x[at["o"]] = drive.offset
    x[at["skew"]] = drive.time_offset - fit.dynamics.drive.time_offset
    # For bodies, only what shows in torque.
    arm = fit.dynamics.arm
    Y = arm.regressor(*generic_moments(arm)).reshape(-1, 10 * arm.joints)
    other = (dynamics.inertials - fit.dynamics.inertials).ravel()
    x[at["m"]] = np.linalg.lstsq(Y @ currents.shown, Y @ other, rcond=None)[0]
    return x


def _passing(currents: RobotCurrents) -> RobotSlice:
    """A slice of STEP at rest, with temperatures measured."""
    J = currents.reference.arm.joints
    nothing = np.zeros(J)
    unknown = np.full(J, np.nan)
    still = Instant(0.0, nothing, nothing, nothing, nothing, nothing, unknown, nothing)
    return replace(currents.inputs(still, nothing, STEP), blind=False)
