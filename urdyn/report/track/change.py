"""Whether a quantity is still what it was when the arm was commissioned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.report.digits import difference, number
from urdyn.report.track.history import History, Series
from urdyn.types import Mask

SDS = 2.0  # combined standard deviations, below which nothing counts as changed
SHARE = 0.03  # [-] of the commissioned value, likewise
# Levels of a warning and of what is critical, as shares of the commissioned value; of a zero in
# [rad]. Those of the built-in rules, for runs whose diagnosis has none of its own.
Levels = Mapping[str, Mapping[str, float]]
LEVELS: Levels = {
    "friction": {"warning": 0.2, "critical": 0.5},
    "coulomb": {"warning": 0.2, "critical": 0.5},
    "viscous": {"warning": 0.2, "critical": 0.5},
    "health": {"warning": 0.1, "critical": 0.2},
    "zero": {"warning": 0.002, "critical": 0.01},
}
WATCHED = {
    "friction": "friction",  # of all terms that need no load
    "coulomb": "Coulomb friction",
    "viscous": "viscous damping",
    "health": "health",
    "zero": "zero",
}
UNSURE = "unsure"  # it may have changed: enough to count, or more than its interval can show


@dataclass(frozen=True)
class Change:
    """A quantity at commissioning and now."""

    owner: str
    quantity: str
    unit: str
    then: float
    then_sd: float  # of a healthy arm on another day, wider than the twin's own
    now: float
    now_sd: float
    since: float  # [s] into the run, from when it stayed changed; NaN where it is not
    levels: Mapping[str, float]  # of this quantity, one of LEVELS
    seen: bool = True  # enough currents of the joint were compared to learn anything of it

    @property
    def changed(self) -> bool:
        """Large enough to be significant, and to matter."""
        return bool(np.isfinite(self.since))

    @property
    def word(self) -> str:
        """The verdict; "" where it surely changed."""
        if not self.seen:
            return "not judged"
        if self.changed:
            return ""
        small = not self.then or abs(self.now / self.then - 1.0) < SHARE
        return "steady" if small and self.shows else UNSURE

    @property
    def shows(self) -> bool:
        """Enough is known for a change up to the critical level to be significant."""
        return self.seen and SDS * self.sd <= self._level("critical")

    @property
    def matters(self) -> bool:
        """It surely changed, beyond the level of a warning."""
        return self.changed and abs(self.now - self.then) > self._level("warning")

    @property
    def sd(self) -> float:
        """Standard deviation of the change."""
        return float(np.hypot(self.then_sd, self.now_sd))

    @property
    def z(self) -> float:
        """Change in combined standard deviations."""
        return (self.now - self.then) / self.sd if self.sd else 0.0

    @property
    def amount(self) -> str:
        """How much, signed: in per cent, except for a joint's zero, which has no scale."""
        if self.quantity == "zero":
            return f"{signed(1e3 * (self.now - self.then))} mrad"
        if not self.then:
            return "–"
        return difference(self.now / self.then - 1.0)

    def _level(self, name: str) -> float:
        """One of its levels, in the unit of the quantity; none as a share of nothing."""
        level = self.levels[name]
        return level if self.quantity == "zero" else level * abs(self.then) or np.inf


def compare_track(series: Series, seen: bool = True, levels: Levels = LEVELS) -> Change:
    """The last belief compared with the first."""
    moved = _moved(series)
    after = np.flatnonzero(~moved)[-1] + 1  # the first row never differs from itself
    return Change(
        owner=series.owner,
        quantity=series.quantity,
        unit=series.unit,
        then=float(series.mean[0]),
        then_sd=float(series.sd[0]),
        now=float(series.mean[-1]),
        now_sd=float(series.sd[-1]),
        since=float(series.t[after]) if moved[-1] else np.nan,
        levels=levels[series.quantity],
        seen=seen,
    )


def _moved(series: Series) -> Mask:
    """Rows that differ from the first as the last one does, by more than chance and by enough."""
    change = (series.mean - series.mean[0]) * np.sign(series.mean[-1] - series.mean[0])
    chance = SDS * np.hypot(series.sd, series.sd[0])
    return np.asarray((change > 0.0) & (change >= chance) & (change >= SHARE * abs(series.mean[0])))


def changes(
    history: History, unjudged: Sequence[str] = (), levels: Levels = LEVELS
) -> list[Change]:
    """Changes of all watched quantities, joint by joint.

    Args:
        unjudged: joints that a diagnosis has seen too little of.
        levels: of its rules.
    """
    seen = {joint: joint not in unjudged and history.seen(joint) for joint in history.joints}
    return [
        compare_track(history.series(joint, quantity), seen[joint], levels)
        for joint in history.joints
        for quantity in WATCHED
        if history.holds(joint, quantity)
    ]


def signed(value: float) -> str:
    """A number that shows its sign."""
    return ("+" if value > 0.0 else "") + number(value)
