"""The joints' losses: friction against speed, and every coefficient of the drives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from urdyn.identify import Fit, Score
from urdyn.identify.select import MIN_EVIDENCE
from urdyn.model.drive import UNITS
from urdyn.model.friction import WORKING_SPEED
from urdyn.report.canvas import BAND, MEASURED, OURS, SHADE, TRUTH, band, dots, figure, line, shade
from urdyn.report.digits import interval90, number, percent
from urdyn.report.evidence import residual, speed
from urdyn.report.identify.comparison import Truth
from urdyn.report.identify.friction_curve import friction, friction_curve
from urdyn.report.markup import Html, cell, grid, key, paragraph, plot, section, table, text
from urdyn.report.names import QUANTITIES, joints, shown, terms

SAMPLES = 700  # dots per plot
UNSEEN_MARGIN = 1.25  # [-] how far beyond the visited speeds the curve is drawn
AT_REST = 0.6  # [rad/s] to draw to where a joint was never seen to move
GRID = np.concatenate([np.linspace(0.0, 0.1, 40)[1:], np.linspace(0.1, 1.0, 60)[1:]])
KEY = {"estimate": OURS, "90 % band": BAND, "measured": MEASURED, "never visited": SHADE}


def friction_section(fit: Fit, scores: Sequence[Score], truth: Truth | None) -> Html:
    """Curves, coefficients, and why each joint's model has the terms that it has."""
    rng = np.random.default_rng(0)  # the same page from the same fit
    plots = (
        plot(_curve(fit, scores, j, rng, truth), name, ", ".join(terms(fit, j)))
        for j, name in enumerate(joints(fit))
    )
    return section(
        "Friction and drives",
        "Torque that a joint loses when sliding without load, with its 90 % band; under load the "
        "gear loses β of the transmitted torque besides. Dots are measured: the curve plus what "
        "the model leaves over, as torque. Speeds that no log visited are shaded.",
        key(KEY | ({"truth": TRUTH} if truth else {})),
        grid(*plots),
        _coefficients(fit),
        paragraph(_why(), "note"),
        paragraph(_warmth(fit), "note"),
    )


def _why() -> str:
    odds = round(np.exp(MIN_EVIDENCE), -1)
    return (
        "Values ± 90 % interval; small: prior, and the share of its variance that the data "
        "removed. Stribeck, gear ripple and thermal terms are in a joint’s model only if they "
        f"make the data {odds:.0f} times likelier, and predict current held out of the fit. "
        "Friction as a whole is known better than its terms, which trade off; where g is negative, "
        "friction builds up with speed."
    )


def _warmth(fit: Fit) -> str:
    """The joint temperatures at which this friction holds."""
    known = fit.dynamics.drive.temperature[np.isfinite(fit.dynamics.drive.temperature)]
    if not len(known):
        return (
            "The logs contain no joint temperatures. Viscous friction falls while joints warm up: "
            "with temperatures in the logs, tracking could tell that from wear."
        )
    low, high = (f"{x:.0f}" for x in (known.min(), known.max()))
    span = low if low == high else f"{low} to {high}"
    return f"Viscous friction is that of joints at {span} °C, the mean of the logs."


def _visited(scores: Sequence[Score], j: int) -> tuple[float, float]:
    """Lowest and highest speed of a joint, but for a few samples [rad/s]."""
    v = np.concatenate([speed(score)[:, j] for score in scores]) if scores else np.zeros(1)
    low, high = np.nanquantile(v, [0.002, 0.998])
    return float(low), float(high)


def _curve(
    fit: Fit, scores: Sequence[Score], j: int, rng: np.random.Generator, truth: Truth | None
) -> go.Figure:
    low, high = _visited(scores, j)
    end = max(UNSEEN_MARGIN * max(high, -low), 0.05) if high > low else AT_REST
    # Zero speed twice, once from either side: friction jumps there.
    v = end * np.concatenate([-GRID[::-1], [-1e-9, 1e-9], GRID])
    curve = friction_curve(fit, j, v, rng)
    traces = [
        *_samples(fit, scores, j),
        *band(v, curve.low, curve.high, "90 % band"),
        line(v, curve.torque, "estimate", OURS, 1.8),
        *(
            [line(v, friction(truth["joints"][j], v), "truth", TRUTH, 1.5, dash="dash")]
            if truth
            else []
        ),
    ]
    shapes = [shade(-end, max(low, -end)), shade(min(high, end), end)]
    drawing = figure(traces, "speed [rad/s]", "friction [N·m]", 230, shapes=shapes)
    return drawing.update_xaxes(range=[-end, end])


def _samples(fit: Fit, scores: Sequence[Score], j: int) -> list[go.Scatter]:
    """Measured friction: the curve at the joint's speed plus the residual, as torque."""
    if not scores:
        return []
    v = np.concatenate([speed(score)[:, j] for score in scores])
    left = np.concatenate([residual(score)[:, j] for score in scores])
    some = np.linspace(0, len(v) - 1, min(SAMPLES, len(v))).astype(int)
    drive = fit.dynamics.drive
    terms = {name: getattr(drive, name)[j] for name in UNITS}
    torque = friction(terms, v[some]) + drive.gain[j] * drive.health[j] * left[some]
    style = {"opacity": 0.45}
    return [dots(v[some], torque, "measured", MEASURED, 3, marker=style, hoverinfo="skip")]


def _coefficients(fit: Fit) -> Html:
    names, whole = fit.dynamics.arm.joint_names, fit.friction(WORKING_SPEED)
    slides = map(interval90, whole.mean.tolist(), whole.sd.tolist())
    rows = [
        [cell(label, shown(q, UNITS[q])[1]), *(_coefficient(fit, joint, q) for joint in names)]
        for q, label in QUANTITIES.items()
        if q == "gain" or any(fit.spread(f"{joint}.{q}") for joint in names)
    ]
    first = [cell(f"friction at {WORKING_SPEED} rad/s", "N·m"), *map(text, slides)]
    return table(["", *joints(fit)], [first, *rows])


def _coefficient(fit: Fit, joint: str, quantity: str) -> Html:
    """Estimate over prior; a dash where the joint's model has no such term."""
    name = f"{joint}.{quantity}"
    at, (factor, _) = fit.parameters.names.index(name), shown(quantity, UNITS[quantity])
    value, sd = factor * fit.value(name), factor * fit.spread(name)
    if not sd:
        return cell(number(value, 4), "given") if quantity == "gain" else text("–")
    prior = interval90(factor * fit.prior[at], factor * fit.prior_sd[at])
    return cell(interval90(value, sd), f"{prior} · {percent(fit.informed(name))}")
