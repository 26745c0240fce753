"""The prior: what arms of a type are like before this one was measured, and how widely they vary.

Link inertials scatter around the published ones in log-Cholesky coordinates, where mass, centre of
mass and spread of mass are separate coordinates and every value is a possible body. Drives scatter
around values measured on joints of that size; the rated torque gives a joint's size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.model.consistency import inertials, log_cholesky
from urdyn.model.drive import Drive
from urdyn.model.dynamics import Dynamics
from urdyn.model.ur_type import ur_type
from urdyn.types import Array, freeze, frozen

# Joint sizes by rated torque [N·m]. Gains and friction are those that controllers of a UR3e and a
# UR10e use themselves (target_current against target_moment), and the maker's joint test of a UR5e;
# rotor inertias were identified on a UR10e. Between and beyond these sizes a power law holds.
RATED_TORQUE = (10.0, 28.0, 54.0, 150.0, 330.0)
ANY_TORQUE = 54.0  # [N·m] where a description does not give it
TYPICAL = {
    "gain": (3.7, 7.5, 10.7, 10.0, 12.3),
    "rotor_inertia": (0.06, 0.20, 0.50, 2.0, 7.0),
    "coulomb": (0.75, 1.6, 3.1, 6.3, 17.0),
    "viscous": (0.55, 1.6, 3.3, 10.5, 21.0),
}
# Gains that were identified on an arm of this very type, base first [Petrone2025]_.
IDENTIFIED_GAIN = {"ur10": (13.5841, 14.2959, 11.3716, 11.2408, 11.7681, 11.7682)}
# Arms that have the table's joints. In the maker's test three of them differ by 1 %, and sources
# differ by 3 % on one size: both are within this spread, with room left for the gear.
MEASURED = frozenset({"ur3e", "ur5e", "ur7e", "ur10e", "ur12e", "ur16e"})
GAIN_SPREAD = 0.05  # relative sd of such a joint's gain
SIZE_SPREAD = 0.10  # of a joint known only by its size: older ones differ by 5 to 15 %
UNRATED_SPREAD = 0.30  # of any other
OPTIONAL = frozenset({"stribeck", "ripple_cos", "ripple_sin", "thermal"})  # terms of friction
STRUCTURAL = 0.06
PRESLIDING_DISTANCE = 2e-4  # [rad]
MAX_TAIL = 0.8  # [-] of presliding friction in the soft bristles
STRIBECK_VELOCITY = 0.3  # [rad/s]
TEMPERATURE = 35.0  # [°C] at which viscous friction is quoted
# By how much viscous friction falls, where no log shows it: UR arms lose 15 to 25 % of it over the
# 12 to 20 K of a warm-up.
KAPPA, KAPPA_SD = 0.014, 0.004  # [1/K]
MASS_SPREAD = 0.10  # relative sd of a link's mass around the published one
SHAPE_SPREAD = 0.15  # relative sd of a link's lengths of gyration
# The same of links that are published as round cylinders: the tensors that UR published later for
# twelve of them (UR3e, UR5e) differ by this much, rms, with upper arms and forearms half as long
# again.
ROUND_SPREAD = 0.4
CENTRE_FLOOR = 0.005  # [m] sd of a centre of mass, beside SHAPE_SPREAD of the link's length


@dataclass(frozen=True, eq=False)
class Spread:
    """Belief about one coefficient of every joint before any data."""

    mean: Array  # (J,) of the logarithm where positive, else of the value
    sd: Array  # (J,) likewise
    positive: bool  # the logarithm is Gaussian

    def __post_init__(self) -> None:
        freeze(self, "mean", "sd")

    @property
    def typical(self) -> Array:
        """Median, (J,)."""
        return np.exp(self.mean) if self.positive else self.mean

    def at(self, z: Array) -> Array:
        """Value at standard scores `z`, (J,)."""
        x = self.mean + self.sd * z
        return np.exp(x) if self.positive else x


@dataclass(frozen=True, eq=False)
class Population:
    """Arms of one type."""

    arm: Arm
    link_mean: Array  # (J, 10) log-Cholesky coordinates
    link_sd: Array  # (J, 10)
    drive: Mapping[str, Spread]  # by the names of Drive's fields

    def links(self, z: Array) -> Array:
        """Link inertials at standard scores `z`, (J, 10) -> (J, 10)."""
        return inertials(self.link_mean + self.link_sd * z)

    def typical(self) -> Dynamics:
        """The median arm: published masses, typical friction, no optional term."""
        return self._dynamics(np.zeros_like(self.link_mean), {})

    def draw(self, rng: np.random.Generator, terms: frozenset[str] = frozenset()) -> Dynamics:
        """One arm at random; optional terms that are not among `terms` are zero."""
        if wrong := sorted(set(terms) - OPTIONAL):
            raise InputError(f"terms: no {wrong[0]!r}; name some of {', '.join(sorted(OPTIONAL))}")
        z = rng.standard_normal(self.link_mean.shape)
        scores = {name: rng.standard_normal(len(z)) for name in self.drive}
        keep = {k: v for k, v in scores.items() if k not in OPTIONAL or k in terms}
        return self._dynamics(z, keep)

    def _dynamics(self, link_scores: Array, scores: Mapping[str, Array]) -> Dynamics:
        zero = np.zeros(len(link_scores))
        values = {
            name: zero
            if name in OPTIONAL and name not in scores
            else spread.at(scores.get(name, zero))
            for name, spread in self.drive.items()
        }
        # Friction at rest, f + g, is positive.
        values["stribeck"] = np.abs(values["coulomb"] + values["stribeck"]) - values["coulomb"]
        values["presliding_tail"] = np.clip(values["presliding_tail"], 0.0, MAX_TAIL)
        fixed = {"temperature": zero + TEMPERATURE, "health": zero + 1.0}
        drive = Drive(**(fixed | values), time_offset=0.0, friction_lead=0.0)
        return Dynamics(self.arm, self.links(link_scores), drive)


def population(arm: Arm) -> Population:
    """The belief about `arm` before any data."""
    log_torque = np.log(rated_torque(arm))
    typical = {name: _power_law(log_torque, values) for name, values in TYPICAL.items()}
    one = np.ones_like(log_torque)
    friction = np.exp(typical["coulomb"])
    drive = {
        "gain": _gain(arm, typical["gain"]),
        "rotor_inertia": Spread(typical["rotor_inertia"], 0.7 * one, True),
        "coulomb": Spread(typical["coulomb"], 0.5 * one, True),
        "viscous": Spread(typical["viscous"], 0.5 * one, True),
        "structural": Spread(np.log(STRUCTURAL) * one, 0.5 * one, True),
        "offset": Spread(0.0 * one, 0.1 * friction, False),
        "stribeck": Spread(0.0 * one, 0.5 * friction, False),
        "ripple_cos": Spread(0.0 * one, 0.03 * friction, False),
        "ripple_sin": Spread(0.0 * one, 0.03 * friction, False),
        "thermal": Spread(0.0 * one, 0.02 * np.exp(typical["viscous"]), False),
        "presliding_distance": Spread(np.log(PRESLIDING_DISTANCE) * one, 0.5 * one, True),
        "presliding_tail": Spread(0.2 * one, 0.15 * one, False),
        "stribeck_velocity": Spread(np.log(STRIBECK_VELOCITY) * one, 0.7 * one, True),
    }
    link_mean = log_cholesky(arm.inertials)
    return Population(arm, frozen(link_mean), frozen(_link_sd(link_mean)), drive)


def rated_torque(arm: Arm) -> Array:
    """Rated torque of each joint, (J,) [N·m]; ANY_TORQUE where the description does not give it."""
    told = arm.effort_limit < RATED_TORQUE[-1] * 10  # without one, exporters write huge numbers
    return np.where(told, arm.effort_limit, ANY_TORQUE)


def _power_law(log_torque: Array, values: tuple[float, ...]) -> Array:
    """Logarithm of a typical value by rated torque; straight lines in log-log, extended."""
    x, y = np.log(RATED_TORQUE), np.log(values)
    slope = np.polyfit(x, y, 1)[0]
    beyond = np.minimum(log_torque - x[0], 0.0) + np.maximum(log_torque - x[-1], 0.0)
    return np.asarray(np.interp(log_torque, x, y) + slope * beyond)


def _gain(arm: Arm, by_size: Array) -> Spread:
    """Logarithms of drive gains, (J,): of arms of this type, else of joints of this size."""
    kind = ur_type(arm)
    identified = IDENTIFIED_GAIN.get(kind, ())
    mean = np.log(identified) if len(identified) == len(by_size) else by_size
    sized = GAIN_SPREAD if kind in MEASURED else SIZE_SPREAD
    known = (arm.effort_limit > RATED_TORQUE[0] / 2) & (arm.effort_limit < RATED_TORQUE[-1] * 1.2)
    return Spread(mean, np.where(known, sized, UNRATED_SPREAD), True)


def _link_sd(mean: Array) -> Array:
    """Spread of log-Cholesky coordinates (alpha, d1..3, s12, s23, s13, t1..3), (J, 10)."""
    d, shear = mean[:, 1:4], mean[:, 4:7]
    length = np.exp(d).max(axis=1, keepdims=True)
    equal = np.isclose(d, np.roll(d, 1, axis=1), rtol=0.0, atol=1e-6).any(axis=1)
    round_ = equal & (np.abs(shear) < 1e-6 * length).all(axis=1)
    sd = np.empty_like(mean)
    sd[:, :1] = MASS_SPREAD / 2.0  # mass is exp(2 alpha)
    sd[:, 1:4] = np.where(round_, ROUND_SPREAD, SHAPE_SPREAD)[:, None]
    sd[:, 4:7] = SHAPE_SPREAD * length
    sd[:, 7:] = CENTRE_FLOOR + SHAPE_SPREAD * length
    return sd
