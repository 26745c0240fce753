"""The page of `urdyn bench faults`: what is promised, what is found, and when it will matter."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

import numpy as np
import plotly.graph_objects as go

from urdyn.report.bench import figure_four
from urdyn.report.bench.confusion import Kinds, told_apart
from urdyn.report.bench.shares import interval, share_of
from urdyn.report.bench.table_three import HEADS, TOGETHER, OnArm, Row, steps_of, table_three
from urdyn.report.canvas import CONTROLLER, JOINTS, MEASURED, OURS, TRUTH, figure, line, rule
from urdyn.report.digits import percent
from urdyn.report.markup import Html, document, grid, paragraph, plot, section, table, tag, text

DETECTORS = {
    "Shiryaev-Roberts": OURS,
    "Shiryaev-Roberts, six joints": JOINTS[4],
    "CUSUM": JOINTS[2],
    "GLR": JOINTS[3],
    "Algorithm 2, tuned": CONTROLLER,
    "Algorithm 2, as in the paper": TRUTH,
    "oracle CUSUM": MEASURED,
}

SEEN = 0.05  # growth over sigma, from which on faults should be found in time
LINE = 14  # characters of a name below a bar
TICKS = (0.01, 0.025, 0.05, 0.1, 0.25, 0.5)  # growth over sigma


@dataclass(frozen=True)
class Kept:
    """How a promise fares on healthy data of some kind."""

    noise: str
    share: float  # of healthy runs with an alarm
    promised: float
    runs: int


@dataclass(frozen=True)
class Predicted:
    """Forecasts of the critical crossing, over many lives."""

    sigma: float
    age: int  # [steps] after the onset
    left: float  # [steps] to the crossing in truth
    error: float  # [-] median of |median - truth| / what is left
    coverage: float  # of 90 % intervals
    lives: int


@dataclass(frozen=True)
class Paper:
    """The paper's own figures."""

    faults: Mapping[str, tuple[float, float, float]]  # Table III: found, "FP rate", steps
    figure4: figure_four.Told


def fault_page(
    rows: Sequence[Row],
    kept: Sequence[Kept],
    life: figure_four.Foreseen,
    predicted: Sequence[Predicted],
    kinds: Kinds | None,
    on_arm: Sequence[OnArm],
    paper: Paper,
    reconstruction: Mapping[str, str],
) -> str:
    """HTML of the bench; `kinds` and `on_arm` are of a virtual arm, if one was broken."""
    return document(
        "Faults found",
        tag("h1", text("Faults found, beside the paper's")),
        paragraph(_headline(rows, kept), "headline"),
        section(
            "Table III",
            "The paper's rates beside ours. On its scenario, eq. 5 to 7, a fault counts as found "
            "when the alarm comes after its onset and before the true parameter crosses the "
            "warning level, 40 steps later; ours watches all six joints, with one promise for all, "
            "at several levels of noise sigma. Backlash and instability are in no equation of the "
            "paper: they are measured on a virtual arm that a commissioned twin is compared with, "
            "100 steps a second, as faults of one size that come at once. Found is what is told of "
            "the right kind and joint; false is what is told of the kind where it is not, over all "
            "runs; not to be seen is what a motion cannot show. Sure is the median confidence of "
            "what is found. In brackets are 95 % intervals.",
            table(HEADS, _cells(table_three(rows, on_arm, paper.faults))),
        ),
        *([told_apart(kinds)] if kinds else []),
        section(
            "How soon",
            "Delay over that of an oracle, a CUSUM that is told the ramp and only has to find its "
            "onset; and the share found in time. All promise one false alarm in 10,000 steps, and "
            "all are told which way a parameter goes that wears, as the paper tells.",
            grid(_delays(rows), _shares(rows), kind="two"),
            _all(rows),
        ),
        section(
            "The promise",
            "Healthy runs of 1000 steps with an alarm, after a baseline of 1000 steps. What is "
            "promised is drawn as a line; whiskers are 95 % intervals.",
            _promise(kept),
        ),
        section(
            "Figure 4",
            "Friction grows from step 20. The paper's filter lags and reads low; ours states when "
            "the critical level will be crossed, and how sure that is.",
            table(figure_four.HEADS, _cells(figure_four.beside(life, paper.figure4))),
            figure_four.drawn(life),
            _predicted(predicted),
        ),
        section(
            "What was reconstructed",
            "The paper states the growth in every step, the onset and when levels are crossed. "
            "The rest:",
            table(("what", "taken for it"), _cells(reconstruction.items())),
        ),
    )


