"""The first screen of a tracked run: did anything change, since when, and what is carried."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from urdyn.io.run_folder import MISSES
from urdyn.io.spans import Clock
from urdyn.report.digits import MISSING, interval90, number, percent
from urdyn.report.finding_words import kind, rising, size, when
from urdyn.report.findings import ranked, unjudged
from urdyn.report.markup import Html, cell, facts, grid, join, paragraph, table, tag, text
from urdyn.report.names import QUANTITIES, capital, maker, spoken
from urdyn.report.setting import set_to
from urdyn.report.track.change import LEVELS, SDS, SHARE, WATCHED, Change
from urdyn.report.track.history import PAYLOAD, History
from urdyn.report.track.payload import carried
from urdyn.report.track.surprise import Surprise, trust_track
from urdyn.report.track.verdict import CHANGED, TOLD, concern, verdict

UNIT = re.compile(
    r"(?<=\d) (?=±|%|kg\b|s\b|min\b|h\b|d\b|mrad\b)|(?<=±) |(?<=\d) (?=to \d)|(?<=to) (?=\d)"
)
TABLED = ("friction", "health")
TRACKED = "Tracked parameters, changed: "  # start of a verdict beside findings
BENT = " A sensor fault distorts these values."
PARTS = (
    " The size of a friction finding is the increase of all friction of its joint, as it moved; "
    "Coulomb friction is one part of that, and may change by more or less."
)
READ = (  # how the tables are read
    "Expected is the commissioned value; its interval is wider than at commissioning, by what a "
    f"healthy arm strays from day to day. Steady means within {percent(SHARE)} of it; unsure, "
    f"further from it but by less than {SDS:.0f} combined standard deviations (sd), or so little "
    "known that a change of friction by {friction} or of health by {health} would not show."
)


def track_headline(
    history: History,
    summary: Mapping[str, Any],
    found: Sequence[Change],
    changed: Sequence[float],
    surprised: Surprise,
) -> Html:
    """Title, verdict, payload, every joint then and now, and a few facts."""
    known = summary["payload_known"]
    load = carried(history, changed, known) if history.holds(PAYLOAD, "mass") else ""
    diagnosed, judged = "findings" in summary, _judged(summary, surprised)
    said = verdict(found, history.clock) if judged else ""
    if diagnosed and said.startswith(CHANGED):
        said = said.replace(CHANGED, TRACKED, 1)
        said += _beside(said, {f["kind"] for f in summary["findings"]})
    if setting := set_to(summary.get("payload_setting")):
        load = f"{load} {capital(setting)}."
    moved = f"{said} {load}".strip()
    return join(
        [
            tag("h1", text(f"{maker(str(summary['robot']))} · tracked dynamics")),
            *(_diagnosed(history, summary, judged, concern(found)) if diagnosed else []),
            *([paragraph(tied(moved), "said" if diagnosed else "headline")] if moved else []),
            paragraph(
                tied(f"{trust_track(surprised)} {_read(summary)} {_hold(surprised)}"), "lead"
            ),
            grid(*(_table(found, quantity) for quantity in TABLED)),
            facts(_facts(summary, history.clock)),
        ]
    )


def _beside(said: str, kinds: Collection[str]) -> str:
    """How to read `said` about tracked parameters beside findings of these kinds."""
    bent = BENT if "sensor_fault" in kinds else ""
    two = "friction_increase" in kinds and WATCHED["coulomb"] in said
    return bent + (PARTS if two else "")


def _read(summary: Mapping[str, Any]) -> str:
    """How the tables are read, by the levels of this run's diagnosis."""
    levels = summary.get("levels", LEVELS)
    friction, health = (percent(levels[of]["critical"]) for of in ("friction", "health"))
    return READ.format(friction=friction, health=health)


def _hold(surprised: Surprise) -> str:
    """The coverage of the intervals, which are the model's."""
    if surprised.overall > MISSES:
        return "Intervals would hold 90 % if nothing were missing."
    return "Intervals hold 90 %."


