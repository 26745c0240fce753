"""A belief in the filter's states, as physical quantities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_drive import POSITIVE
from urdyn.identify.fit import Fit
from urdyn.model.consistency import is_consistent
from urdyn.model.friction import WORKING_SPEED, fading
from urdyn.model.possible import possible_body, possible_load
from urdyn.tracking.belief.commissioned import TRACKED, given, scale_of, taken_for_known
from urdyn.tracking.belief.model import by_taken
from urdyn.tracking.belief.reading import NOTHING
from urdyn.types import Array, Gaussian

JOINT = {
    "f": (TRACKED["f"], "N·m"),
    "alpha": (TRACKED["alpha"], "N·m·s/rad"),
    "beta": (TRACKED["beta"], "-"),
    "z": ("health", "-"),
    "o": (TRACKED["o"], "N·m"),
    "k": ("zero", "rad"),
}
FRICTION = ("friction", "N·m")  # of all terms that need no load, at WORKING_SPEED
PAYLOAD = ("mass", "mx", "my", "mz")
KNOWN = 0.3  # [kg] sd of the payload below which it counts as known
PAYLOAD_REACH = 0.5  # [m] from the flange, within which a payload lies
LINK_REACH = 1.5  # [m] from its joint, within which a link lies


@dataclass(frozen=True, eq=False)
class Quantities:
    """How a filter's states become physical quantities, and their standard deviations."""

    currents: RobotCurrents
    mass_shown: Array  # (J, r) [kg] per unit of m
    mass_hidden: Array  # (J,) [kg] sd that no motion can reduce
    # sd of each group's coordinates, and of friction, due to what is assumed known
    taken: Mapping[str, Array]
    beside: tuple[tuple[str, str], ...] = ()  # names and units of other streams' quantities
    whole: bool = False  # the payload includes the tool, which is known

    @cached_property
    def names(self) -> tuple[str, ...]:
        """ "elbow_joint.coulomb", "forearm_link.mass", "payload.mass", ..."""
        return (*self.known, *(name for name, _ in self.beside))

    @cached_property
    def known(self) -> tuple[str, ...]:
        """Names of the quantities estimated from the currents' states."""
        arm = self.currents.reference.arm
        told = (*JOINT.values(), FRICTION)
        joints = [f"{j}.{name}" for name, _ in told for j in arm.joint_names]
        links = [f"{link}.mass" for link in arm.link_names]
        return (*joints, *links, *(f"payload.{name}" for name in PAYLOAD))

    @cached_property
    def units(self) -> tuple[str, ...]:
        """One unit per name."""
        J = self.currents.reference.arm.joints
        joints = [unit for _, unit in (*JOINT.values(), FRICTION) for _ in range(J)]
        carried = ["kg", *["kg·m"] * 3]
        return (*joints, *["kg"] * J, *carried, *(unit for _, unit in self.beside))

    def of(self, belief: Gaussian, beside: tuple[Array, Array] = NOTHING) -> tuple[Array, Array]:
        """Means, all physically possible, and standard deviations of all quantities.

        Args:
            beside: those of other streams' quantities.
        """
        bodies = self._friction(belief), self._masses(belief), self._carried(belief)
        means, sds = zip(*self._joints(belief), *bodies, beside, strict=True)
        return np.concatenate(means), np.concatenate(sds)

    def _joints(self, belief: Gaussian) -> Iterator[tuple[Array, Array]]:
        """Mean and sd of each quantity in JOINT, (J,) each."""
        x, sd = belief.mean, belief.sd
        for group in JOINT:
            at = self.currents.places[group]
            mean, spread = x[at], np.hypot(sd[at], self.taken.get(group, 0.0))
            if group in POSITIVE:
                mean = np.exp(mean)
                spread = mean * spread
            yield np.minimum(mean, 1.0) if group == "z" else mean, spread

    def _friction(self, belief: Gaussian) -> tuple[Array, Array]:
        """Mean and sd of f + g exp(-v / v_s) + alpha v at WORKING_SPEED v, (J,) each [N·m]."""
        f, alpha = (self.currents.places[group] for group in ("f", "alpha"))
        P = belief.cov
        a, b = np.exp(belief.mean[f]), WORKING_SPEED * np.exp(belief.mean[alpha])
        own = a**2 * P[f, f].diagonal() + b**2 * P[alpha, alpha].diagonal()
        variance = own + 2.0 * a * b * P[f, alpha].diagonal()
        return a + self._fading + b, np.sqrt(variance + self.taken["friction"] ** 2)

    def _masses(self, belief: Gaussian) -> tuple[Array, Array]:
        """Mean and sd of the links' masses, (J,) each [kg]."""
        m, M, masses = self.currents.places["m"], self.mass_shown, self.links(belief)[:, 0]
        shown = ((M @ belief.cov[m, m]) * M).sum(axis=1)
        hidden = self.mass_hidden**2 + (self.taken["m"] * masses) ** 2
        return masses, np.sqrt(shown + hidden)

    def _carried(self, belief: Gaussian) -> tuple[Array, Array]:
        """Mean and sd of the payload's mass [kg] and first moments [kg·m], (4,) each."""
        payload = self.payload(belief)
        by_gain = self.taken["payload"] * (payload - self._tool)
        return payload, np.hypot(belief.sd[self._load], by_gain)

    @cached_property
    def _fading(self) -> Array:
        """Stribeck friction at WORKING_SPEED, (J,) [N·m], which is as commissioned."""
        drive = self.currents.reference.drive
        return drive.stribeck * fading(np.full(len(drive.stribeck), WORKING_SPEED), drive)

    @cached_property
    def _load(self) -> slice:
        """States of the quantities in PAYLOAD."""
        first = self.currents.places["payload"].start
        return slice(first, first + len(PAYLOAD))

    def payload(self, belief: Gaussian) -> Array:
        """Mass and first moments (4,) of the likeliest possible payload, which may be none.

        They include the tool where that is known, and otherwise only what is carried besides.
        """
        at = self._load
        whole = Gaussian(self._tool + belief.mean[at], belief.cov[at, at])
        return possible_load(whole, PAYLOAD_REACH)

    @property
    def _tool(self) -> Array:
        """Mass and first moments of the tool, (4,); 0 where it was not named."""
        return self.currents.reference.payload[: len(PAYLOAD)]

    def links(self, belief: Gaussian) -> Array:
        """Inertials (J, 10) of the links' likeliest physically possible bodies."""
        at, commissioned = self.currents.places["m"], self.currents.reference.inertials
        S = self.currents.shown.reshape(len(commissioned), 10, -1)
        moved = commissioned + S @ belief.mean[at]
        for j in np.flatnonzero(~is_consistent(moved)):
            # Weighted by the spread among arms of the type: no motion shows all ten of a link.
            moved[j] = possible_body(Gaussian(moved[j], S[j] @ S[j].T), LINK_REACH)
        return moved


