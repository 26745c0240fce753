"""The least gap that a motion could show, joint by joint, and a motion that would show it.

While gravity keeps a gear on one flank no gap can be seen, however wide: this is reported, with a
motion in which the load reverses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import logsumexp

from urdyn.diagnose.backlash import HALF, Reversals
from urdyn.diagnose.crossing import GAPS
from urdyn.diagnose.fast_rules import BacklashRule
from urdyn.diagnose.flight import FLIGHTS
from urdyn.diagnose.space import Space

WAYS = (np.arange(len(GAPS)), len(GAPS) + np.arange(len(FLIGHTS)))  # of crossing: motor's, link's
POSES = 181  # among which a probe is sought
LIGHT = 0.05  # [-] of friction: a load that varies by less does not reverse
MOVED = 1.0  # [s] of motion, after which a load has kept its gear on one flank


@dataclass(frozen=True, eq=False)
class Observability:
    """Reports for each joint whether a gap could have been seen, and which motion shows it."""

    space: Space
    rule: BacklashRule

    def of(self, state: Reversals) -> list[dict[str, Any]]:
        """Joint by joint, the least gap that this motion could show, and which would show it."""
        arm, told = self.space.reference.arm, []
        for j, name in enumerate(arm.joint_names):
            count, gap = int(state.count[j]), self._least(state, j)
            seen = gap <= self.rule.critical
            row: dict[str, Any] = {"joint": j, "name": name, "reversals": count, "observable": seen}
            row |= {"half_gap_rad": gap if np.isfinite(gap) else None}
            told.append(row if seen else row | self._probe(state, j))
        return told

    def _least(self, state: Reversals, j: int) -> float:
        """The least half gap that this motion could show [rad]; infinite: none.

        Before there is a gap the way of crossing it is unknown: then the least for either way.
        """
        if state.count[j] < self.rule.enough:
            return np.inf
        needed = self.rule.needed + np.log(self.space.joints * len(HALF))
        plain = np.where(state.shown[j] >= needed, HALF, np.inf)
        least = [float(plain[way].min()) for way in WAYS]
        if state.told[j]:
            return least[int(np.argmax([logsumexp(state.R[j][way]) for way in WAYS]))]
        return max(least)

    def _probe(self, state: Reversals, j: int) -> dict[str, Any]:
        """A motion in which this joint's load reverses."""
        arm, J = self.space.reference.arm, self.space.joints
        met = np.isfinite(state.lo)
        middle = 0.5 * (np.where(met, state.lo, 0.0) + np.where(met, state.hi, 0.0))
        q = np.tile(middle, (POSES, 1))
        q[:, j] = np.linspace(max(arm.lower[j], -np.pi), min(arm.upper[j], np.pi), POSES)
        still = np.zeros((POSES, J))
        load = self.space.arm.torque(q, still, still)[:, j]
        turns = np.flatnonzero(load[1:] * load[:-1] < 0.0)
        why = self._why(state, j)
        if np.ptp(load) < LIGHT * self.space.reference.drive.coulomb[j] or not len(turns):
            how = f"turn {arm.joint_names[j]} back and forth by 0.3 rad, as fast as allowed"
            return {"why": why, "probe": how}
        best = turns[np.argmin(np.abs(q[turns, j] - middle[j]))]
        pose = float(q[best, j])
        how = f"turn {arm.joint_names[j]} to and fro by 0.2 rad about {pose:.2f} rad"
        return {"why": why, "probe": how + ", where gravity turns over, as fast as allowed"}

    def _why(self, state: Reversals, j: int) -> str:
        """Why no gap could be seen."""
        why = "not observable in this motion"
        if state.count[j] >= self.rule.enough:
            return why + ": the load turns over too slowly"
        if state.slid[j] > MOVED:
            return why + ": the load keeps the gear on one flank"
        return why
