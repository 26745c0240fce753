"""Many robots side by side: each one's history and diagnosis, most urgent first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import UrdynError
from urdyn.io.plain import plain
from urdyn.io.run_folder import MISSES, RANKS, REPORT, Entry, gravity, quiet, urgency
from urdyn.io.spans import Clock, clock
from urdyn.report.findings import Arm, read_findings
from urdyn.report.findings import told as as_told
from urdyn.report.traces import downsample
from urdyn.report.track.change import LEVELS, Change, Levels, compare_track
from urdyn.report.track.history import History, Series, find_history

SHOWN = ("friction", "health")  # of every joint
UNDRAWN = ("viscous", "zero")  # watched besides
# Most urgent first.
STATES = (
    "service_now", "critical", "doubted", "service_later", "warning", "found", "acknowledged",
    "changed", "surprised", "unjudged", "undiagnosed", "steady",
)  # fmt: skip
POINTS = 160  # of a word-sized line


@dataclass(frozen=True)
class Robot:
    """The content of one track folder."""

    name: str
    folder: Path
    joints: tuple[str, ...]  # base first
    start: float  # [s] first stamp
    span: float  # [s] of history: from its first row to its last
    surprise: float  # [-] squared innovation per current, 1 expected; NaN: none was compared
    source: str  # that was tracked; "" where not known yet
    finished: bool
    findings: tuple[Entry, ...] | None  # None: not diagnosed
    arm: Arm | None  # the probability that it lasts, if its diagnosis gives that
    due: str  # "now" or "later", when its diagnosis recommends a service; "" where it does not
    doubt: str  # a reason to doubt all that its diagnosis found; "": none
    judged: bool  # something was compared, and enough for a diagnosis if there is one
    written: float  # [s] since 1970, when something last was
    age: float  # [s] since then
    stale: bool
    series: Mapping[str, tuple[Series, ...]]  # of SHOWN, thinned: a fleet's days fill a memory
    changes: Mapping[str, tuple[Change, ...]]  # now beside commissioned
    unshown: tuple[Change, ...]  # damping and zeros that changed beyond the level of a warning

    @property
    def clock(self) -> Clock:
        """The unit of its time."""
        return clock(self.span)

    @property
    def moved(self) -> list[Change]:
        """What changed, largest change first; changes that no line shows come last."""
        told = [c for changes in self.changes.values() for c in changes if c.changed]
        return [*sorted(told, key=lambda c: -abs(c.z)), *self.unshown]

    @property
    def health(self) -> float:
        """Health of the joint that has lost most, as a share of what it was."""
        return min(c.now / c.then for c in self.changes["health"])

    @property
    def state(self) -> str:
        """One of STATES: where all that was found is gone, as if nothing had been."""
        if self.findings and not all(f["gone"] for f in self.findings):
            return _state(self.findings, self.due, bool(self.doubt))
        if self.moved:
            return "changed"
        if not self.judged:
            return "unjudged"
        if self.surprise > MISSES:
            return "surprised"
        return "undiagnosed" if self.findings is None else "steady"

    @property
    def urgency(self) -> tuple[float, ...]:
        """The more urgent, the greater: state, findings, health lost, change, surprise."""
        found = max(map(urgency, self.findings or ()), default=(0.0, -np.inf, 0.0))
        most = abs(self.moved[0].z) if self.moved else 0.0
        state = -float(STATES.index(self.state))
        return state, *found, -self.health, most, float(np.nan_to_num(self.surprise))

    @property
    def page(self) -> Path | None:
        """Its report."""
        path = self.folder / REPORT
        return path if path.is_file() else None


@dataclass(frozen=True)
class Unread:
    """One track folder that cannot be read, and why."""

    name: str
    folder: Path
    reason: str


@dataclass(frozen=True)
class Fleet:
    """Robots, most urgent first, and the folders that could not be read."""

    robots: tuple[Robot, ...]
    unread: tuple[Unread, ...]


def gather(folders: Sequence[Path], now: float, stale: float) -> Fleet:
    """Read track folders.

    Args:
        now: [s] since 1970.
        stale: [s] without news, after which a history is out of date.
    """
    read: list[Robot] = []
    unread: list[Unread] = []
    for folder, name in zip(folders, names(folders), strict=True):
        try:
            read.append(_robot(folder, name, now, stale))
        except UrdynError as error:
            unread.append(Unread(name, folder, str(error)))
    return Fleet(tuple(sorted(read, key=lambda r: r.urgency, reverse=True)), tuple(unread))


def names(folders: Sequence[Path]) -> list[str]:
    """As much of every folder's path as distinguishes it from the others."""
    paths = [folder.resolve() for folder in folders]
    most = max((len(path.parts) for path in paths), default=1)
    for depth in range(1, most + 1):
        told = ["/".join(path.parts[-depth:]) for path in paths]
        if len(set(told)) == len(set(paths)):
            return told
    return [str(path) for path in paths]


