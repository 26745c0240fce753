"""The result of an identification: the arm, its uncertainty and its provenance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from urdyn.given import given_a
from urdyn.identify.noise import Noise
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import fading
from urdyn.model.population import population
from urdyn.types import Array, Gaussian, Mask, Parameters, Source, freeze, index_of

TINY = 1e-9  # [kg]


class Fitted(Protocol):
    """Anything with a fit: a twin."""

    @property
    def fit(self) -> Fit:
        """What is known of the arm."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A model with honest intervals."""

    dynamics: Dynamics  # the arm at the posterior's maximum, with its tool if known
    payloads: tuple[Array, ...]  # inertials (10,) of each loaded log's payload, tool frame
    parameters: Parameters  # physical: "forearm_link.mass", "elbow_joint.coulomb", ...
    sd: Array  # (Q,) posterior standard deviations
    prior: Array  # (Q,) prior medians
    prior_sd: Array  # (Q,)
    names: tuple[str, ...]  # names of the unconstrained coordinates
    belief: Gaussian  # over those coordinates: log-Cholesky, logarithms, plain values
    terms: tuple[frozenset[str], ...]  # optional terms of each joint's model
    noise: Noise  # for rows spaced as in the fastest log
    sources: tuple[Source, ...]
    n_samples: int
    rank: int  # of the data's linear problem
    n_parameters: int  # its columns
    tool_known: bool = False  # else the last link is taken to contain it

    def __post_init__(self) -> None:
        freeze(self, "sd", "prior", "prior_sd")

    def __repr__(self) -> str:
        logs = ", ".join(source.path for source in self.sources if source.path) or "nameless logs"
        arm = self.dynamics.arm
        return f"Fit of {arm.name}, {arm.joints} joints, from {self.n_samples} samples of {logs}"

    def value(self, name: str) -> float:
        """A physical parameter's estimate."""
        return self.parameters[name]

    def spread(self, name: str) -> float:
        """Its posterior standard deviation."""
        return float(self.sd[index_of(name, self.parameters.names, "parameter")])

    def friction(self, speed: float) -> Gaussian:
        """Friction of every joint that slides without a load, (J,) [N·m].

            F(v) = f + g exp(-|v| / v_s) + alpha |v|,    F(0): friction at rest

        Better known than its terms, which trade off: f and g most of all. Where F(0) is held at
        0, only the upper half of its interval means anything.

        Args:
            speed: of every joint [rad/s].
        """
        drive, slopes = self.dynamics.drive, self.of_friction(speed)
        left = fading(np.full(len(slopes), speed), drive)
        mean = drive.coulomb + drive.stribeck * left + drive.viscous * abs(speed)
        return Gaussian(mean, slopes @ self.belief.cov @ slopes.T)

    def of_friction(self, speed: float) -> Array:
        """Derivative of `friction` in the unconstrained coordinates, (J, P)."""
        drive, joints, v = self.dynamics.drive, self.dynamics.arm.joint_names, abs(speed)
        left = fading(np.full(len(joints), v), drive)
        by_field = {
            "coulomb": drive.coulomb,
            "viscous": drive.viscous * v,
            "stribeck": left,
            "stribeck_velocity": drive.stribeck * left * v / drive.stribeck_velocity,
        }
        slopes = np.zeros((len(joints), len(self.names)))
        for field, slope in by_field.items():
            for j, joint in enumerate(joints):
                if (name := f"{joint}.{field}") in self.names:
                    slopes[j, self.names.index(name)] = slope[j]
        return slopes

    @cached_property
    def unlearnt(self) -> Mask:
        """Joints whose friction the prior tells rather than data, (J,): most hardly moved."""
        at = [self.names.index(f"{joint}.coulomb") for joint in self.dynamics.arm.joint_names]
        prior = population(self.dynamics.arm).drive["coulomb"].sd
        return np.asarray(self.belief.cov.diagonal()[at] > 0.5 * prior**2)

    def informed(self, name: str) -> float:
        """How much of the prior's variance the data removed: 0 nothing, 1 all.

        For a mass, relative variances count, since its prior sd grows with the mass.
        """
        at = index_of(name, self.parameters.names, "parameter")
        if not self.prior_sd[at]:
            return 0.0
        left = self.sd[at] / self.prior_sd[at]
        if name.endswith(".mass"):
            left *= self.prior[at] / max(self.parameters.values[at], TINY)
        return float(np.clip(1.0 - left**2, 0.0, 1.0))


def fit_in(of: Fit | Fitted) -> Fit:
    """A fit, or that of a twin; InputError where it is neither."""
    return given_a(
        getattr(of, "fit", of), Fit, "twin", "or the Twin that urdyn.Twin.load(path) gives"
    )
