"""The controller's payload setting, hold by hold: a program may be wrong at every piece.

A hold lasts while the setting stays and no other load is found. It counts once, as what was carried
was known best, if that was more than the tool, or the setting was off. A right setting is off in
CHANCE of n holds at most; so it is called wrong where k of them, with

    sum_{i >= k} (n over i) CHANCE^i (1 - CHANCE)^(n - i) < RARE

were off to the same side. Of three or four, three are enough.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import exp, lgamma, log, log1p
from typing import Any

import numpy as np

from urdyn.types import Array, freeze

# [s] of a hold's motion before it is compared: programs set a payload up to a second late, and
# another load is found some tenths of a second after the arm sets off.
SETTLED = 2.0
# [sd] wider than the reported 90 % interval, which would call 1 of 10 looks wrong all day.
SURE = 3.0
LEAST = 0.1  # [kg] that matters to a controller
CHANCE = 0.05  # [-] of being off by more than SURE: errors of a few seconds have heavy tails
RARE = 1e-3  # [-]
SIDES = ("too_little", "too_much")


def tolerance(sd: float) -> float:
    """Largest accepted error of a setting against a mass known to this sd, both in kg."""
    return max(SURE * sd, LEAST)


@dataclass(frozen=True)
class Hold:
    """The hold that lasts, and what is carried in it as it was known best."""

    lasted: float = 0.0  # [s] of motion
    mass: float = 0.0  # [kg] carried
    sd: float = np.inf  # [kg] of that

    def seen(self, mass: float, sd: float) -> Hold:
        """The hold after another look at what is carried."""
        if self.lasted < SETTLED or not sd < self.sd:
            return self
        return Hold(self.lasted, mass, sd)


@dataclass(frozen=True, eq=False)
class Holds:
    """What was seen of a setting in all holds."""

    judged: int = 0
    # By side, how many were off, and the sums of what was set and carried in these [kg]
    off: Array = field(default_factory=lambda: np.zeros((len(SIDES), 3)))

    def __post_init__(self) -> None:
        freeze(self, "off")

    def after(self, hold: Hold, setting: float, tool: float) -> Holds:
        """With one more hold of this setting, by an arm with this tool, both in kg."""
        most = tolerance(hold.sd)
        too_little, wrong = hold.mass > setting, abs(hold.mass - setting) > most
        if not (wrong or hold.mass - tool > most):
            return self
        off = np.array(self.off)
        off[0 if too_little else 1] += np.array([1.0, setting, hold.mass]) * wrong
        return replace(self, judged=self.judged + 1, off=off)

    def plain(self, whole: bool) -> dict[str, Any]:
        """In plain numbers: masses are means, `sure` whether chance is ruled out.

        Args:
            whole: what is carried includes the tool; else no setting is known to be too much.
        """
        rows = zip(SIDES, self.off if whole else self.off * [[1.0], [0.0]], strict=True)
        return {"judged": self.judged} | {name: self._side(row) for name, row in rows}

    def _side(self, row: Array) -> dict[str, Any]:
        count = int(row[0])
        told = {"holds": count, "set_kg": None, "carried_kg": None, "sure": False}
        if not count:
            return told
        setting, carried = (row[1:] / count).tolist()
        sure = by_chance(count, self.judged) < RARE
        return told | {"set_kg": setting, "carried_kg": carried, "sure": sure}


def by_chance(k: int, n: int) -> float:
    """Probability that a right setting is off in k or more of n holds."""
    # SciPy has it, but nothing else of SciPy is needed while tracking: 26 MB.
    ways = lgamma(n + 1)
    return sum(
        exp(ways - lgamma(i + 1) - lgamma(n - i + 1) + i * log(CHANCE) + (n - i) * log1p(-CHANCE))
        for i in range(k, n + 1)
    )
