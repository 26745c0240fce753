"""The first screen: how good, how sure, compared with what."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from urdyn.identify import Fit, Score
from urdyn.report.canvas import CONTROLLER, MEASURED, OURS, dots, figure, rule
from urdyn.report.digits import number, percent
from urdyn.report.evidence import Pooled, pool, telling
from urdyn.report.markup import Html, cell, facts, grid, join, paragraph, plot, table, tag, text
from urdyn.report.names import capital, joints, robot
from urdyn.types import Array

RESTS = 0.1  # [-] of the rows, from which on rest is mentioned: less are turning points


def headline(
    fit: Fit,
    scores: Sequence[Score],
    deed: str,
    known: dict[str, str],
    doubts: Sequence[str] = (),
) -> Html:
    """Title, doubts, the answer in one sentence, the bars that show it, and a few facts."""
    title = tag("h1", text(f"{robot(fit)} · {deed}"))
    doubted = [paragraph(f"{capital(said)}.", "advice") for said in doubts]
    if not scores:
        return join([title, *doubted, paragraph("No log was scored.", "headline"), facts(known)])
    found = pool(fit, telling(fit, scores))
    names = joints(fit)
    colours = {name: colour for name, _, colour in _bars(found)}
    return join(
        [
            title,
            *doubted,
            paragraph(sentence(found, names), "headline"),
            paragraph(trust(found), "lead"),
            grid(
                plot(_errors(found, names), "Error of predicted current", _measure(found), colours),
                plot(_coverage(found, names), "Inside the 90 % interval, moving", "aim: 90 %"),
                kind="wide-first",
            ),
            tag("details", tag("summary", text("The same in numbers")), _numbers(found, names)),
            facts(known),
        ]
    )


def sentence(found: Pooled, names: Sequence[str]) -> str:
    """How good the model is, beside the controller's own and the sensor's floor."""
    where = "On motion that it has not seen, the model" if found.unseen else "The model"
    words = f"{where} predicts motor current to {_range(found.ours, names)}"
    if np.isfinite(found.controller).any():
        words += f"; the controller’s own model is at {_range(found.controller, names)}"
    if np.isfinite(found.floor).any():
        words += f"; the sensor’s floor is {_range(found.floor, names)}"
    return f"{words}.{_rests(found, names)}"


def _rests(found: Pooled, names: Sequence[str]) -> str:
    """How good it is without the rows in which joints stood, where those are many; else ""."""
    most = float(np.nanmax(found.standing, initial=0.0))
    if most < RESTS:
        return ""
    words = f" Joints stood in up to {percent(most)} of the rows, and no model predicts stiction"
    if not np.isfinite(found.moving).any():
        return words + "."
    return f"{words}: while they moved the error is {_range(found.moving, names)}."


def trust(found: Pooled) -> str:
    """What the figures rest on, and how sure the model is of itself."""
    words = (
        []
        if found.unseen
        else [
            "These logs were seen in training, in part at least; score a log held out to judge it."
        ]
    )
    ratio = found.ours / found.controller
    if np.isfinite(ratio).any():
        words.append(f"Its error is {number(_geometric(ratio))} times the controller’s on average.")
    inside = found.coverage[np.isfinite(found.coverage)]
    if len(inside):
        least, most = percent(inside.min()), percent(inside.max())
        share = least if least == most else f"{least} to {most}"
        words.append(f"Its 90 % intervals hold {share} of the samples measured while joints moved.")
    return " ".join(words)


def _range(values: Array, names: Sequence[str]) -> str:
    """The best and the worst joint, each by name."""
    told = np.flatnonzero(np.isfinite(values))
    if not len(told):
        return "an unknown error"
    best, worst = told[values[told].argmin()], told[values[told].argmax()]
    if best == worst:
        return f"{number(values[best])} % ({names[best]})"
    return f"{number(values[best])} % ({names[best]}) … {number(values[worst])} % ({names[worst]})"


def _geometric(ratio: Array) -> float:
    return float(np.exp(np.nanmean(np.log(ratio))))


def _measure(found: Pooled) -> str:
    data = "held-out logs" if found.unseen else "training logs"
    return f"100 |measured − predicted| / |measured|, raw current, {data}"


def _bars(found: Pooled) -> list[tuple[str, Array, str]]:
    series = [
        ("this model", found.ours, OURS),
        ("controller’s target current", found.controller, CONTROLLER),
        ("sensor floor (above 10 Hz)", found.floor, MEASURED),
    ]
    return [row for row in series if np.isfinite(row[1]).any()]


def _errors(found: Pooled, names: Sequence[str]) -> go.Figure:
    bars = [
        go.Bar(
            x=list(names),
            y=values,
            name=name,
            marker={"color": colour},
            text=[number(value) for value in values],
            textposition="outside",
            cliponaxis=False,
            textfont={"size": 10},
            hovertemplate="%{x}: %{y:.1f} %",
        )
        for name, values, colour in _bars(found)
    ]
    drawing = figure(
        bars, "", "relative error [%]", 300, barmode="group", bargap=0.25, bargroupgap=0.04
    )
    return drawing.update_xaxes(automargin=True)


def _coverage(found: Pooled, names: Sequence[str]) -> go.Figure:
    inside = 100.0 * found.coverage
    marks = dots(inside, list(names), "", OURS, 11, hovertemplate="%{y}: %{x:.1f} %")
    lowest = float(np.nanmin(inside, initial=90.0))
    drawing = figure([marks], "samples inside [%]", "", 300, shapes=[rule(x=90.0)])
    drawing.update_xaxes(range=[min(75.0, lowest - 5.0), 100.5])
    return drawing.update_yaxes(autorange="reversed", automargin=True)


def _numbers(found: Pooled, names: Sequence[str]) -> Html:
    rows = [
        [text(f"{name} [%]"), *(cell(number(value)) for value in values)]
        for name, values, _ in _bars(found)
    ]
    shares = {
        "rows in which the joint stood": [percent(x) for x in found.standing],
        "this model while it moved [%]": [number(x) for x in found.moving],
        "90 % interval while it moved": [percent(x) for x in found.coverage],
    }
    rows += [[text(name), *map(cell, values)] for name, values in shares.items()]
    return table(["", *names], rows)
