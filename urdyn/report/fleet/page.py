"""The self-contained page of many robots: which need attention, and which do not."""

from __future__ import annotations

import os
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from urllib.parse import quote

import numpy as np

from urdyn.report.digits import MISSING, counted, difference, number, percent
from urdyn.report.finding_words import lasting
from urdyn.report.finding_words import sentence as found
from urdyn.report.fleet.gather import SHOWN, Fleet, Robot, Unread
from urdyn.report.fleet.spark import Spark
from urdyn.report.markup import Html, document, paragraph, section, table, tag, text
from urdyn.report.names import capital, spoken
from urdyn.report.track.change import SDS, SHARE
from urdyn.report.track.headline import tied
from urdyn.report.track.history import Series
from urdyn.report.track.trace import UNSETTLED
from urdyn.report.track.verdict import as_commissioned, verdict
from urdyn.version import __version__

FLOOR = {"friction": (-0.1, 0.2), "health": (-0.1, 0.02)}  # [-] least range of a scale
CEILING = {"friction": (-0.6, 1.5), "health": (-0.6, 0.1)}  # [-] largest range
WORDS = {
    "service_now": "to be serviced now",
    "critical": "critical",
    "doubted": "whose twin or stream is to be seen to first",
    "service_later": "to be planned for",
    "warning": "with a warning",
    "found": "with findings that are notices, or over",
    "acknowledged": "with acknowledged findings only",
    "changed": "changed",
    "surprised": "not understood by their models",
    "unjudged": "not judged",
    "undiagnosed": "not diagnosed",
    "steady": "steady",
}
BADGE = {
    "service_now": "service now",
    "doubted": "doubtful",
    "service_later": "to be planned",
    "surprised": "not understood",
    "unjudged": "not judged",
    "undiagnosed": "not diagnosed",
    "found": "finding",
}
MOST = 2  # findings that a row has room for

Scale = tuple[float, float]


def fleet_page(fleet: Fleet, out: Path) -> str:
    """HTML of a fleet; `out` is where it will lie, since links to reports are relative to it."""
    scales = {what: _scale(fleet.robots, what) for what in SHOWN}
    return document(
        f"fleet of {len(fleet.robots)}",
        tag("h1", text(f"fleet · {counted(len(fleet.robots), 'robot')}")),
        paragraph(tied(headline(fleet)), "headline"),
        paragraph(tied(_lead(scales)), "lead"),
        *(_row(robot, scales, out) for robot in fleet.robots),
        *([_unread(fleet.unread)] if fleet.unread else []),
        paragraph(f"urdyn {__version__}", "note"),
    )


def headline(fleet: Fleet) -> str:
    """How many robots are in which state, the worst first."""
    parts = []
    for which, words in WORDS.items():
        names = [robot.name for robot in fleet.robots if robot.state == which]
        if names:
            told = f" ({', '.join(names[:3])}{', …' if len(names) > 3 else ''})"
            parts.append(f"{len(names)} {words}{'' if which == 'steady' else told}")
    stale = [robot.name for robot in fleet.robots if robot.stale]
    sentences = ["; ".join(parts)] if parts else []
    if stale:
        sentences.append(f"Nothing was heard lately of {', '.join(stale)}")
    if fleet.unread:
        sentences.append(f"{counted(len(fleet.unread), 'folder')} could not be read")
    return ". ".join(sentences) + "."


def _lead(scales: dict[str, Scale]) -> str:
    ends = ", ".join(
        f"{what} {difference(low)} to {difference(high)}" for what, (low, high) in scales.items()
    )
    return (
        "Most urgent first. Each line is a joint over its run, beside where it was when "
        f"commissioned (dashed), in its 90 % band; all robots share their scales: {ends}; "
        "what lies beyond runs along their edge. "
        "Times are counted from the first stamp of each run. "
        f"Orange is what changed by more than {SDS:.0f} standard deviations and {percent(SHARE)}."
    )


def _row(robot: Robot, scales: dict[str, Scale], out: Path) -> Html:
    head = tag("h2", _link(robot, out), *map(_badge, _states(robot)))
    joints = zip(robot.joints, *(robot.series[what] for what in SHOWN), strict=True)
    grid = tag(
        "div",
        *(
            tag("div", tag("b", text(spoken(joint))), *(_cell(robot, s, scales) for s in told))
            for joint, *told in joints
        ),
        kind="joints",
    )
    words = tag("div", head, paragraph(tied(sentence(robot)), "said"), _facts(robot), kind="who")
    return tag("section", words, grid, kind=f"robot {robot.state}")


