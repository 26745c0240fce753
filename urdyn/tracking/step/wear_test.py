"""A test for drives that wore more than a healthy arm's since an earlier belief.

A filter that always allowed for wear would learn little, so it assumes a healthy arm. Afterwards
two models of the measurements since N(x0, P0) are compared: the healthy one, which gave N(x, P),
and one whose drive may also have changed by N(0, W). With the measurements' information on the
drive, G, and the slope of their likelihood, u, both of which follow from the beliefs,

    log B = u' (W^-1 + G)^-1 u / 2 - log |I + W G| / 2,    u = P0^-1 (x - x0),
                                                           G = P0^-1 (P0 - P) P0^-1,

the ratio of the marginal likelihoods [Dickey1971]_, with all other states integrated out. The same
numbers give the second model's posterior: with U the drive's columns of P0^-1,

    x + P U (W^-1 + G)^-1 u    and    P + P U (W^-1 + G)^-1 U' P

are its mean and covariance. So a late detection loses nothing: what other states absorbed of the
wear is given back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from urdyn.dbn.wear import Wear
from urdyn.estimate.protocol import S
from urdyn.tracking.belief.model import JOLTS
from urdyn.types import Array, Gaussian, Index, Mask

ASKED = 30.0  # [s] of motion; drives are tested against beliefs both younger and older than this
YOUNG = 5.0  # [s] of motion: a younger belief is too much like the present one to test against
ASK = 1.0  # [s] between tests, which alternate between the two
# [-] log odds, against the older and the younger belief. Half as much friction again, or a fifth
# less health, put into a real UR10e's currents: 23 to 119 against the older. Healthy, in 30 pairs
# of its runs, end to end, for the worse: none against the older, and 22 against the younger.
SURE, SURER = 20.0, 25.0
# A drive that warms up, or bears more than is known, seems to improve: there odds reached 51.
WORSE = np.array([{"f": 1.0, "alpha": 1.0, "z": -1.0}[group] for group in JOLTS])


@dataclass(frozen=True, eq=False)
class WearReference(Generic[S]):
    """The belief at some moment."""

    belief: S
    passed: float = 0.0  # [s] of the run
    moved: float = 0.0  # [s] of its motion


@dataclass(frozen=True, eq=False)
class WearTest:
    """Compares two beliefs: did a drive wear in between?"""

    wear: Wear

    @cached_property
    def kept(self) -> Index:
        """States that change only as they stray, (s,)."""
        stays = np.ones(len(self.wear.names), dtype=bool)
        for at in (self.wear.payload, self.wear.slow, self.wear.beside):
            stays[at] = False
        return np.flatnonzero(stays)

    @cached_property
    def at(self) -> Index:
        """Indices of each drive's states among these, (J, g)."""
        states = [np.arange(jolt.at.start, jolt.at.stop) for jolt in self.wear.jolts]
        return np.searchsorted(self.kept, np.array(states).T)

    @cached_property
    def _theirs(self) -> Array:
        """Selects the drives' states, (s, J g)."""
        return np.eye(len(self.kept))[:, self.at.ravel()]

    @cached_property
    def sd(self) -> Array:
        """Square roots of W, (g,)."""
        return np.array([jolt.sd for jolt in self.wear.jolts])

    def compared(self, before: Gaussian, now: Gaussian, span: float, blind: bool) -> WearOdds:
        """Odds of wear between two beliefs that are `span` [s] apart.

        Args:
            blind: some joint's temperature is not measured.
        """
        before = self.wear.later(before, span, blind)
        kept, (J, g) = self.kept, self.at.shape
        rows = np.linalg.solve(before.cov[kept][:, kept], self._theirs).T  # U'
        seen = rows @ now.cov[kept]  # U' P
        u = (rows @ (now.mean - before.mean)[kept]).reshape(J, g) * self.sd
        gained = (rows[:, self.at.ravel()] - seen[:, kept] @ rows.T).reshape(J, g, J, g)
        own = gained[np.arange(J), :, np.arange(J)] * np.outer(self.sd, self.sd)
        value, vector = np.linalg.eigh(np.eye(g) + 0.5 * (own + own.swapaxes(1, 2)))
        along = (vector.swapaxes(1, 2) @ u[..., None])[..., 0]
        # Directions that are known less well than before, as they strayed, were not measured.
        along *= value > 1.0
        eigenvalues = np.maximum(value, 1.0)
        change = (vector @ (along / eigenvalues)[..., None])[..., 0]
        lever = self.sd[:, None] * seen.reshape(J, g, -1)
        return WearOdds(now, along, eigenvalues, vector, lever, change @ WORSE)


@dataclass(frozen=True, eq=False)
class WearOdds:
    """Log odds of wear of each drive, along the g eigenvectors of I + W G."""

    now: Gaussian
    along: Array  # (J, g) u
    eigenvalues: Array  # (J, g) of I + W G
    directions: Array  # (J, g, g) by column, in units of W's square roots
    lever: Array  # (J, g, n) U' P, likewise
    worse: Array  # (J,) [sd of W] more friction, less health

    @property
    def log_odds(self) -> Array:
        """Log odds of wear against none, by drive, (J,)."""
        along, value = self.along, self.eigenvalues
        return np.asarray(0.5 * (along**2 / value - np.log(value)).sum(axis=1))

    def wore(self, sure: float = SURE) -> Mask:
        """The drive with the highest log odds, if above `sure`, (J,); others may follow later."""
        odds = np.where(self.worse > 0.0, self.log_odds, -np.inf)
        return np.asarray((odds > sure) & (odds == odds.max()))

    def allowing(self, drives: Mask) -> Gaussian:
        """The belief that allows for the wear of one drive, given as a mask (J,)."""
        (j,) = np.flatnonzero(drives)
        lever = self.directions[j].T @ self.lever[j]
        moved = (self.along[j] / self.eigenvalues[j]) @ lever
        root = lever / np.sqrt(self.eigenvalues[j])[:, None]
        return Gaussian(self.now.mean + moved, self.now.cov + root.T @ root)
