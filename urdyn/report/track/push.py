"""A push's effect on the currents of the joints that felt it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from urdyn.report.canvas import JOINTS, figure, line, rule, shade
from urdyn.report.finding_words import direction, kind
from urdyn.report.markup import Html, plot
from urdyn.report.names import spoken
from urdyn.report.track.history import History
from urdyn.types import Array, Mask

AROUND = 2.0  # [s] that are drawn before a push and after it
FELT = 0.1  # [-] of a push's largest torque, below which a joint is not drawn


def drawn_push(finding: Mapping[str, Any], history: History) -> Html:
    """A plot of the currents around a push, of every joint that felt it."""
    clock, evidence = history.clock, finding["evidence"]
    begin = finding["onset_s"] - history.start
    end = begin + evidence["duration_s"]
    near = (history.t > begin - AROUND) & (history.t < end + AROUND)
    t = history.t[near]
    torque = np.nan_to_num(np.abs(np.array(evidence["torque_Nm"], float)))  # null: no data
    most = np.flatnonzero(torque > FELT * torque.max())
    felt = {history.joints[j]: JOINTS[j % len(JOINTS)] for j in most}
    traces = [
        line(t / clock.seconds, _beyond(history, joint, near, t < begin), spoken(joint), colour)
        for joint, colour in felt.items()
    ]
    shapes = [shade(begin / clock.seconds, end / clock.seconds, "push"), rule(y=0.0)]
    drawing = figure(traces, clock.axis, "current beyond expected [A]", 220, shapes=shapes)
    title = f"{spoken(finding['name'])}: {kind(finding)}"
    colours = {spoken(joint): colour for joint, colour in felt.items()}
    note = f"{direction(evidence)}; expected: as predicted, or as before"
    return plot(drawing, title, note, colours)


def _beyond(history: History, joint: str, near: Mask, before: Mask) -> Array:
    """Current less the prediction, (N,) [A]; for a joint at rest, less its value before."""
    current, predicted = (column[near] for column in history.currents(joint))
    left = current - predicted
    if np.isfinite(left).mean() > 0.5:
        return left
    calm = current[before & np.isfinite(current)]
    return current - np.median(calm) if len(calm) else current
