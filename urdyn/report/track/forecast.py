"""Forecasts of findings: fans of quantiles up to the levels, and how long each joint lasts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from urdyn.io.spans import Clock, clock, span_of
from urdyn.report.canvas import BAND, LEFT, OURS, band, dots, figure, line, rule, shade
from urdyn.report.digits import MISSING, number, percent
from urdyn.report.finding_words import (
    UNJUDGED,
    ahead,
    amount,
    factor,
    kind,
    lasting,
    passed,
    sound,
    unit,
)
from urdyn.report.markup import Html, cell, grid, key, paragraph, plot, section, table, text
from urdyn.report.names import spoken
from urdyn.report.track.history import History
from urdyn.report.track.trace import PALE
from urdyn.types import NORMAL90

NARROW, WIDE = ("0.25", "0.75"), ("0.05", "0.95")  # the quantiles of a fan
CORE = "rgba(86,180,233,0.3)"
KEY = {"seen": OURS, "forecast, half of all cases": BAND, "90 %": PALE}
REACHED = {"level reached, 90 %": LEFT}
LEAD = (
    "For every finding that grows: the change so far with its 90 % band, and how it goes on at its "
    "present rate, from the same draws as the time left. A change whose rate is not surely above "
    "zero has no forecast."
)
ROOM = 0.12  # [-] of the plot's height above the critical level
STEADY = ("friction_increase", "health_degradation")  # kinds that are looked for on every joint


def forecasts(history: History, summary: Mapping[str, Any]) -> Html:
    """A fan for each finding that grows, a word for the others, and a table of the joints."""
    found: Sequence[Mapping[str, Any]] = summary["findings"]
    growing = [finding for finding in found if finding["forecast"]]
    coming = any(not passed(f["time_to_failure_s"]) for f in growing)
    colours = KEY | (REACHED if coming else {})
    fans = grid(*(_fan(f, history) for f in growing), kind="two")
    drawn = [key(colours), fans] if growing else []
    words = [paragraph(_others(found, history.joints))]
    return section("Forecast", LEAD, *drawn, *words, _health(summary, found))


def _others(found: Sequence[Mapping[str, Any]], joints: Sequence[str]) -> str:
    """Findings without a fan, and why."""
    still = [f for f in found if f["kind"] in STEADY and not f["forecast"]]
    named = "; ".join(f"{spoken(f['name'])}, {kind(f)}" for f in still)
    told = f"No trend is established of {named}: found, but not surely growing. " if still else ""
    known = {f["name"] for f in found if f["kind"] in STEADY}
    quiet = [j for j in joints if j not in known]
    if len(quiet) == len(joints):
        return f"{told}No trend is established in the friction or drive health of any joint."
    if not quiet:
        return told.strip()
    names = ", ".join(map(spoken, quiet))
    return f"{told}No trend is established in friction or drive health of: {names}."


def _fan(finding: Mapping[str, Any], history: History) -> Html:
    told = finding["forecast"]
    begin, now = finding["onset_interval_s"][0], told["at_s"]
    time = clock(now + told["ahead_s"][-1] - history.start)
    scale = factor(finding)
    by = {q: scale * np.array(y, float) for q, y in told["quantiles"].items()}
    later = (np.array(told["ahead_s"]) + now - history.start) / time.seconds
    first = max(begin - history.start, 0.0) / time.seconds
    levels = {name: scale * told[name] for name in ("warning", "critical")}
    traces = [
        *(_faint(trace, PALE) for trace in band(later, by[WIDE[0]], by[WIDE[1]], "90 %")),
        *(_faint(trace, CORE) for trace in band(later, by[NARROW[0]], by[NARROW[1]], "half")),
        line(later, by["0.5"], "forecast", OURS, 1.6, dash="dot"),
        *_seen(finding, history, time),
        *(_reached(told, name, y, history, time) for name, y in levels.items()),
    ]
    shapes = [
        *(rule(y=y, label=f"{name} {amount(finding, y / scale)}") for name, y in levels.items()),
        rule(x=(now - history.start) / time.seconds, label="now"),
        rule(x=(finding["alarm_s"] - history.start) / time.seconds, label="alarm"),
        shade(first, (finding["onset_interval_s"][1] - history.start) / time.seconds, "onset"),
    ]
    title = f"{finding['quantity']} [{unit(finding)}]"
    drawing = figure(traces, time.axis, title, 300, shapes=shapes)
    drawing.update_xaxes(range=[first, later[-1]])
    drawing.update_yaxes(range=_heights(levels["critical"], by, _seen_sizes(finding)))
    return plot(drawing, f"{spoken(finding['name'])}: {kind(finding)}", ahead(finding))


def _faint(trace: go.Scatter, colour: str) -> go.Scatter:
    return trace.update(fillcolor=colour) if trace.fill else trace


def _seen_sizes(finding: Mapping[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    series = finding["evidence"].get("series", {})
    return factor(finding) * np.array(series.get("size", ()), float)


def _seen(finding: Mapping[str, Any], history: History, time: Clock) -> list[go.Scatter]:
    """The change so far, up to where its forecast begins."""
    told, series = finding["forecast"], finding["evidence"].get("series", {})
    size, scale = _seen_sizes(finding), factor(finding)
    half = NORMAL90 * scale * np.array(series.get("sd", ()), float)
    first, now, last = sorted(scale * told["quantiles"][q][0] for q in (WIDE[0], "0.5", WIDE[1]))
    t = (np.append(series.get("t", ()), told["at_s"]) - history.start) / time.seconds
    low, high = band(t, np.append(size - half, first), np.append(size + half, last), "90 %")
    size = np.append(size, now)
    return [low, _faint(high, PALE), line(t, size, "seen", OURS, 1.8)]


def _reached(
    told: Mapping[str, Any], name: str, y: float, history: History, time: Clock
) -> go.Scatter:
    """When a level is reached: a dot at the median on a bar of 90 %; none where it was passed."""
    left = told[f"to_{name}_s"]
    here = (told["at_s"] - history.start) / time.seconds
    median, lo, hi = (left[k] / time.seconds for k in ("median", "lo", "hi"))
    bar = {
        "type": "data", "symmetric": False, "array": [hi - median], "arrayminus": [median - lo],
        "thickness": 3, "width": 5,
    }  # fmt: skip
    x = [here + median] if median > 0.0 else [np.nan]
    words = f"{name} in {span_of(left)}"
    return dots(np.array(x), np.array([y]), words, LEFT, 9, error_x=bar, hovertemplate=words)


def _heights(critical: float, by: Mapping[str, Any], seen: Any) -> list[float]:
    """From below what was seen to above the critical level; the fan may leave at the top."""
    ends = np.array([0.0, critical, by["0.5"][0], *seen])
    low, high = float(ends.min()), float(ends.max())
    room = ROOM * (high - low)
    return [low - room, high + room]


def _health(summary: Mapping[str, Any], found: Sequence[Mapping[str, Any]]) -> Html:
    """Whether each joint, and the arm, lasts until a service can be planned."""
    arm, joints = summary["arm"], summary["joints"]
    if not found:
        return paragraph(f"Health index of the arm: {lasting(arm)}.")
    index = f"health index, {number(arm['horizon_h'])} h"
    heads = ["joint", index, "friction", "drive health", "other findings"]
    names = {row["name"] for row in joints}
    apart = ", ".join(kind(f) for f in found if f["name"] not in names)
    whole = [text("whole arm"), _index(arm, sound(arm)), *(cell("") for _ in STEADY), text(apart)]
    return table(heads, [*(_joint(row, found) for row in joints), whole])


def _index(row: Mapping[str, Any], words: str = "") -> Html:
    """A health index, marked where a failure is likelier than not."""
    share = row["health_index"]
    if share is None:
        return cell(UNJUDGED)
    return cell(percent(share), words, "outside" if share < 0.5 else "")


def _joint(row: Mapping[str, Any], found: Sequence[Mapping[str, Any]]) -> list[Html]:
    own = [f for f in found if f["name"] == row["name"]]
    told = row.get("judged", True)
    others = ", ".join(kind(f) for f in own if f["kind"] not in STEADY)
    return [
        text(spoken(row["name"])),
        _index(row) if told or own else cell(MISSING),
        *(_of_kind(own, name, told) for name in STEADY),
        text(others or ("none" if told else UNJUDGED)),
    ]


def _of_kind(own: Sequence[Mapping[str, Any]], name: str, judged: bool) -> Html:
    finding = next((f for f in own if f["kind"] == name), None)
    if finding is None:
        return cell("nothing found" if judged else UNJUDGED)
    grave = "outside" if finding["severity"] != "notice" else ""
    return cell(amount(finding, finding["size"]), finding["severity"], grave)
