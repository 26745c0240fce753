"""Faults of every kind on a virtual arm: how verbs make them and show what was reported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from urdyn.progress import Progress

if TYPE_CHECKING:
    from urdyn.bench.diagnosis_trials import Sets, Trial
    from urdyn.report.bench.confusion import Kinds


def broken(
    robot: str, seed: int, runs: int, noise: str, sets: Sets, progress: Progress
) -> list[Trial]:
    """A virtual arm that was commissioned, and broken `runs` times by each set of kinds."""
    from threadpoolctl import threadpool_limits

    from urdyn.bench.diagnosis_trials import commissioned, trials
    from urdyn.bench.truth import SENSORS
    from urdyn.model.arm import load_arm

    sensors = SENSORS[noise](load_arm(robot))
    done: list[Trial] = []
    if not runs:
        return done
    progress("commissioning", 0.0)
    with threadpool_limits(1):
        dynamics, fit = commissioned(robot, seed, sensors)
        for trial in trials(dynamics, fit, sensors, runs, seed, sets):
            done.append(trial)
            progress("breaking the arm", len(done) / (runs * len(sets)))
    return done


def kinds_table(kinds: Kinds) -> Table:
    """Which kinds were reported as which; columns are numbered, so that all have room."""
    title = "what was told of a virtual arm's faults, by the number of its kind"
    table = Table("truth", title=title, box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for name in kinds.told:
        known = name in kinds.truth[:-1]
        head = str(kinds.truth.index(name) + 1) if known else name
        table.add_column(head, justify="right", min_width=2, no_wrap=known)
    for i, (name, row) in enumerate(zip(kinds.truth, kinds.counts, strict=True), 1):
        number = f"{i} " if i < len(kinds.truth) else "  "
        words = number + name.replace("_", " ")
        table.add_row(words, *(str(n) if n else "" for n in row))
    table.columns[0].no_wrap = True
    return table


def as_counts(kinds: Kinds) -> dict[str, Any]:
    """The same for JSON."""
    return {
        "truth": list(kinds.truth),
        "told": list(kinds.told),
        "counts": kinds.counts.tolist(),
    }


def summed(done: list[Trial], kinds: Kinds) -> str:
    """The results, in a line."""
    named = f"kind and joint right in {kinds.right} of {kinds.findings} findings"
    return f"{named}; {_missed(done)}; {_timed(done)}"


def _timed(done: list[Trial]) -> str:
    timed = [held for t in done for held in t.timed]
    if not timed:
        return "no onset to compare"
    return f"{sum(timed)} of {len(timed)} onsets are within their 90 % intervals"


def _missed(done: list[Trial]) -> str:
    faults = sum(len(t.truth) for t in done)
    found = sum(len(t.found) for t in done)
    healthy = [t for t in done if not t.truth]
    cried = sum(bool(t.told) for t in healthy)
    hidden = sum(len(set(t.hidden) - set(t.found)) for t in done)
    unseen = f" ({hidden} of the others do not show in their motion)" if hidden else ""
    return f"{found} of {faults} faults found{unseen}; {cried} of {len(healthy)} healthy runs alarm"
