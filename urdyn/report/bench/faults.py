"""The page of `urdyn bench faults`: what is promised, what is found, and when it will matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

import numpy as np
import plotly.graph_objects as go

from urdyn.report.bench.shares import interval, share_of
from urdyn.report.canvas import CONTROLLER, JOINTS, MEASURED, OURS, TRUTH, band, figure, line, rule
from urdyn.report.digits import percent
from urdyn.report.markup import Html, document, grid, paragraph, plot, section, table, tag, text
from urdyn.types import Array

DETECTORS = {
    "Shiryaev-Roberts": OURS,
    "Shiryaev-Roberts, six joints": JOINTS[4],
    "CUSUM": JOINTS[2],
    "GLR": JOINTS[3],
    "Algorithm 2, tuned": CONTROLLER,
    "Algorithm 2, as in the paper": TRUTH,
    "oracle CUSUM": MEASURED,
}


TOGETHER = "Shiryaev-Roberts, six joints"
SEEN = 0.05  # growth over sigma from which on faults are to be found in time
NEVER = 1e4  # [step] where a crossing that may never come is drawn, far above the axis
LINE = 14  # characters of a name below a bar
TICKS = (0.01, 0.025, 0.05, 0.1, 0.25, 0.5)  # growth over sigma


@dataclass(frozen=True)
class Row:
    """One detector on one fault at one level of noise."""

    fault: str  # "friction increase" or "health degradation"
    sigma: float  # [unit]
    ratio: float  # [-] growth in one step over sigma
    detector: str
    found: float  # share of lives, before the true parameter crosses the warning level
    delay: float  # [steps] from onset to alarm, mean; NaN where less than half are ever found
    against_oracle: float  # [-] delay over the oracle's
    false_per_1000: float  # alarms in 1000 healthy steps
    lives: int  # of which `found` is a share: those without an alarm before the onset


@dataclass(frozen=True)
class Kept:
    """How a promise fares on healthy data of some kind."""

    noise: str
    share: float  # of healthy runs with an alarm
    promised: float
    runs: int


@dataclass(frozen=True, eq=False)
class Foreseen:
    """Figure 4: one life, what was believed of it, and when levels were expected to be crossed."""

    t: Array  # (N,) [step]
    truth: Array  # (N,)
    paper: Array  # (N,) estimate by the paper's filter
    ours: Array  # (N, 3) median and limits
    crossing: Array  # (N, 3) [step] median and limits of when the critical level will be crossed
    warning: float
    critical: float
    onset: int  # [step]
    alarm: int | None  # [step] of ours
    sigma: float


@dataclass(frozen=True)
class Predicted:
    """Forecasts of the critical crossing, over many lives."""

    sigma: float
    age: int  # [steps] after the onset
    left: float  # [steps] to the crossing in truth
    error: float  # [-] median of |median - truth| / what is left
    coverage: float  # of 90 % intervals
    lives: int


def fault_page(
    rows: Sequence[Row],
    kept: Sequence[Kept],
    figure4: Foreseen,
    predicted: Sequence[Predicted],
    paper: Mapping[str, tuple[float, float, float]],
    reconstruction: Mapping[str, str],
) -> str:
    """HTML of the bench; `paper` holds detection rate, false alarms and latency of Table III."""
    return document(
        "Faults found",
        tag("h1", text("Faults found, beside the paper's")),
        paragraph(_headline(rows, kept), "headline"),
        section(
            "Table III",
            "The paper's rates beside ours. A fault counts as found when the alarm comes after its "
            "onset and before the true parameter crosses the warning level, 40 steps later. Ours "
            "watches all six joints, with one promise for all.",
            _beside(rows, paper),
        ),
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
            grid(_life(figure4), _crossing(figure4), kind="two"),
            _predicted(predicted),
        ),
        section(
            "What was reconstructed",
            "The paper states the growth in every step, the onset and when levels are crossed. "
            "The rest:",
            table(
                ("what", "taken for it"), ((text(k), text(v)) for k, v in reconstruction.items())
            ),
        ),
    )


def _headline(rows: Sequence[Row], kept: Sequence[Kept]) -> str:
    """The worst of both: faults that are found, and healthy runs that alarm."""
    ours = [row for row in rows if row.detector == TOGETHER and row.ratio >= SEEN]
    worst, cried = min(ours, key=lambda row: row.found), max(kept, key=lambda one: one.share)
    found, alarmed = share_of(worst.found, worst.lives), share_of(cried.share, cried.runs)
    # Of several kinds the worst is one that had bad luck.
    beyond = interval(cried.share, cried.runs, 1.0 - 0.05 / len(kept))[0] > cried.promised
    return (
        f"Of faults that grow by {SEEN:g} of the noise in a step, or by more, {found} are found "
        f"before the warning level; of healthy runs {alarmed} alarm at most, where "
        f"{percent(cried.promised)} are promised{', and that is more than chance' * beyond}. In "
        f"brackets 95 % intervals, of {worst.lives} lives of faults and of {cried.runs} runs."
    )


def _beside(rows: Sequence[Row], paper: Mapping[str, tuple[float, float, float]]) -> Html:
    head = ("fault", "who", "sigma", "growth / sigma", "found (95 %)", "false alarms",
            "delay [steps]")  # fmt: skip
    body: list[tuple[Html, ...]] = []
    for fault, (found, false, latency) in paper.items():
        told = ("the paper", "not told", "-", f"{found:.0%}", f"{false:.0%} FP rate")
        body.append((text(fault), *map(text, told), text(f"{latency:g}")))
        ours = (r for r in rows if r.fault == fault and r.detector == TOGETHER)
        body += [(text(fault), *map(text, _ours(row))) for row in ours]
    return table(head, body)


def _ours(row: Row) -> tuple[str, ...]:
    false = f"{row.false_per_1000:.2g} in 1000 steps"
    return (
        "urdyn",
        f"{row.sigma:g}",
        f"{row.ratio:g}",
        share_of(row.found, row.lives),
        false,
        _steps(row.delay),
    )


def _all(rows: Sequence[Row]) -> Html:
    head = ("fault", "growth / sigma", "detector", "found before warning (95 %)", "delay [steps]",
            "over the oracle's", "false alarms in 1000 steps")  # fmt: skip
    body = (
        tuple(
            map(
                text,
                (
                    row.fault,
                    f"{row.ratio:g}",
                    row.detector,
                    share_of(row.found, row.lives),
                    _steps(row.delay),
                    f"{row.against_oracle:.2f}" if row.against_oracle > 0.0 else "-",
                    f"{row.false_per_1000:.2g}",
                ),
            )
        )
        for row in rows
    )
    return table(head, body)


def _steps(delay: float) -> str:
    return f"{delay:.1f}" if delay > 0.0 else "-"


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


def _life(life: Foreseen) -> Html:
    low, high = band(life.t, life.ours[:, 1], life.ours[:, 2], "90 % interval")
    traces = [
        low,
        high,
        line(life.t, life.truth, "truth", TRUTH, 2.0),
        line(life.t, life.paper, "the paper's filter", MEASURED, 1.6),
        line(life.t, life.ours[:, 0], "ours", OURS, 2.0),
    ]
    shapes = [rule(y=life.warning), rule(y=life.critical)]
    if life.alarm is not None:
        shapes.append(rule(x=life.alarm))
    drawing = figure(traces, "step", "friction [A s/rad]", 320, shapes=shapes)
    colours = {"truth": TRUTH, "the paper's filter": MEASURED, "ours": OURS}
    alarm = f", and our alarm at step {life.alarm}" if life.alarm is not None else ""
    return plot(
        drawing,
        "Friction",
        f"sigma {life.sigma:g}; dashed: warning, critical level{alarm}",
        colours,
    )


def _crossing(life: Foreseen) -> Html:
    from_alarm = life.t >= (life.alarm if life.alarm is not None else life.onset)
    t, at = life.t[from_alarm], np.minimum(life.crossing[from_alarm], NEVER)
    low, high = band(t, at[:, 1], at[:, 2], "90 % interval")
    true = life.t[life.truth >= life.critical - 1e-9]
    drawing = figure(
        [low, high, line(t, at[:, 0], "median", OURS, 2.0)],
        "step at which the forecast is made",
        "critical level crossed at step",
        320,
        shapes=[rule(y=float(true[0]))] if len(true) else [],
    )
    return plot(drawing.update_yaxes(range=[40, 160]), "Forecast", "dashed: when it really is")


def _predicted(predicted: Sequence[Predicted]) -> Html:
    head = ("sigma", "steps after the onset", "steps left", "median error",
            "90 % intervals cover (95 %)")  # fmt: skip
    body = (
        tuple(
            map(
                text,
                (
                    f"{p.sigma:g}",
                    p.age,
                    f"{p.left:g}",
                    percent(p.error),
                    share_of(p.coverage, p.lives),
                ),
            )
        )
        for p in predicted
    )
    return table(head, body) if predicted else paragraph("")
