"""A motor that crosses its gear's backlash.

Where the load reverses at t0 the motor leaves one flank and needs

    T = sqrt(4 b I_r / f)

to cross the whole gap 2 b under the friction it no longer overcomes; meanwhile the current lacks
the load's share. Each gap is weighed by that template, together with a level and a slope.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import Polynomial
from scipy.special import logsumexp

from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.space import Space
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Array, Mask

GAPS = np.array([5e-5, 1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3])  # [rad] half gaps tested for
BEFORE, LONGEST = 0.04, 0.06  # [s] before and after a reversal, or longer in this proportion
WIDER = 1.5  # [-] times a gap's crossing time, after which the missing current must be back
FEWEST = 8  # rows about a reversal: a level and a slope take two of them
WILD = 4.0  # [sd] most that one row counts
CLEAR = 4.0  # [sd] of a load about its line, which its change must exceed
BENT, SPAN = 2.0, 0.02  # [-] times its usual curvature over this [s], beyond which a load jumps
SHARES = (1.0, 0.5)  # [-] of the template: the load does not vanish wholly, or is not all known


@dataclass(frozen=True, eq=False)
class Crossing:
    """Likelihood of each gap, if the motor crosses it at a reversal."""

    space: Space
    period: float  # [s] between rows

    @cached_property
    def lasting(self) -> Array:
        """Time to cross each gap, (gaps, J) [s]."""
        drive = self.space.reference.drive
        return np.sqrt(4.0 * GAPS[:, None] * drive.rotor_inertia / drive.coulomb)

    @cached_property
    def longest(self) -> Array:
        """Time after a reversal in which each gap is crossed, with a margin, (gaps, J) [s]."""
        return np.asarray(np.maximum(LONGEST, WIDER * self.lasting))

    def weigh(
        self, rows: Rows, after: Array, load: Array, left: Array, j: int
    ) -> tuple[Array, Array]:
        """Log likelihood ratios of the gaps, and their expected values, (gaps,) [nats].

        Args:
            after: time since the reversal, (N,) [s].
            load: of joint j, (N,) [N·m].
            left: residual of its current, (N,) [A].
        """
        llr, shown = np.zeros((2, len(GAPS)))
        for longest in np.unique(self.longest[:, j]):  # the shortest first
            of = self.longest[:, j] == longest
            told = self._weigh(
                rows, after, load=load, left=left, j=j, longest=float(longest), gaps=of
            )
            if told is None:
                break
            llr[of], shown[of] = told
        return llr, shown

    def _weigh(
        self, rows: Rows, after: Array, load: Array, left: Array, j: int, longest: float, gaps: Mask
    ) -> tuple[Array, Array] | None:
        """The same of gaps that take as long [nats]."""
        at = (after > -longest * BEFORE / LONGEST) & (after < longest)
        if at.sum() < FEWEST or not np.isfinite(left[at]).all():
            return None
        if np.abs(rows.v[at, j]).min() < STANDING:  # a joint that stands is held by friction
            return None
        line = Polynomial.fit(after[at], load[at], 1)(after[at])
        if not _whole(load[at], after[at], line) or self._jumps(load, at):
            return None
        K = self.space.reference.drive.gain[j]
        x = -(line / K) * ((after[at] > 0.0) & (after[at] < self.lasting[gaps, j, None]))
        columns = np.column_stack([np.ones(at.sum()), after[at], left[at], x.T])
        noise = correlated(self._alike[:, j], len(columns)) + np.diag(rows.doubt[at, j] ** 2)
        seen = white(columns, noise)
        q, told = np.linalg.qr(seen[:, :2])[0], seen[:, 2:]
        beside = (told - q @ (q.T @ told)).T
        r, x = np.clip(beside[0], -WILD, WILD), beside[1:]
        louder = max(1.0, float(r @ r) / (len(r) - 2.0))  # the model's residual just here
        power = np.sum(x**2, axis=1)
        of_each = [(c * (x @ r) - 0.5 * c**2 * power) / louder for c in SHARES]
        return logsumexp(of_each, axis=0) - np.log(len(SHARES)), 0.5 * power / louder

    @cached_property
    def _alike(self) -> Array:
        """Covariance of the noise of rows that are 0 .. n apart, (n + 1, J) [A²]."""
        rows = int(self.longest.max() * (1.0 + BEFORE / LONGEST) / self.period) + 1
        return self.space.covariance(rows, self.period)

    def _jumps(self, load: Array, at: Mask) -> bool:
        """Whether a load reverses more sharply than accelerations resolve.

        They are averages over some hundredths of a second. Where the true one jumps, the load
        computed from them does so too early, and then too late: like a gap.
        """
        lag = max(1, round(SPAN / self.period))
        bend = np.abs(load[2 * lag :] - 2.0 * load[lag:-lag] + load[: -2 * lag])
        return bool(bend[at[lag:-lag]].mean() > BENT * np.median(bend))


def correlated(alike: Array, rows: int) -> Array:
    """Covariance (n, n) of noise by its autocovariance `alike`, (m,); constant beyond the last."""
    row = np.arange(rows)
    return np.asarray(alike[np.minimum(np.abs(np.subtract.outer(row, row)), len(alike) - 1)])


def white(columns: Array, cov: Array) -> Array:
    """Rows (n, k), of which each column's noise has the covariance `cov`, (n, n), whitened."""
    return np.asarray(np.linalg.solve(np.linalg.cholesky(cov), columns))


def _whole(load: Array, after: Array, line: Array) -> bool:
    """Whether the load reverses once, and for good: noise about zero is no reversal.

    Errors of accelerations are in the load, and with opposite sign in the residual: a load that
    reverses by these alone would look like a gap.
    """
    if np.ptp(line) < CLEAR * np.std(load - line):
        return False
    side, before = np.sign(load), after < 0.0
    turns = (side[before] == side[0]).all() and (side[~before] == -side[0]).all()
    return bool(before.any() and turns)
