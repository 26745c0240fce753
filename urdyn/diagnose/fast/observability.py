"""The least gap that a motion could show, joint by joint, and what would show it.

While gravity keeps a gear on one flank no gap can be seen, however wide: this is reported, with the
probe in which the load reverses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import logsumexp

from urdyn.diagnose.fast.backlash import HALF, Reversals
from urdyn.diagnose.fast.crossing import GAPS
from urdyn.diagnose.fast.flight import FLIGHTS
from urdyn.diagnose.kinds.fast_rules import BacklashRule
from urdyn.diagnose.residual.space import Space
from urdyn.simulate.limits import ACCELERATION

WAYS = (np.arange(len(GAPS)), len(GAPS) + np.arange(len(FLIGHTS)))  # of crossing: motor's, link's
POSES = 181  # among which the heaviest load is sought
COMMISSION = "commission anew, with {} moving: no gap is looked for in joints not learnt there"
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
            how = {} if seen else {"why": self._why(state, j), "probe": self._probe(j)}
            if self.space.unlearnt[j]:
                how = {"why": "not learnt at commissioning", "probe": COMMISSION.format(name)}
            told.append(row | how)
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

    def _probe(self, j: int) -> str:
        """What shows a gap in this joint's gear."""
        joint = self.space.reference.arm.joint_names[j].removesuffix("_joint")
        probe = f"urdyn excite --kind probe --joint {joint}"
        if self._heaviest(j) < self.space.reference.drive.coulomb[j]:
            none = f"{joint} bears less than its friction: no motion shows a gap without a load"
            return f"{none} to turn; with one, {probe} --payload-mass KG --payload-com X,Y,Z"
        return f"{probe}; where that was the motion, with a higher --acceleration, or a load"

    def _heaviest(self, j: int) -> float:
        """The largest load that this joint bears in any pose, accelerated as hard as allowed."""
        arm, rng = self.space.arm, np.random.default_rng(0)
        q = np.clip(rng.uniform(-np.pi, np.pi, (POSES, arm.joints)), arm.lower, arm.upper)
        a = np.broadcast_to(ACCELERATION * np.eye(arm.joints)[j], q.shape)
        return float(np.abs(arm.torque(q, np.zeros_like(q), a)[:, j]).max())

    def _why(self, state: Reversals, j: int) -> str:
        """Why no gap could be seen."""
        why = "not observable in this motion"
        if state.count[j] >= self.rule.enough:
            return why + ": the load turns over too slowly"
        if state.slid[j] > MOVED:
            return why + ": the load keeps the gear on one flank"
        return why