def weighed(belief: Gaussian, currents: RobotCurrents) -> bool:
    """Whether the currents tell the payload's mass, up to the scale of all weights."""
    return bool(belief.sd[currents.places["payload"]][0] < KNOWN)


def quantities(
    fit: Fit, currents: RobotCurrents, beside: tuple[tuple[str, str], ...] = ()
) -> Quantities:
    """The quantities of a commissioned arm; what no motion shows keeps its prior.

    Args:
        beside: names and units of other streams' quantities.
    """
    shown = currents.shown[::10]  # a link's mass is the first of its ten inertials
    names, links = fit.parameters.names, fit.dynamics.arm.link_names
    whole = np.array([fit.prior_sd[names.index(f"{link}.mass")] for link in links])
    hidden = np.sqrt(np.maximum(whole**2 - np.sum(shown**2, axis=1), 0.0))
    return Quantities(currents, shown, hidden, _taken(fit, currents), beside, fit.tool_known)


def _taken(fit: Fit, currents: RobotCurrents) -> dict[str, Array]:
    """The sd that what is assumed known adds to quantities, see `by_taken`.

    Relative, except for o and friction; for m, that of links' masses.
    """
    at, cov = currents.places, fit.belief.cov
    sd = np.sqrt(np.maximum(by_taken(fit, currents).diagonal(), 0.0))
    found = {group: sd[at[group]] for group in TRACKED}
    fixed = taken_for_known(fit)
    links = [fit.names.index(f"{link}.alpha") for link in fit.dynamics.arm.link_names]
    less = cov[links, links] - given(cov, links, fixed).diagonal()
    found["m"] = 2.0 * np.sqrt(np.maximum(less, 0.0))  # a mass is exp(2 alpha)
    free = [k for k in range(len(fit.names)) if k not in fixed]
    slopes = fit.of_friction(WORKING_SPEED)[:, free]
    less = fit.friction(WORKING_SPEED).cov - slopes @ given(cov, free, fixed) @ slopes.T
    found["friction"] = np.sqrt(np.maximum(less.diagonal(), 0.0))
    scale = scale_of(fit)
    weighed = cov[scale, scale] if scale else np.zeros(1)
    return found | {"payload": np.sqrt(weighed)}
