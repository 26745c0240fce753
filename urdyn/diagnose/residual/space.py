"""The space in which an arm strays and faults have directions: states around the commissioned arm.

k zeros [rad]; m inertials identifiable from motion, in standard scores; f, alpha, beta, rotor and z
logarithms; o torque offsets [N·m]; payload ten inertials; gain logarithms of the error of the
commissioned drive gains, which shows with an added load. All are zero on the first day.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn.stacking import stacked
from urdyn.identify.fit import Fit
from urdyn.identify.noise import Noise
from urdyn.identify.slow import MEMORY
from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.tracking.belief.commissioned import commissioned, gains_of, shown_links
from urdyn.types import Array, Index, Mask, freeze, frozen

GROUPS = ("k", "m", "payload", "f", "alpha", "beta", "z", "o", "rotor", "gain")


@dataclass(frozen=True, eq=False)
class Space:
    """States of a commissioned arm, and what its fit knows of them."""

    reference: Dynamics
    shown: Array  # (10 J, r) inertials per unit of m
    cov: Array  # (n, n) of the fit
    colour: Noise  # of the residual, from commissioning
    unlearnt: Mask  # (J,) joints of whose friction commissioning has told next to nothing

    def __post_init__(self) -> None:
        freeze(self, "shown", "cov")

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self.reference.arm.joints

    @property
    def size(self) -> int:
        """Number of states n."""
        return len(self.cov)

    @cached_property
    def places(self) -> dict[str, slice]:
        """Slice of each group."""
        return _places(self.joints, self.shown.shape[1])

    @cached_property
    def payload(self) -> Index:
        """Indices of the payload's states."""
        at = self.places["payload"]
        return np.arange(at.start, at.stop)

    @property
    def noise(self) -> Array:
        """sd of the residual, (J,) [A]."""
        return self.colour.sd

    @cached_property
    def slow(self) -> Array:
        """sd of white noise as loud as the residual at the lowest frequencies, (J,) [A]."""
        return frozen(np.maximum(np.sqrt(self.colour.gentle), self.noise))

    def covariance(self, rows: int, period: float) -> Array:
        """Autocovariance of the residual at lags of 0 .. `rows` rows, (rows + 1, J) [A²].

        Args:
            period: [s] between rows.
        """
        left = np.exp(-period / MEMORY * np.arange(rows + 1.0))
        return self.colour.autocovariance(rows, period) + np.outer(left, self.colour.slow**2)

    @cached_property
    def arm(self) -> Arm:
        """The arm with the links' commissioned inertials and payload."""
        return self.reference.rigid


def space(fit: Fit) -> Space:
    """The space of a fit; drive gains are as commissioned: health is relative to them."""
    scores, shown = shown_links(fit)
    return Space(fit.dynamics, shown, _cov(fit, scores), fit.noise, fit.unlearnt)


def _places(joints: int, r: int) -> dict[str, slice]:
    return stacked(dict.fromkeys(GROUPS, joints) | {"m": r, "payload": 10})


def _cov(fit: Fit, scores: Array) -> Array:
    """The fit's covariance of the states, given the drive gains; zero for those not in the fit.

    Args:
        scores: (10 J, r) of m per unit of the fit's coordinates of links.
    """
    at = _places(fit.dynamics.arm.joints, scores.shape[1])
    gains = gains_of(fit)
    whole = np.array(commissioned(fit, at["gain"].stop, at, scores, gains).cov)
    if gains:
        whole[at["gain"], at["gain"]] = fit.belief.cov[np.ix_(gains, gains)]
    return np.asarray(0.5 * (whole + whole.T))
