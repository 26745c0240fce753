"""What poses revealed about an arm's geometry, and about their own frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from urdyn.report.canvas import OURS
from urdyn.report.digits import MISSING, interval90
from urdyn.report.markup import Html, cell, grid, key, plot, section, table, text
from urdyn.report.names import spoken
from urdyn.report.track.history import SD, History, Series
from urdyn.report.track.trace import PALE, trend

KINEMATICS, FRAMES = "kinematics", ("base", "tool")
# Coordinate of a joint, as in [Hayati1983]_ -> head of its column.
KINDS = {"a": "a [mm]", "alpha": "α [mrad]", "beta": "β [mrad]", "d": "d [mm]", "theta": "θ [mrad]"}
COLOURS = {"mean": OURS, "90 % interval": PALE}
THOUSANDTHS = {"m": "mm", "rad": "mrad"}
OWN = (
    "Learnt from actual_TCP_pose, which the controller computes from its own encoders by its own "
    "calibration: this is how far that is from the drawing. It does not show an encoder that "
    "slips, so no joint's zero is learnt from it."
)
TRACKER = (
    "Learnt from the poses of a tracker beside the arm. They show only the sum of a joint's theta, "
    "which is constant, and of its zero, which may slip and is shown under Trends. An error of the "
    "base or the tool frame cannot be distinguished from one of the first or last joint's theta "
    "and d."
)


def holds_kinematics(history: History) -> bool:
    """Whether poses were tracked."""
    return any(name.startswith(f"{KINEMATICS}.") for name in history.names)


def kinematics(history: History) -> Html:
    """Deviations from the drawing now, base and tool, and how the belief came about."""
    found = {(s.owner, s.quantity): s for s in _series(history)}
    tracked = any(owner == f"{KINEMATICS}.base" for owner, _ in found)
    if not found:
        told = (
            "Too few poses, too much alike, or not in m, rad and the base's axes: neither the "
            "frames of base and tool nor any deviation could be estimated."
        )
        return section("Geometry", told)
    rows = [
        [text(spoken(j)), *(_now(found.get((f"{KINEMATICS}.{j}", kind))) for kind in KINDS)]
        for j in history.joints
    ]
    frames = [
        [text(frame), *(_now(found.get((f"{KINEMATICS}.{frame}", axis))) for axis in "xyz")]
        for frame in FRAMES
        if (f"{KINEMATICS}.{frame}", "x") in found
    ]
    return section(
        "Geometry",
        f"{TRACKER if tracked else OWN} Deviations from the drawing; ± holds 90 %.",
        table(["joint", *KINDS.values()], rows),
        table(["frame at", "x [mm]", "y [mm]", "z [mm]"], frames),
        key(COLOURS),
        grid(*(_plot(found[name], history) for name in found if name[1] in KINDS)),
    )


def _series(history: History) -> Iterator[Series]:
    """All quantities that only poses determine, in thousandths."""
    for name in history.names:
        told = name.startswith(f"{KINEMATICS}.") and name + SD in history.names
        if told and np.isfinite(history.column(name)).any():
            s = history.series(*name.rsplit(".", 1))
            yield replace(s, unit=THOUSANDTHS[s.unit], mean=1e3 * s.mean, sd=1e3 * s.sd)


def _now(series: Series | None) -> Html:
    if series is None:
        return cell(MISSING)
    return cell(interval90(float(series.mean[-1]), float(series.sd[-1])))


def _plot(series: Series, history: History) -> Html:
    joint = spoken(series.owner.removeprefix(f"{KINEMATICS}."))
    return plot(trend(series, history.clock), f"{joint} {series.quantity}")