def _robot(folder: Path, name: str, now: float, stale: float) -> Robot:
    run = find_history(folder)
    age = max(0.0, now - run.written)
    told = read_findings(folder, run.joints)
    unjudged = told.unjudged if told else ()
    levels = told.levels if told else LEVELS
    pairs = {
        what: [_judged(run, joint, what, joint not in unjudged, levels) for joint in run.joints]
        for what in SHOWN
    }
    return Robot(
        name=name,
        folder=folder,
        joints=run.joints,
        start=run.start,
        span=float(run.t[-1]),
        surprise=run.surprise,
        source=run.source,
        finished=run.finished,
        findings=told.findings if told else None,
        arm=told.arm if told else None,
        due=told.due if told else "",
        doubt=told.doubt if told else "",
        judged=bool(np.isfinite(run.surprise)) and not set(run.joints) <= set(unjudged),
        written=run.written,
        age=age,
        stale=age > stale,
        series={what: tuple(series for series, _ in each) for what, each in pairs.items()},
        changes={what: tuple(change for _, change in each) for what, each in pairs.items()},
        unshown=tuple(c for s in _undrawn(run) if (c := compare_track(s, levels=levels)).matters),
    )


def _undrawn(run: History) -> Iterator[Series]:
    """Quantities of every joint that are watched but not drawn."""
    for joint in run.joints:
        for quantity in UNDRAWN:
            if run.holds(joint, quantity):
                yield run.series(joint, quantity)


def _state(findings: Sequence[Entry], due: str, doubted: bool) -> str:
    """State of a robot by the worst of its findings; its page's recommendation comes first.

    If that is to check its twin, or its stream, nothing is known of the arm.
    """
    known = all(map(quiet, findings))
    if doubted and not known:
        return "doubted"
    worst = max(findings, key=gravity)
    severity = str(worst["severity"]) if gravity(worst) > RANKS["notice"] else "found"
    if severity == "found" and known:
        severity = "acknowledged"
    return min(severity, f"service_{due}" if due else severity, key=STATES.index)


def _judged(
    run: History, joint: str, quantity: str, enough: bool, levels: Levels
) -> tuple[Series, Change]:
    """A quantity of a joint, thinned, and its change by all of the data."""
    whole = run.series(joint, quantity)
    at = np.union1d(downsample(whole.mean, POINTS), [0, len(whole.mean) - 1])
    thin = replace(whole, t=whole.t[at], mean=whole.mean[at], sd=whole.sd[at])
    return thin, compare_track(whole, enough, levels)


def told(fleet: Fleet) -> dict[str, Any]:
    """A fleet in plain numbers, as `urdyn fleet --json` prints it."""
    return {
        "robots": [_told(robot) for robot in fleet.robots],
        "unread": [{"folder": str(u.folder), "reason": u.reason} for u in fleet.unread],
    }


def _told(robot: Robot) -> dict[str, Any]:
    surprise = robot.surprise
    friction, health = robot.changes["friction"], robot.changes["health"]
    return {
        "name": robot.name,
        "folder": str(robot.folder),
        "report": str(robot.page) if robot.page else None,
        "source": robot.source or None,
        "state": robot.state,
        "finished": robot.finished,
        "stale": robot.stale,
        "age_s": robot.age,
        "history_s": robot.span,
        "surprise": plain(surprise),
        "health_index": robot.arm and robot.arm["health_index"],
        "horizon_h": robot.arm and robot.arm["horizon_h"],
        **({"doubt": robot.doubt} if robot.doubt else {}),
        "findings": None if robot.findings is None else [as_told(f) for f in robot.findings],
        "joints": [
            {
                "name": f.owner,
                "friction_change": f.now / f.then - 1.0 if f.then else None,
                "friction_state": f.word or "changed",
                "health": h.now / h.then if h.then else None,
                "health_state": h.word or "changed",
            }
            for f, h in zip(friction, health, strict=True)
        ],
    }
