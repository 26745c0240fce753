"""What was found in a tracked run: what, which joint, since when, how sure, how long left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from urdyn.io.run_folder import RANKS, gravity
from urdyn.io.spans import Clock
from urdyn.report.canvas import BAND, OURS, band, figure, line, rule, shade
from urdyn.report.digits import fixed, number, percent
from urdyn.report.finding_words import before, by, factor, kind, left, size, unit
from urdyn.report.findings import ranked
from urdyn.report.markup import Html, cell, grid, paragraph, plot, section, table, tag, text
from urdyn.report.names import spoken
from urdyn.report.track.history import History
from urdyn.report.track.push import drawn_push
from urdyn.types import NORMAL90

CHOICES = ("now", "later", "never")  # of a service
PUSHES = 6  # of which the currents are drawn
ONE_LINE = 30  # letters of an axis's title that fit beside it in one line
LEAD = (
    "Currents are compared with the model as commissioned, which stays fixed. What a healthy arm "
    "does is no fault: it warms up, changes its program and handles pieces. Sure: probability that "
    "kind and joint are right. Intervals of the onset and of the time left hold 90 %. "
)


def findings(history: History, summary: Mapping[str, Any]) -> Html:
    """A table of what was found, its evidence drawn, and what could not have been seen."""
    found = ranked(summary["findings"])
    clock, start = history.clock, history.start
    if not found:
        told: list[Html] = [paragraph("Nothing was found.")]
    else:
        heads = ["what", "where", "when", "size", "severity", "sure", "time left", "what to do"]
        rows = [_row(finding, clock, start) for finding in found]
        told = [table(heads, rows), _costs(summary["recommendation"])]
    drawn = [_drawn(finding, history) for finding in found if _drawn_here(finding)]
    pushes = [finding for finding in found if "torque_Nm" in finding["evidence"]]
    drawn += [drawn_push(finding, history) for finding in pushes[:PUSHES]]
    blind = _blind(summary["observability"]["joint_backlash"])
    began = f"Times are counted from the first stamp, {start:.2f} s."
    return section("Findings", LEAD + began, *told, *([grid(*drawn)] if drawn else []), *blind)


def _costs(of: Mapping[str, Any]) -> Html:
    """What servicing now, later and never are expected to cost."""
    now, later, never = (number(of["expected_cost"][choice]) for choice in CHOICES)
    return paragraph(
        f"Servicing now is expected to cost as much as {now} planned services, later as "
        f"{later}, never as {never}."
    )


def _row(finding: Mapping[str, Any], clock: Clock, start: float) -> list[Html]:
    seen = ", acknowledged" if finding["acknowledged"] else ""
    bad = "outside" if gravity(finding) > RANKS["notice"] else ""
    return [
        text(kind(finding)),
        text(spoken(finding["name"])),
        _since(finding, clock, start),
        cell(size(finding), finding["quantity"]),
        cell(finding["severity"] + seen, f"alarm at {clock(finding['alarm_s'] - start)}", bad),
        text(percent(finding["confidence"])),
        cell(*_left(finding)),
        tag("span", text(finding["advice"]), kind="todo"),
    ]


def _since(finding: Mapping[str, Any], clock: Clock, start: float) -> Html:
    """When it began, and its interval; for a push, how long it lasted."""
    if before(finding, start):
        return text(by(finding, start, clock))
    began, lasted = clock(finding["onset_s"] - start), finding["evidence"].get("duration_s")
    if lasted is not None:
        return cell(began, f"for {number(lasted)} s; stamp {fixed(finding['onset_s'], 2)} s")
    within = (clock(max(t - start, 0.0)) for t in finding["onset_interval_s"])
    return cell(began, " to ".join(within))


def _left(finding: Mapping[str, Any]) -> Sequence[str]:
    """The time left, over its interval."""
    return (left(finding) or "–").rstrip(")").split(" (", 1)


def _drawn_here(finding: Mapping[str, Any]) -> bool:
    """Whether its course is drawn here; a growing one is drawn with its forecast."""
    return not finding["forecast"] and len(finding["evidence"].get("series", {}).get("t", ())) > 1


def _drawn(finding: Mapping[str, Any], history: History) -> Html:
    clock, series = history.clock, finding["evidence"]["series"]
    t = (np.array(series["t"]) - history.start) / clock.seconds
    change, sd = (factor(finding) * np.array(series[name], float) for name in ("size", "sd"))
    lo, hi = ((x - history.start) / clock.seconds for x in finding["onset_interval_s"])
    traces: list[go.Scatter] = [
        *band(t, change - NORMAL90 * sd, change + NORMAL90 * sd, "90 %"),
        line(t, change, "change", OURS),
    ]
    told = (finding["alarm_s"] - history.start) / clock.seconds
    shapes = [shade(lo, max(hi, lo + 1e-9), "onset"), rule(x=told, label="alarm"), rule(y=0.0)]
    axis = f"{finding['quantity']} [{unit(finding)}]"
    axis = axis if len(axis) < ONE_LINE else axis.replace(" [", "<br>[")
    drawing = figure(traces, clock.axis, axis, 220, shapes=shapes)
    title = f"{spoken(finding['name'])}: {kind(finding)}"
    nats = finding["evidence"].get("nats")
    note = f"evidence {number(nats)} nats at the alarm" if nats else ""
    return plot(drawing, title, note, {"change": OURS, "90 %": BAND})


def _blind(rows: Sequence[Mapping[str, Any]]) -> list[Html]:
    """What this motion could not have shown, and what would."""
    hidden = [row for row in rows if not row["observable"]]
    if not hidden:
        return [paragraph("The motion would have shown backlash in every joint.", "note")]
    names = ", ".join(spoken(row["name"]) for row in hidden)
    ways = (tag("li", text(row["probe"])) for row in hidden)
    return [
        paragraph(f"This motion could not have shown backlash in: {names}.", "note"),
        tag("details", tag("summary", text("What would")), tag("ul", *ways)),
    ]
