"""The page of `urdyn bench track`: the paper's figures, ours, and the best possible."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from urdyn.report.canvas import LEFT, MEASURED, OURS, dots, figure, line, rule
from urdyn.report.digits import MISSING, hundredths, number
from urdyn.report.markup import (
    Html,
    cell,
    document,
    grid,
    join,
    paragraph,
    plot,
    section,
    table,
    tag,
    text,
)

Document = Mapping[str, Any]
COLOURS = {"ours": OURS, "the paper's": LEFT, "bound": MEASURED}


def bench_page(found: Document) -> str:
    """HTML of all that was measured."""
    return document(
        "The paper's tables, measured",
        _headline(found),
        _ramps(found["ramps"]),
        _parameters(found["table_1"]),
        _algorithms(found["table_2"]),
        _configurations(found["table_4"]),
        _intervals(found["truth"]),
        _grounds(found),
    )


def _headline(found: Document) -> Html:
    rows = found["ramps"]
    worst = max(row["ratio"] for row in rows)
    late = max(abs(row["late_bias"]) for row in rows if row["sigma"] <= 0.05)
    words = (
        f"Friction that ramps is followed within {worst:.2f} times the posterior Cramér-Rao bound, "
        f"{late:.4f} off at most where the paper's filter is 0.03 low."
    )
    return join([tag("h1", text("The paper's tables, measured")), paragraph(words, "headline")])


def _ramps(rows: Sequence[Document]) -> Html:
    sigma = [row["sigma"] for row in rows]
    axis = {"type": "log"}
    errors = figure(
        [
            line(sigma, [r["bound"] for r in rows], "bound", MEASURED, dash="dash"),
            line(sigma, [r["paper_rmse"] for r in rows], "the paper's", LEFT),
            line(sigma, [r["rmse"] for r in rows], "ours", OURS, 2.0),
        ],
        "noise of a reading, sigma",
        "RMSE of friction",
        yaxis={"type": "log"},
        xaxis=axis,
    )
    bias = figure(
        [
            line(sigma, [r["paper_bias"] for r in rows], "the paper's", LEFT),
            line(sigma, [r["late_bias"] for r in rows], "ours", OURS, 2.0),
        ],
        "noise of a reading, sigma",
        "mean error",
        shapes=[rule(y=0.0)],
        xaxis=axis,
    )
    lead = (
        "Eq. 5 with 0.0025 a step from an onset that nobody knows. The bound is that of a filter "
        "that is told the onset. The paper's filter is a random walk's, as reconstructed below."
    )
    plots = {"Error": (errors, "over lives and steps"), "Bias": (bias, "18 steps on and later")}
    return section("Ramps", lead, _beside(plots))


def _beside(plots: Mapping[str, tuple[go.Figure, str]]) -> Html:
    """Figures under their titles, each with a note, in the colours of this page."""
    drawn = (plot(drawing, name, note, COLOURS) for name, (drawing, note) in plots.items())
    return grid(*drawn, kind="two")


def _parameters(rows: Sequence[Document]) -> Html:
    sigmas = [s["sigma"] for s in next(r["scenario"] for r in rows if r["scenario"])]
    head = ["group", "paper", *(f"scenario, sigma {s:g}" for s in sigmas), "virtual arms"]
    body = [
        [
            cell(f"{row['name']} ({row['symbol']})", row["comparable"]),
            cell(f"{row['rmse']:g}", f"{row['steps']} steps"),
            *(_on_scenario(ours) for ours in row["scenario"] or [None] * len(sigmas)),
            cell(f"{number(row['arm']['rmse'])} {row['arm']['unit']}", _bounded(row["arm"], "s")),
        ]
        for row in rows
    ]
    lead = (
        "RMSE of every group, with its bound and when it converged: on the scenario when the error "
        "stays below the paper's, on the arms when it stays near that of the second half. Bounds "
        "are of the mean over all arms that a twin expects; a few arms may be below them by luck."
    )
    return section("Table I: parameters", lead, table([*head], body))


def _on_scenario(ours: Document | None) -> Html:
    if ours is None:
        return cell(MISSING, "not in eq. 7")
    return cell(number(ours["rmse"]), _bounded(ours, "steps"))


def _bounded(ours: Document, unit: str) -> str:
    converged = ours["converged"]
    when = "not converged" if converged is None else f"{converged:.3g} {unit}"
    return f"bound {number(ours['bound'])}, {when}"


def _algorithms(rows: Sequence[Document]) -> Html:
    names = [row["name"] for row in rows]
    scenario = [row["scenario"] for row in rows]
    errors = figure(
        [
            _marks(names, [row.get("paper_rmse") for row in rows], "the paper's", LEFT),
            _marks(names, [s["bound"] for s in scenario], "bound", MEASURED),
            _marks(names, [s["rmse"] for s in scenario], "ours", OURS),
        ],
        "",
        "RMSE of friction",
        yaxis={"rangemode": "tozero"},
    )
    on_arm = [row for row in rows if row["arm"]]
    arms = [row["name"] for row in on_arm]
    pace = figure(
        [
            _marks(arms, [row["paper_ms"] for row in on_arm], "the paper's", LEFT),
            _marks(arms, [1e3 / row["arm"]["hz"] for row in on_arm], "ours", OURS),
        ],
        "",
        "time of an update [ms]",
        yaxis={"type": "log"},
    )
    lead = (
        "The paper's four on its own process, a random walk, at the noise that gives its figures; "
        "and the bank over onsets and rates. Time is that of all parameters of a whole arm."
    )
    plots = {
        "Error on the scenario": (errors, "sigma 0.25"),
        "Time of an update on the arm": (pace, "one core"),
    }
    return section("Table II: algorithms", lead, _beside(plots))


def _marks(x: Sequence[str], y: Sequence[float | None], name: str, colour: str) -> go.Scatter:
    return dots(list(x), list(y), name, colour, 11)


def _configurations(rows: Sequence[Document]) -> Html:
    head = ["configuration", "paper", "ours", "an update", "memory"]
    body = []
    for row in rows:
        ours = row["ours"]
        paper = cell(f"{row['hz']:g} Hz", f"{row['mb']:g} MB")
        mine = (
            [
                cell(f"{ours['hz']:.0f} Hz"),
                cell(f"{number(ours['p50_ms'])} ms", f"p99 {number(ours['p99_ms'])} ms"),
                cell(f"{ours['mb']:.0f} MB"),
            ]
            if ours
            else [cell("not there yet"), cell(MISSING), cell(MISSING)]
        )
        body.append([cell(row["name"]), paper, *mine])
    lead = "The whole arm by sigma points, each mode in a process of its own, on this machine."
    return section("Table IV: configurations", lead, table(head, body))


def _intervals(kinds: Sequence[Document]) -> Html:
    """Every group's coverage, by type of arm and noise."""
    symbols = [row["symbol"] for row in kinds[0]["groups"]]
    head = ["arms", *symbols]
    body = [
        [
            cell(f"{arms['arms']} {arms['robot']}", f"{arms['noise']} noise"),
            *(cell(hundredths(row["coverage"]), _between(row)) for row in arms["groups"]),
        ]
        for arms in kinds
    ]
    lead = (
        "Share of the true values that are inside 90 % intervals, with its own 95 % interval, and "
        "normalised error squared a direction, of virtual arms that stray as the twin's process "
        "says."
    )
    return section("Intervals beside the truth", lead, table(head, body))


def _between(row: Document) -> str:
    """A coverage's interval, and the normalised error squared beside it."""
    sure = f"{hundredths(row['coverage_low'])} to {hundredths(row['coverage_high'])}, "
    known = row["coverage_low"] is not None
    return f"{sure if known else ''}NEES {hundredths(row['nees'])}"


def _grounds(found: Document) -> Html:
    rows = [[text(what), text(value)] for what, value in found["reconstruction"].items()]
    lead = "What the paper does not say, and what is taken for it here."
    return section("Reconstructed", lead, table(["what", "as"], rows))