def _headline(rows: Sequence[Row], kept: Sequence[Kept]) -> str:
    """The worst of both: faults that are found, and healthy runs that alarm."""
    ours = [row for row in rows if row.detector == TOGETHER and row.ratio >= SEEN]
    worst, cried = min(ours, key=lambda row: row.found), max(kept, key=lambda one: one.share)
    found, alarmed = share_of(worst.found, worst.lives), share_of(cried.share, cried.runs)
    # The worst of several kinds is also the unluckiest: hence the stricter level.
    beyond = interval(cried.share, cried.runs, 1.0 - 0.05 / len(kept))[0] > cried.promised
    return (
        f"Of faults that grow by {SEEN:g} of the noise in a step, or by more, {found} are found "
        f"before the warning level; of healthy runs {alarmed} alarm at most, where "
        f"{percent(cried.promised)} are promised{', and that is more than chance' * beyond}. In "
        f"brackets 95 % intervals, of {worst.lives} lives of faults and of {cried.runs} runs."
    )


def _cells(rows: Iterable[Sequence[str]]) -> Iterator[tuple[Html, ...]]:
    return (tuple(map(text, row)) for row in rows)


def _all(rows: Sequence[Row]) -> Html:
    head = ("fault", "growth / sigma", "detector", "found before warning (95 %)", "delay [steps]",
            "over the oracle's", "false alarms in 1000 steps")  # fmt: skip
    body = (
        (
            row.fault,
            f"{row.ratio:g}",
            row.detector,
            share_of(row.found, row.lives),
            steps_of(row.delay),
            f"{row.against_oracle:.2f}" if row.against_oracle > 0.0 else "-",
            f"{row.false_per_1000:.2g}",
        )
        for row in rows
    )
    return table(head, _cells(body))


def _by_detector(rows: Sequence[Row], value: str, y: str) -> go.Figure:
    traces = []
    for name, colour in DETECTORS.items():
        of: dict[float, list[float]] = {}
        for row in (r for r in rows if r.detector == name):
            of.setdefault(row.ratio, []).append(float(getattr(row, value)))
        ratios = sorted(of)
        means = [float(np.mean(of[ratio])) for ratio in ratios]
        traces.append(line(ratios, means, name, colour, 1.8).update(mode="lines+markers"))
    drawing = figure(traces, "growth in a step / sigma", y, 300)
    return drawing.update_xaxes(type="log", tickvals=TICKS, tickangle=0)


def _delays(rows: Sequence[Row]) -> Html:
    drawing = _by_detector(rows, "against_oracle", "delay over the oracle's").update_layout(
        shapes=[rule(y=1.25)]
    )
    return plot(
        drawing.update_yaxes(range=[0.9, 2.0]),
        "Delay",
        "dashed: 1.25 times the oracle's",
        DETECTORS,
    )


def _shares(rows: Sequence[Row]) -> Html:
    drawing = _by_detector(rows, "found", "found before the warning level")
    return plot(drawing.update_yaxes(range=[-0.03, 1.03]), "Found in time")


def _promise(kept: Sequence[Kept]) -> Html:
    names = ["<br>".join(wrap(one.noise, LINE)) for one in kept]
    share = 100.0 * np.array([one.share for one in kept])
    low, high = 100.0 * np.array([interval(one.share, one.runs) for one in kept]).T
    whiskers = {"array": high - share, "arrayminus": share - low, "thickness": 1.0}
    bars = go.Bar(x=names, y=share, marker={"color": OURS}, error_y=whiskers)
    drawing = figure([bars], "", "healthy runs with an alarm [%]", 280)
    drawing.update_layout(shapes=[rule(y=100.0 * kept[0].promised)])
    drawing.update_xaxes(automargin=True)
    return plot(drawing, "False alarms", f"dashed: the promise, {kept[0].promised:.1%}")


def forecasts(predicted: Sequence[Predicted]) -> Iterator[tuple[str, ...]]:
    """For each level of noise and age: these, steps left, median error, and coverage."""
    for one in predicted:
        covered = share_of(one.coverage, one.lives)
        yield f"{one.sigma:g}", str(one.age), f"{one.left:g}", percent(one.error), covered


def _predicted(predicted: Sequence[Predicted]) -> Html:
    head = ("sigma", "steps after the onset", "steps left", "median error",
            "90 % intervals cover (95 %)")  # fmt: skip
    return table(head, _cells(forecasts(predicted))) if predicted else paragraph("")
