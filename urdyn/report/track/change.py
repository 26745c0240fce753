"""Whether a quantity is still what it was when the arm was commissioned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.io.spans import Clock
from urdyn.report.digits import difference, number
from urdyn.report.names import spoken
from urdyn.report.track.history import History, Series
from urdyn.types import Mask

SDS = 2.0  # combined standard deviations below which nothing is taken to have changed
SHARE = 0.03  # [-] of the commissioned value, likewise
WATCHED = {
    "coulomb": "Coulomb friction",
    "viscous": "viscous damping",
    "health": "health",
    "zero": "zero",
}
TOLD = 3  # changes that a headline has room for
UNSURE = "unsure"  # of a change that is large enough to matter, and may be chance
CHANGED = "Changed: "  # a verdict begins with, where something did


@dataclass(frozen=True)
class Change:
    """A quantity at commissioning and now."""

    owner: str
    quantity: str
    unit: str
    then: float
    then_sd: float
    now: float
    now_sd: float
    since: float  # [s] into the run, from when it stayed changed; NaN where steady
    seen: bool = True  # enough currents of the joint were compared to learn anything of it

    @property
    def steady(self) -> bool:
        """Too small to be told from nothing, or to matter."""
        return not np.isfinite(self.since)

    @property
    def word(self) -> str:
        """What it comes to; "" where it surely changed."""
        if not self.seen:
            return "not judged"
        if not self.steady:
            return ""
        small = not self.then or abs(self.now / self.then - 1.0) < SHARE
        return "steady" if small else UNSURE

    @property
    def z(self) -> float:
        """Change in combined standard deviations."""
        sd = float(np.hypot(self.then_sd, self.now_sd))
        return (self.now - self.then) / sd if sd else 0.0

    @property
    def amount(self) -> str:
        """How much, signed: in per cent, but a joint's zero has no size to compare with."""
        if self.quantity == "zero":
            return f"{signed(1e3 * (self.now - self.then))} mrad"
        if not self.then:
            return "–"
        return difference(self.now / self.then - 1.0)


def compare_track(series: Series, seen: bool = True) -> Change:
    """The last belief beside the first."""
    moved = _moved(series)
    after = np.flatnonzero(~moved)[-1] + 1  # the first row never differs from itself
    return Change(
        series.owner,
        series.quantity,
        series.unit,
        float(series.mean[0]),
        float(series.sd[0]),
        float(series.mean[-1]),
        float(series.sd[-1]),
        float(series.t[after]) if moved[-1] else np.nan,
        seen,
    )


def _moved(series: Series) -> Mask:
    """Rows that differ from the first as the last one does, by more than chance and by enough."""
    change = (series.mean - series.mean[0]) * np.sign(series.mean[-1] - series.mean[0])
    chance = SDS * np.hypot(series.sd, series.sd[0])
    return np.asarray((change > 0.0) & (change >= chance) & (change >= SHARE * abs(series.mean[0])))


def changes(history: History, unjudged: Sequence[str] = ()) -> list[Change]:
    """All that is watched, joint by joint.

    Args:
        unjudged: joints that a diagnosis has seen too little of.
    """
    seen = {joint: joint not in unjudged and history.seen(joint) for joint in history.joints}
    return [
        compare_track(history.series(joint, quantity), seen[joint])
        for joint in history.joints
        for quantity in WATCHED
        if history.holds(joint, quantity)
    ]


def verdict(found: Sequence[Change], clock: Clock) -> str:
    """What changed most and since when, in one sentence."""
    moved = sorted((c for c in found if not c.steady), key=lambda c: -abs(c.z))
    if not moved:
        return _unmoved(found)
    told = "; ".join(
        f"{spoken(c.owner)} {WATCHED[c.quantity]} {c.amount} since {clock(c.since)}"
        for c in moved[:TOLD]
    )
    rest = len(moved) - TOLD
    return f"{CHANGED}{told}{f'; and {rest} more' if rest > 0 else ''}."


def _unmoved(found: Sequence[Change]) -> str:
    """That nothing surely changed of what was looked at."""
    unseen = dict.fromkeys(spoken(c.owner) for c in found if not c.seen)
    but = f" but {', '.join(unseen)}, of which too little was seen," if unseen else ""
    of = f"friction, damping, health and zero of every joint{but}"
    if any(c.word == UNSURE for c in found):
        return f"No change is sure: {of} may be as commissioned."
    return f"Steady: {of} are as commissioned."


def signed(value: float) -> str:
    """A number that shows its sign."""
    return ("+" if value > 0.0 else "") + number(value)