def _diagnosed(history: History, summary: Mapping[str, Any], judged: bool, look: str) -> list[Html]:
    """Is anything wrong, since when, and what to do, which includes the `look` at changes."""
    found, advice = ranked(summary["findings"]), summary["recommendation"]
    time = history.clock
    if not found:
        return _nothing_found(summary, time(summary["data_s"]), judged, look)
    told = " ".join(_sentence(f, time, history.start) for f in found[:TOLD])
    rest = f" And {len(found) - TOLD} more, below." if len(found) > TOLD else ""
    doubt, do = (
        [paragraph(tied(f"{capital(_spoken(said, found))}."), "advice")] if said else []
        for said in (summary.get("doubt"), advice["text"])
    )
    return [*doubt, paragraph(tied(f"{told}{rest}"), "headline"), *do]


def _spoken(said: str, found: Sequence[Mapping[str, Any]]) -> str:
    """A sentence with the spoken names of joints and links that have findings."""
    for f in found:
        said = said.replace(f["name"], spoken(f["name"]))
    return said


def _nothing_found(summary: Mapping[str, Any], lasted: str, judged: bool, look: str) -> list[Html]:
    """That nothing is wrong among what was seen well enough to judge."""
    told = f"Nothing wrong was found in {lasted}."
    todo = f"Leave it at work, but {look}." if look else "Leave it at work."
    if not judged:
        told = f"Too little was compared in {lasted} to judge."
        todo = "Track it for longer, while its joints move."
    elif few := unjudged(summary["joints"]):
        which = ", ".join(map(spoken, few))
        told += f" Too little was seen of {which}, now or at commissioning, to judge."
    return [paragraph(tied(told), "headline"), paragraph(todo, "advice")]


def _judged(summary: Mapping[str, Any], surprised: Surprise) -> bool:
    """Whether enough was compared to judge any joint."""
    rows = summary.get("joints", ())
    blind = bool(rows) and len(unjudged(rows)) == len(rows)
    return bool(np.isfinite(surprised.overall)) and not blind


def _sentence(f: Mapping[str, Any], time: Clock, start: float) -> str:
    """One finding: what, where, when, how bad, how long."""
    known = ", acknowledged" if f["acknowledged"] else ""
    at = f" at {time(f['forecast']['at_s'] - start)}" if f["forecast"] else ""
    told = f"{capital(spoken(f['name']))}: {kind(f)}, {size(f)}{at}, {when(f, start, time)}"
    return f"{told}; {rising(f)}{known}."


def tied(words: str) -> str:
    """Words in which no line breaks between a number and its unit or interval."""
    return UNIT.sub("\u00a0", words)


def _table(found: Sequence[Change], quantity: str) -> Html:
    rows = [c for c in found if c.quantity == quantity]
    unit = rows[0].unit if rows else "-"
    return tag(
        "div",
        tag("h3", text(f"{QUANTITIES.get(quantity, quantity)} [{unit}]")),
        table(["", "now / expected", "change"], [_row(c) for c in rows]),
    )


def _row(c: Change) -> list[Html]:
    kind = "outside" if c.changed else ""
    return [
        text(spoken(c.owner)),
        cell(interval90(c.now, c.now_sd), interval90(c.then, c.then_sd)),
        cell(c.amount if c.seen else MISSING, _size(c), kind),
    ]


def _size(c: Change) -> str:
    if not c.seen:
        return c.word
    z = round(c.z, 1)
    sd = f"{z:+.1f} sd".replace("-", "−") if z else "0 sd"
    return ", ".join(filter(None, (sd, c.word)))


def _facts(summary: Mapping[str, Any], time: Clock) -> dict[str, str]:
    return {
        "samples": f"{summary['samples']:,}",
        "data": time(summary["data_s"]),
        "filter": str(summary["filter"]),
        "quick enough for": f"{number(summary['rate_hz'], 3)} Hz",
        "latency": f"{number(summary['latency_ms']['p99'])} ms (99 %)",
    }