def sentence(robot: Robot) -> str:
    """What is found on a robot, or that nothing is, or that it was not diagnosed."""
    told = _told(robot)
    return f"Not diagnosed. {told}" if robot.findings is None else told


def _told(robot: Robot) -> str:
    """The result of its diagnosis, or else of its history."""
    if robot.findings:
        told = [found(f, robot.start, robot.clock) for f in robot.findings[:MOST]]
        rest = len(robot.findings) - MOST
        more = f"; and {rest} more" if rest > 0 else ""
        said = ". ".join(map(capital, told))
        doubt = f"{capital(robot.doubt)}: " if robot.doubt else ""
        return f"{doubt}{said}{more}."
    if robot.moved:
        return verdict(robot.moved, robot.clock)
    if robot.state == "unjudged":
        return "Too little was compared with its model: nothing can be said of it."
    return as_commissioned([*chain(*robot.changes.values())], "Friction and health")


def _facts(robot: Robot) -> Html:
    surprise = number(robot.surprise) if np.isfinite(robot.surprise) else "not compared"
    facts = [
        f"{robot.clock(robot.span)} of history",
        f"surprise {surprise}",
        *([f"health index {lasting(robot.arm)}"] if robot.arm else []),
        f"written {_date(robot.written)}",
        *([] if robot.finished else ["unfinished: it runs, or was killed"]),
        *([robot.source] if robot.source else []),
    ]
    return paragraph(tied(" · ".join(facts)), "note")


def _date(seconds: float) -> str:
    """A moment [s] since 1970 in local time, with the time zone."""
    return datetime.fromtimestamp(seconds, UTC).astimezone().strftime("%Y-%m-%d %H:%M:%S %Z")


def _link(robot: Robot, out: Path) -> Html:
    if robot.page is None:
        return tag("span", text(robot.name), tag("small", text("no report.html")))
    way = os.path.relpath(robot.page.resolve(), out.resolve().parent)
    there = quote(os.fsencode(Path(way).as_posix()))  # names may have bytes that are no text
    return Html(f'<a href="{text(there)}">{text(robot.name)}</a>')


def _states(robot: Robot) -> list[str]:
    return [robot.state, *(["stale"] if robot.stale else [])]


def _badge(word: str) -> Html:
    return tag("span", text(BADGE.get(word, word)), kind=f"state {word}")


def _cell(robot: Robot, series: Series, scales: dict[str, Scale]) -> Html:
    """A quantity of a joint: its change, as a number and as a line."""
    what = series.quantity
    change = next(c for c in robot.changes[what] if c.owner == series.owner)
    low, high = scales[what]
    share, half = _share(series), series.half / abs(_unit(series))
    amount = difference(float(share[-1])) if change.seen else MISSING
    words = f"{spoken(series.owner)} {what} {amount}"
    drawn = Spark(series.t, share, half, 0.0, low, high).draw(words, change.changed)
    told = tag("em", text(amount), kind="outside" if change.changed else "")
    return tag("span", text(what), told, drawn, kind="small")


def _unit(series: Series) -> float:
    """What a change is a share of: the first value, unless that is 0."""
    return float(series.mean[0]) or 1.0


def _share(series: Series) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Change since commissioning as a share, (N,) [-]."""
    return np.asarray((series.mean - series.mean[0]) / abs(_unit(series)))


def _scale(robots: Sequence[Robot], what: str) -> Scale:
    """Least and greatest change that the whole fleet shows once it is settled."""
    low, high = FLOOR[what]
    for robot in robots:
        for series in robot.series[what]:
            settled = series.half <= UNSETTLED * np.median(series.half)
            share = np.append(_share(series)[settled], _share(series)[-1])
            low, high = min(low, float(share.min())), max(high, float(share.max()))
    return max(low, CEILING[what][0]), min(high, CEILING[what][1])


def _unread(unread: Sequence[Unread]) -> Html:
    rows = [
        [text(u.name), text(u.reason), tag("span", text(u.folder), kind="hash")] for u in unread
    ]
    return section(
        "Not read",
        "Nothing is known of these robots; any of them may be urgent.",
        table(["folder", "why", "path"], rows, "words"),
    )
