"""Lines of a diagnostics table that somebody has acknowledged: told, and no longer warned of."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from urdyn.io.status import Level, Status

WARNED = (Level.WARN, Level.ERROR)
NUMBERS = re.compile(r",|\b\d")  # from here on a message changes with every sample


@dataclass(frozen=True)
class Seen:
    """A line as it was when somebody acknowledged it."""

    level: Level
    matters: frozenset[str]


def seen(statuses: Sequence[Status], names: Iterable[str]) -> dict[str, Seen]:
    """The current warnings of the statuses with these names, "" for all, by name."""
    asked, matters = set(names), _matters(statuses)
    return {
        s.name: Seen(s.level, matters[s.name])
        for s in statuses
        if s.level in WARNED and not asked.isdisjoint(("", s.name))
    }


def acknowledged(statuses: Sequence[Status], known: Mapping[str, Seen]) -> tuple[Status, ...]:
    """The statuses; what was acknowledged is shown, but no longer warned of.

    This ends when it gets worse, or something else is the matter too. The last line is the arm's,
    and names a warning that is left.
    """
    matters = _matters(statuses)

    def quiet(s: Status) -> bool:
        then = known.get(s.name)
        return then is not None and s.level <= then.level and matters[s.name] <= then.matters

    *parts, arm = [s.seen() if s.level in WARNED and quiet(s) else s for s in statuses]
    loud = [f"{s.name}: {s.message}" for s in parts if s.level == arm.level in WARNED]
    if loud and arm.message not in loud:  # what it names was acknowledged
        arm = replace(arm, message=loud[0])
    return (*parts, arm)


def forgetting(known: Mapping[str, Seen], statuses: Sequence[Status]) -> dict[str, Seen]:
    """What was acknowledged, without what is gone by now: it is warned of anew if it returns."""
    gone = [s.name for s in statuses if s.level == Level.OK and ("gone", "true") in s.values]
    of_these = tuple(f"{name}: " for name in gone)  # among the arm's
    return {
        name: replace(
            then, matters=frozenset(m for m in then.matters if not m.startswith(of_these))
        )
        for name, then in known.items()
        if name not in gone
    }


def _matters(statuses: Sequence[Status]) -> dict[str, frozenset[str]]:
    """What is the matter, by the statuses' names; the last one, the arm's, has that of all."""
    *parts, arm = [(s.name, _own(s)) for s in statuses]
    all_of = {f"{name}: {matter}" for name, matters in parts for matter in matters}
    return {**dict(parts), arm[0]: arm[1] | all_of}


def _own(status: Status) -> frozenset[str]:
    """Findings by their names, and what the message says before its numbers."""
    if status.level not in WARNED:
        return frozenset()
    found = (value.replace("_", " ") for key, value in status.values if key in ("id", "kind"))
    return frozenset((*found, NUMBERS.split(status.message)[0].strip()))
