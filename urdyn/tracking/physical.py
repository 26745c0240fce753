"""A belief in the filter's states, as quantities that people know."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn.robot import RobotCurrents
from urdyn.identify.fit import Fit
from urdyn.model.consistency import is_consistent
from urdyn.model.possible import possible_body
from urdyn.types import Array, Gaussian

JOINT = {
    "f": ("coulomb", "N·m"),
    "alpha": ("viscous", "N·m·s/rad"),
    "beta": ("structural", "-"),
    "z": ("health", "-"),
    "o": ("offset", "N·m"),
    "k": ("zero", "rad"),
}
LOGARITHMIC = ("f", "alpha", "beta", "z")
PAYLOAD = ("mass", "mx", "my", "mz")
PAYLOAD_REACH = 0.5  # [m] of the flange, within which what is carried is
LINK_REACH = 1.5  # [m] of its joint, within which a link is


@dataclass(frozen=True)
class Quantities:
    """How a filter's states become physical quantities, and their standard deviations."""

    currents: RobotCurrents
    link_mass: Array  # (J,) [kg] commissioned
    mass_shown: Array  # (J, r) [kg] per unit of m
    mass_hidden: Array  # (J,) [kg] sd that no motion removes

    @cached_property
    def names(self) -> tuple[str, ...]:
        """ "elbow_joint.coulomb", "forearm_link.mass", "payload.mass", ..."""
        arm = self.currents.reference.arm
        joints = [f"{j}.{name}" for name, _ in JOINT.values() for j in arm.joint_names]
        links = [f"{link}.mass" for link in arm.link_names]
        return (*joints, *links, *(f"payload.{name}" for name in PAYLOAD))

    @cached_property
    def units(self) -> tuple[str, ...]:
        """One unit a name."""
        J = self.currents.reference.arm.joints
        joints = [unit for _, unit in JOINT.values() for _ in range(J)]
        return (*joints, *["kg"] * J, "kg", *["kg·m"] * 3)

    def of(self, belief: Gaussian) -> tuple[Array, Array]:
        """Means, which are possible throughout, and standard deviations of all quantities."""
        at, x, sd = self.currents.places, belief.mean, belief.sd
        mean, spread = [], []
        for group in JOINT:
            value, error = x[at[group]], sd[at[group]]
            if group in LOGARITHMIC:
                value = np.exp(value)
                error = value * error
            mean.append(np.minimum(value, 1.0) if group == "z" else value)
            spread.append(error)
        m, M = at["m"], self.mass_shown
        told = np.einsum("jr,rs,js->j", M, belief.cov[m, m], M)
        few = slice(at["payload"].start, at["payload"].start + len(PAYLOAD))
        mean += [self.links(belief)[:, 0], self.payload(belief)[: len(PAYLOAD)]]
        spread += [np.sqrt(told + self.mass_hidden**2), sd[few]]
        return np.concatenate(mean), np.concatenate(spread)

    def payload(self, belief: Gaussian) -> Array:
        """Inertials (10,) of the likeliest body, or of nothing, that is carried."""
        at = self.currents.places["payload"]
        return possible_body(Gaussian(belief.mean[at], belief.cov[at, at]), PAYLOAD_REACH)

    def links(self, belief: Gaussian) -> Array:
        """Inertials (J, 10) of the likeliest bodies that the links can be."""
        at, S = self.currents.places["m"], self.currents.shown.reshape(len(self.link_mass), 10, -1)
        moved = self.currents.reference.inertials + S @ belief.mean[at]
        if is_consistent(moved).all():
            return moved
        # By all that arms of the type differ in: no motion shows all ten of a link.
        beliefs = (Gaussian(body, way @ way.T) for body, way in zip(moved, S, strict=True))
        return np.array([possible_body(link, LINK_REACH) for link in beliefs])


def quantities(fit: Fit, currents: RobotCurrents) -> Quantities:
    """The quantities of a commissioned arm; what no motion shows keeps its prior."""
    shown = currents.shown[::10]  # a link's mass is the first of its ten inertials
    names, links = fit.parameters.names, fit.dynamics.arm.link_names
    whole = np.array([fit.prior_sd[names.index(f"{link}.mass")] for link in links])
    hidden = np.sqrt(np.maximum(whole**2 - np.sum(shown**2, axis=1), 0.0))
    return Quantities(currents, fit.dynamics.inertials[:, 0], shown, hidden)
