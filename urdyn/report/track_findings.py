"""What was found in a tracked run: what, which joint, since when, how sure, how long left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from urdyn.report.canvas import BAND, LEFT, OURS, band, figure, line, rule, shade
from urdyn.report.digits import NORMAL90, number, percent
from urdyn.report.markup import Html, cell, grid, paragraph, plot, section, table, text
from urdyn.report.names import spoken
from urdyn.report.track_history import Clock, History

KINDS = {
    "friction_increase": "friction increase",
    "health_degradation": "drive health",
    "joint_backlash": "backlash",
    "controller_instability": "instability",
    "payload_change": "payload change",
    "collision": "collision",
    "encoder_offset": "encoder offset",
    "sensor_fault": "sensor fault",
}
LEAD = (
    "Faults as the commissioned model, which is held for this, tells them from a healthy arm that "
    "warms up, changes its program and handles pieces. Sure is the probability that kind and joint "
    "are these; the interval of the onset and of the time left hold 90 %."
)


def findings(history: History, summary: Mapping[str, Any]) -> Html:
    """A table of what was found, its evidence drawn, and what could not have been seen."""
    found: Sequence[Mapping[str, Any]] = summary["findings"]
    clock, start = history.clock, history.start
    if not found:
        told: list[Html] = [paragraph("Nothing was found.", "headline")]
    else:
        heads = ["what", "where", "since", "size", "severity", "sure", "time left", "what to do"]
        rows = [_row(finding, clock, start) for finding in found]
        told = [table(heads, rows), *_recommended(summary.get("recommendation"))]
    drawn = [_drawn(finding, history) for finding in found if _has_series(finding)]
    blind = _blind(summary.get("observability", {}).get("joint_backlash", ()))
    return section("Findings", LEAD, *told, *([grid(*drawn)] if drawn else []), paragraph(blind))


def _recommended(of: Mapping[str, Any] | None) -> list[Html]:
    """What to do about it, and what each choice is expected to cost."""
    if of is None:
        return []
    cost = of["expected_cost"]
    words = f"Recommended: {of['text']}."
    if cost is None:
        return [paragraph(words)]
    told = ", ".join(f"{choice} {number(cost[choice])}" for choice in ("now", "later", "never"))
    return [paragraph(f"{words} Expected cost, in planned services: {told}.")]


def _row(finding: Mapping[str, Any], clock: Clock, start: float) -> list[Html]:
    lo, hi = finding["onset_interval_s"]
    left = finding["time_to_failure_s"]
    seen = ", acknowledged" if finding["acknowledged"] else ""
    bad = "outside" if finding["severity"] != "notice" and not seen else ""
    return [
        text(KINDS.get(finding["kind"], finding["kind"].replace("_", " "))),
        text(spoken(finding["name"])),
        cell(clock(finding["onset_s"] - start), f"{clock(lo - start)} to {clock(hi - start)}"),
        cell(_size(finding), finding["quantity"]),
        cell(finding["severity"] + seen, f"told at {clock(finding['alarm_s'] - start)}", bad),
        text(percent(finding["confidence"])),
        cell(_span(left["median"]), f"{_span(left['lo'])} to {_span(left['hi'])}")
        if left
        else text("–"),
        text(finding["advice"]),
    ]


def _size(finding: Mapping[str, Any]) -> str:
    sd = finding["size_sd"]
    half = "" if sd is None else f" ± {number(NORMAL90 * _readable(finding, sd))}"
    unit = "%" if finding["unit"] == "-" else finding["unit"]
    return f"{number(_readable(finding, finding['size']))}{half} {unit}"


def _readable(finding: Mapping[str, Any], value: float) -> float:
    return 100.0 * value if finding["unit"] == "-" else value


def _span(seconds: float) -> str:
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{number(seconds / size, 2)} {unit}"
    return f"{number(seconds, 2)} s"


def _has_series(finding: Mapping[str, Any]) -> bool:
    return len(finding["evidence"].get("series", {}).get("t", ())) > 1


def _drawn(finding: Mapping[str, Any], history: History) -> Html:
    clock, series = history.clock, finding["evidence"]["series"]
    t = (np.array(series["t"]) - history.start) / clock.seconds
    size, sd = (_readable(finding, 1.0) * np.array(series[name]) for name in ("size", "sd"))
    lo, hi = ((x - history.start) / clock.seconds for x in finding["onset_interval_s"])
    traces: list[go.Scatter] = [
        *band(t, size - NORMAL90 * sd, size + NORMAL90 * sd, "90 %"),
        line(t, size, "change", OURS),
    ]
    told = (finding["alarm_s"] - history.start) / clock.seconds
    shapes = [shade(lo, max(hi, lo + 1e-9), "onset"), rule(x=told), rule(y=0.0)]
    unit = "%" if finding["unit"] == "-" else finding["unit"]
    drawing = figure(traces, clock.axis, f"{finding['quantity']} [{unit}]", 220, shapes=shapes)
    title = f"{spoken(finding['name'])}: {KINDS.get(finding['kind'], finding['kind'])}"
    nats = finding["evidence"].get("nats")
    note = f"evidence {number(nats)} nats at the alarm" if nats else ""
    return plot(drawing, title, note, {"change": OURS, "90 %": BAND, "alarm": LEFT})


def _blind(rows: Sequence[Mapping[str, Any]]) -> str:
    hidden = [row for row in rows if not row["observable"]]
    if not hidden:
        return "Backlash could have been seen in every joint."
    told = "; ".join(f"{spoken(row['name'])}: {row['probe']}" for row in hidden)
    return f"Backlash is not observable in this motion for some joints. It would be: {told}."
