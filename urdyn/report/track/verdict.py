"""What changed since the arm was commissioned, or that nothing did, in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from urdyn.io.spans import Clock
from urdyn.report.names import spoken
from urdyn.report.track.change import UNSURE, WATCHED, Change

TOLD = 3  # changes that a headline has room for
CHANGED = "Changed: "  # start of a verdict, where something did


def verdict(found: Sequence[Change], clock: Clock) -> str:
    """What changed most and since when, in one sentence."""
    moved = _most_first(c for c in found if c.changed)
    if not moved:
        return _unmoved(found)
    told = "; ".join(f"{_named(c)} {c.amount} since {clock(c.since)}" for c in moved[:TOLD])
    return f"{CHANGED}{told}{_rest(moved)}."


def concern(found: Sequence[Change]) -> str:
    """What to look at though no fault was found; "" where nothing is."""
    moved = _most_first(c for c in found if c.matters)
    named = ", ".join(map(_named, moved[:TOLD]))
    how = "changed by more than a warning takes, and no finding says why"
    return f"check {named}{_rest(moved)}: {how}" if moved else ""


def _most_first(moved: Iterable[Change]) -> list[Change]:
    return sorted(moved, key=lambda c: -abs(c.z))


def _named(c: Change) -> str:
    return f"{spoken(c.owner)} {WATCHED[c.quantity]}"


def _rest(moved: Sequence[Change]) -> str:
    """That there is more than a headline has room for."""
    rest = len(moved) - TOLD
    return f"; and {rest} more" if rest > 0 else ""


def _unmoved(found: Sequence[Change]) -> str:
    """That nothing that was examined surely changed."""
    told = as_commissioned(found, "friction, damping, health and zero")
    return f"Steady: {told}" if sure(found) else f"No change is sure: {told}"


def as_commissioned(found: Sequence[Change], what: str) -> str:
    """That all is, or may be, as commissioned; and the joints for which this is unknown."""
    unseen = ", ".join(_unseen(found))
    but = f" but {unseen}, of which too little was seen," if unseen else ""
    return f"{what} of every joint{but} {'are' if sure(found) else 'may be'} as commissioned."


def sure(found: Sequence[Change]) -> bool:
    """Nothing that was seen well enough to judge seems to have changed."""
    return all(c.word != UNSURE or not c.shows for c in found)


def _unseen(found: Sequence[Change]) -> Iterator[str]:
    """Joints whose changes would not show; if only in some quantities, which."""
    for owner in dict.fromkeys(c.owner for c in found):
        own = [c for c in found if c.owner == owner]
        hidden = [WATCHED[c.quantity] for c in own if not c.shows]
        if len(hidden) == len(own):
            yield spoken(owner)
        elif hidden:
            yield f"{spoken(owner)} ({', '.join(hidden)})"
