"""Trends of friction, damping, health and zero of every joint, and masses of the links."""

from __future__ import annotations

from collections.abc import Sequence

from urdyn.io.spans import Clock
from urdyn.report.canvas import MEASURED, OURS
from urdyn.report.digits import interval90
from urdyn.report.identify.masses import WHY
from urdyn.report.markup import Html, grid, key, plot, section, tag, text
from urdyn.report.names import capital, spoken
from urdyn.report.track.change import WATCHED, Change
from urdyn.report.track.history import History
from urdyn.report.track.trace import PALE, trend

COLOURS = {"mean": OURS, "90 % interval": PALE, "at commissioning": MEASURED}


def trends(history: History, found: Sequence[Change]) -> Html:
    """A plot per joint and quantity."""
    parts = (
        part
        for quantity, word in WATCHED.items()
        for part in (
            tag("h3", text(capital(word))),
            grid(*(_trend(history, c) for c in found if c.quantity == quantity)),
        )
    )
    return section(
        "Trends",
        "Estimate after each sample. Where a joint moves little the band widens: nothing is learnt "
        "there, and wear may go on. Drag to zoom, double-click to see all.",
        key(COLOURS),
        *parts,
    )


def _trend(history: History, c: Change) -> Html:
    drawing = trend(history.series(c.owner, c.quantity), history.clock)
    return plot(drawing, spoken(c.owner), _told(c, history.clock))


def _told(c: Change, clock: Clock) -> str:
    """A change in a few words."""
    return c.word or f"{c.amount} since {clock(c.since)}"


def link_masses(history: History) -> Html:
    """A plot per link, and what none of them can show."""
    return section(
        "Link masses", WHY, key(COLOURS), grid(*(_mass(history, link) for link in history.links))
    )


def _mass(history: History, link: str) -> Html:
    series = history.series(link, "mass")
    now = interval90(float(series.mean[-1]), float(series.sd[-1]))
    return plot(trend(series, history.clock), spoken(link), f"now {now} kg")
