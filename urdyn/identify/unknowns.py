"""The unknowns: standard scores under the prior, in named coordinates.

Every unknown is z ~ N(0, 1). Its coordinate x = mean + sd z is log-Cholesky for a link or payload,
a logarithm for a positive quantity, and the quantity itself otherwise, so that the arm is
physically possible for any z.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from urdyn.given import given_number, positive
from urdyn.identify.fit import Fit
from urdyn.model.consistency import log_cholesky
from urdyn.model.drive import LINEAR, SHAPE
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import OPTIONAL, Population, population
from urdyn.types import Array

# [s] sd of a recorder's skew between streams, as between runs of a real arm. Joints of a slow run
# contradict each other by far more: a wider prior leaves the offset to the loudest of them.
TIME_OFFSET_SD = 2e-3
COORDINATES = ("alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")


@dataclass(frozen=True)
class PayloadPrior:
    """Prior of a payload: a compact body near the flange.

    Raises:
        InputError: the mass is not a number above 0.
    """

    mass: float | None = None  # [kg], above 0; None: unknown

    def __post_init__(self) -> None:
        if self.mass is not None:
            mass = given_number(self.mass, "mass", "a number of kilograms above 0", positive)
            object.__setattr__(self, "mass", mass)

    def mean(self) -> Array:
        """Log-Cholesky coordinates in the tool frame, (10,): 6 cm out, 5 cm of gyration."""
        mass = 2.0 if self.mass is None else self.mass
        return np.array([np.log(mass) / 2.0, *np.log([0.05] * 3), 0, 0, 0, 0, 0, 0.06])

    def sd(self) -> Array:
        """Spread of those coordinates, (10,); a given mass is taken as exact."""
        mass = 1.2 if self.mass is None else 1e-5
        return np.array([mass / 2.0, *[0.5] * 3, *[0.02] * 3, *[0.08] * 3])


@dataclass(frozen=True)
class Contradictable:
    """A group of scores on which data may contradict the prior."""

    scores: tuple[int, ...]
    below: bool = False  # only where they are below expectation


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Which quantities are sought, and in which order: links, drives, payloads."""

    prior: Population
    terms: tuple[frozenset[str], ...]  # optional terms of each joint's model
    gain: Array | None = None  # (J,) [N·m/A] where the drive gains are given
    payloads: tuple[PayloadPrior, ...] = ()
    # (10,) inertials of the known tool, carried throughout, in the last joint's frame.
    tool: Array = field(default_factory=lambda: np.zeros(10))

    @cached_property
    def drive(self) -> tuple[tuple[str, int], ...]:
        """(field, joint) of every drive unknown."""
        joints = range(self.prior.arm.joints)
        gain = () if self.gain is not None else ("gain",)
        fields = (*gain, *LINEAR, *SHAPE)
        return tuple((f, j) for f in fields for j in joints if self.has(f, j))

    @cached_property
    def contradictable(self) -> tuple[Contradictable, ...]:
        """Scores in which an arm may be quite unlike its type.

        Those of the last link, which contains what is mounted there, and of each joint's structural
        damping, where it is low.
        """
        first = self.prior.link_mean.size
        link = Contradictable(tuple(range(first - len(COORDINATES), first)))
        damping = (first + k for k, (name, _) in enumerate(self.drive) if name == "structural")
        return link, *(Contradictable((at,), below=True) for at in damping)

    def has(self, field: str, joint: int) -> bool:
        """Whether a joint's model has a term, or the term to which a shape belongs."""
        needs = "stribeck" if field == "stribeck_velocity" else field
        return needs not in OPTIONAL or needs in self.terms[joint]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """One name per unknown."""
        arm = self.prior.arm
        links = [f"{link}.{x}" for link in arm.link_names for x in COORDINATES]
        drive = [f"{arm.joint_names[j]}.{field}" for field, j in self.drive]
        payloads = [f"payload_{k}.{x}" for k in range(len(self.payloads)) for x in COORDINATES]
        return (*links, *drive, "time_offset", *payloads)

    @cached_property
    def mean(self) -> Array:
        """Prior mean of the coordinates, (P,)."""
        drive = [self.prior.drive[field].mean[j] for field, j in self.drive]
        payloads = [payload.mean() for payload in self.payloads]
        return np.concatenate([self.prior.link_mean.ravel(), drive, [0.0], *payloads])

    @cached_property
    def sd(self) -> Array:
        """Prior standard deviation of the coordinates, (P,)."""
        drive = [self.prior.drive[field].sd[j] for field, j in self.drive]
        payloads = [payload.sd() for payload in self.payloads]
        return np.concatenate([self.prior.link_sd.ravel(), drive, [TIME_OFFSET_SD], *payloads])

    def score(self, point: Dynamics, payloads: tuple[Array, ...]) -> Array:
        """Standard scores of an arm and of payload inertials (10,) each, (P,)."""
        drive = [self._coordinate(field, getattr(point.drive, field)[j]) for field, j in self.drive]
        bodies = [log_cholesky(payload) for payload in payloads]
        links = log_cholesky(point.inertials).ravel()
        x = np.concatenate([links, drive, [point.drive.time_offset], *bodies])
        return np.asarray((x - self.mean) / self.sd)

    def _coordinate(self, field: str, value: float) -> float:
        positive = self.prior.drive[field].positive
        return float(np.log(max(value, 1e-12))) if positive else float(value)


def unknowns_of(fit: Fit, payloads: tuple[PayloadPrior, ...] = ()) -> Unknowns:
    """The unknowns of a fit's arm and tool, with these payloads instead of those of its logs."""
    sought = any(name.endswith(".gain") for name in fit.names)
    gain, own = None if sought else fit.dynamics.drive.gain, population(fit.dynamics.arm)
    return Unknowns(own, fit.terms, gain, payloads, fit.dynamics.payload)
