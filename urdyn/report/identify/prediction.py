"""Evidence for the headline: predicted beside measured current, and the residual."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import plotly.graph_objects as go

from urdyn.identify import Fit, Score
from urdyn.model.friction import RIPPLE_ORDER
from urdyn.report.canvas import AXIS, BAND, LEFT, MEASURED, OURS, SHADE, band, figure, line, shade
from urdyn.report.digits import number, percent
from urdyn.report.evidence import UNSEEN, residual, seen, speed, telling
from urdyn.report.markup import (
    Html,
    cell,
    grid,
    join,
    key,
    paragraph,
    plot,
    section,
    table,
    tag,
    text,
)
from urdyn.report.names import joints, terms, title
from urdyn.report.traces import downsample, spectrum
from urdyn.types import STANDSTILL

POINTS = 3000  # per trace
MARGIN = 0.1  # decades of a spectrum's axis beyond its ends
SHOWN = 3  # logs drawn; all are in the tables


def prediction(fit: Fit, scores: Sequence[Score]) -> Html:
    """Errors of every log, and the currents of the most telling ones."""
    drawn = sorted(scores, key=lambda score: seen(fit, score.log.source) != UNSEEN)[:SHOWN]
    rest = len(scores) - len(drawn)
    return section(
        "Measured and predicted current",
        "The prediction sees positions and velocities, never current. Drag to zoom, double-click "
        "to see all.",
        _scores(fit, scores),
        *(part for score in drawn for part in _currents(fit, score)),
        *([paragraph(f"{rest} more logs are in the table, not drawn.", "note")] if rest else []),
    )


def _scores(fit: Fit, scores: Sequence[Score]) -> Html:
    rows = [
        [
            tag(
                "span",
                text(title(score.log.source)),
                tag("small", text(seen(fit, score.log.source))),
            ),
            *(_score(score, j) for j in range(len(score.rmse))),
        ]
        for score in scores
    ]
    return table(["relative error, rmse, inside 90 % while moving", *joints(fit)], rows)


def _score(score: Score, j: int) -> Html:
    remark = f"{number(score.rmse[j])} A, {percent(score.coverage90[j])}"
    return cell(f"{number(score.rre_percent[j])} %", remark)


def _currents(fit: Fit, score: Score) -> Iterator[Html]:
    source = score.log.source
    yield tag("h3", text(f"{title(source)} · {seen(fit, source)}"))
    yield key({"measured": MEASURED, "predicted": OURS, "residual": LEFT, "90 % interval": BAND})
    plots = (
        plot(_current(score, j), name, f"{number(score.rre_percent[j])} %")
        for j, name in enumerate(joints(fit))
    )
    yield grid(*plots, kind="two")


def _current(score: Score, j: int) -> go.Figure:
    """Both currents above, their difference and its 90 % interval below."""
    t = score.log.t - score.log.t[0]
    measured, left = score.log.joint("actual_current")[:, j], residual(score)[:, j]
    half = score.half[:, j]
    m, p, r, b = (downsample(x, POINTS) for x in (measured, score.predicted[:, j], left, half))
    traces = [
        line(t[m], measured[m], "measured", MEASURED, 1.4),
        line(t[p], score.predicted[p, j], "predicted", OURS, 1.2),
        *band(t[b], -half[b], half[b], "90 % interval", yaxis="y2"),
        line(t[r], left[r], "residual", LEFT, 0.8, yaxis="y2"),
    ]
    below = AXIS | {"domain": [0.0, 0.27], "nticks": 4, "title": {"text": "error [A]"}}
    drawing = figure(traces, "time [s]", "current [A]", 290, yaxis2=below)
    drawing.update_yaxes(domain=[0.36, 1.0], selector=0)
    return drawing.update_xaxes(anchor="y2")


def spectra(fit: Fit, scores: Sequence[Score]) -> Html:
    """Spectrum of every joint's residual beside that of its current."""
    score = telling(fit, scores)[0]
    plots = (plot(_spectrum(score, j), name, _ripple(fit, j)) for j, name in enumerate(joints(fit)))
    return section(
        "What is left over",
        f"Spectrum of the measured current and of the residual, {title(score.log.source)}. Flat "
        "is sensor noise; where the curves meet, the model explains nothing; a hump in the strip "
        f"is the strain-wave gear’s ripple, {RIPPLE_ORDER:.0f} cycles per joint turn at the "
        "middle eight tenths of the speeds driven.",
        key({"measured": MEASURED, "residual": LEFT, "gear ripple falls here": SHADE}),
        grid(*plots),
    )


def _ripple(fit: Fit, j: int) -> str:
    return "ripple is in its model" if "gear ripple" in terms(fit, j) else ""


def _spectrum(score: Score, j: int) -> go.Figure:
    t = score.log.t
    f, current = spectrum(t, score.log.joint("actual_current")[:, j])
    g, left = spectrum(t, residual(score)[:, j])
    traces = [
        line(f, current, "measured", MEASURED, 1.1),
        line(g, left, "residual", LEFT, 1.3),
    ]
    drawing = figure(traces, "frequency [Hz]", "current [A/√Hz]", 210, shapes=_gear_strip(score, j))
    drawing.update_xaxes(type="log", dtick=1)
    drawing.update_yaxes(type="log", dtick=1, exponentformat="power")
    if not left.any():
        return drawing
    # Far below the residual there is only what a filter left, by many decades.
    low, high = np.log10([left[left > 0.0].min(), max(current.max(), left.max())])
    return drawing.update_yaxes(range=[low - MARGIN, high + MARGIN])


def _gear_strip(score: Score, j: int) -> list[dict[str, object]]:
    """Where the gear's ripple falls at the speeds of this log, as far as the sampling can show."""
    moving = np.abs(speed(score)[:, j])
    moving = moving[moving > STANDSTILL]
    nyquist = 0.5 / float(np.median(np.diff(score.log.t)))
    if len(moving) < 10:
        return []
    low, high = np.quantile(moving, [0.1, 0.9]) * RIPPLE_ORDER / (2.0 * np.pi)
    return [shade(low, min(high, nyquist))] if low < nyquist else []


def judged(fit: Fit, scores: Sequence[Score]) -> Html:
    """Prediction and spectra, or nothing where no log was scored."""
    return join([prediction(fit, scores), spectra(fit, scores)]) if scores else Html("")
