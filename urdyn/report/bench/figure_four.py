"""The paper's Figure 4: growing friction, the belief about it, and when it will matter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.io.plain import jsonable
from urdyn.report.canvas import MEASURED, OURS, TRUTH, band, figure, line, rule
from urdyn.report.digits import MISSING
from urdyn.report.markup import Html, grid, plot
from urdyn.types import Array

NEVER = 1e4  # [step] where a crossing that may never come is drawn, far above the axis
HEADS = ("who", "alarm at step", "after the onset", "reads low by", "critical level in [steps]")


@dataclass(frozen=True, eq=False)
class Foreseen:
    """One life, the belief about it, and when levels were expected to be crossed."""

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

    def low_by(self, estimate: Array, late: int) -> float:
        """Mean of truth less estimate, from `late` steps after the onset on."""
        return float(np.mean((self.truth - estimate)[self.t > self.onset + late]))

    def left(self, step: int) -> Array:
        """Median and limits of the [steps] left to the critical level at this step, (3,)."""
        return np.asarray(self.crossing[np.searchsorted(self.t, step)] - step)


@dataclass(frozen=True)
class Told:
    """What the paper states about its own figure."""

    alarm: int  # [step]
    late: int  # [steps] of the estimate, after the onset
    low: float  # by which the estimate stays below the truth
    at: int  # [step] at which it forecasts
    ahead: int  # [steps] before the critical level


def beside(life: Foreseen, paper: Told) -> Iterator[tuple[str, ...]]:
    """Cells under `HEADS`: the paper's, its filter as reconstructed, and ours."""
    theirs = (str(paper.alarm), str(paper.alarm - life.onset), f"{paper.low:g}")
    yield "the paper", *theirs, f"{paper.ahead}, said at {paper.at}"
    yield "its filter", MISSING, MISSING, f"{life.low_by(life.paper, paper.late):.3f}", MISSING
    alarm = life.alarm
    when = (MISSING, MISSING) if alarm is None else (str(alarm), str(alarm - life.onset))
    low = f"{life.low_by(life.ours[:, 0], paper.late):.3f}"
    median, lo, hi = (f"{x:.1f}" if np.isfinite(x) else "no end" for x in life.left(paper.at))
    yield "urdyn", *when, low, f"{median} ({lo} to {hi}), said at {paper.at}"


def figures(life: Foreseen, paper: Told) -> dict[str, Any]:
    """All of it in plain numbers; null: never, or none."""
    columns = {"median": 0, "lo": 1, "hi": 2}
    left = life.left(paper.at)
    return {
        "sigma": life.sigma,
        "onset": life.onset,
        "warning": life.warning,
        "critical": life.critical,
        "paper": {"alarm": paper.alarm, "low_by": paper.low}
        | {"at": paper.at, "critical_in": paper.ahead},
        "paper_filter": {"low_by": life.low_by(life.paper, paper.late)},
        "urdyn": {"alarm": life.alarm, "low_by": life.low_by(life.ours[:, 0], paper.late)}
        | {"at": paper.at, "critical_in": {name: jsonable(left[k]) for name, k in columns.items()}},
        "series": {"t": life.t.tolist(), "truth": life.truth.tolist()}
        | {"paper_filter": life.paper.tolist()}
        | {name: jsonable(life.ours[:, k]) for name, k in columns.items()}
        | {"crossing": {n: jsonable(life.crossing[:, k]) for n, k in columns.items()}},
    }


def drawn(life: Foreseen) -> Html:
    """The belief about friction, and when it is expected to be critical."""
    return grid(_life(life), _crossing(life), kind="two")


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
