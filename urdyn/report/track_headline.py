"""The first screen of a tracked run: did anything change, since when, and what is carried."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from urdyn.report.digits import interval90, number, percent
from urdyn.report.markup import Html, cell, grid, join, paragraph, table, tag, text
from urdyn.report.names import QUANTITIES, spoken
from urdyn.report.track_change import SDS, SHARE, Change, verdict
from urdyn.report.track_history import PAYLOAD, History
from urdyn.report.track_payload import carried
from urdyn.report.track_surprise import Surprise, trust_track

UNIT = re.compile(r"(?<=\d) (?=±|%|kg\b|s\b|min\b|h\b|d\b|mrad\b)|(?<=±) ")
TABLED = ("coulomb", "viscous", "health")
STEADY = (
    f"Steady is what differs from commissioning by less than {SDS:.0f} combined standard "
    f"deviations (sd) or {percent(SHARE)}. Intervals hold 90 %."
)


def track_headline(
    history: History,
    summary: Mapping[str, Any],
    found: Sequence[Change],
    changed: Sequence[float],
    surprised: Surprise,
) -> Html:
    """Title, verdict, payload, every joint then and now, and a few facts."""
    load = carried(history, changed) if history.holds(PAYLOAD, "mass") else ""
    return join(
        [
            tag("h1", text(f"{arm(summary)} · tracked dynamics")),
            paragraph(tied(f"{verdict(found, history.clock)} {load}".strip()), "headline"),
            paragraph(tied(f"{trust_track(surprised)} {STEADY}"), "lead"),
            grid(*(_table(found, quantity) for quantity in TABLED)),
            tag("dl", *(_fact(k, v) for k, v in _facts(summary).items()), kind="facts"),
        ]
    )


def arm(summary: Mapping[str, Any]) -> str:
    """The arm's type as its maker writes it."""
    name = str(summary["robot"])
    return name.replace("ur", "UR", 1) if name.startswith("ur") else name


def tied(words: str) -> str:
    """Words in which no line breaks between a number and its unit or interval."""
    return UNIT.sub("\u00a0", words)


def _table(found: Sequence[Change], quantity: str) -> Html:
    rows = [c for c in found if c.quantity == quantity]
    unit = rows[0].unit if rows else "-"
    return tag(
        "div",
        tag("h3", text(f"{QUANTITIES.get(quantity, quantity)} [{unit}]")),
        table(["", "now / commissioned", "change"], [_row(c) for c in rows]),
    )


def _row(c: Change) -> list[Html]:
    kind = "" if c.steady else "outside"
    return [
        text(spoken(c.owner)),
        cell(interval90(c.now, c.now_sd), interval90(c.then, c.then_sd)),
        cell(c.amount, _size(c), kind),
    ]


def _size(c: Change) -> str:
    z = f"{round(c.z, 1) + 0.0:+.1f} sd".replace("-", "−")
    return f"{z}, steady" if c.steady else z


def _facts(summary: Mapping[str, Any]) -> dict[str, str]:
    return {
        "samples": f"{summary['samples']:,}",
        "data": f"{number(summary['data_s'], 3)} s",
        "filter": str(summary["filter"]),
        "rate": f"{number(summary['rate_hz'], 3)} Hz",
        "latency": f"{number(summary['latency_ms']['p99'])} ms (99 %)",
    }


def _fact(name: str, value: str) -> Html:
    return tag("div", tag("dt", text(name)), tag("dd", text(value)))
