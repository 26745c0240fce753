"""The self-contained page of an excitation: the motion, its limits, and what it will identify."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from urdyn.identify.excite import Excitation
from urdyn.report.canvas import figure, joint_colours, line, rule
from urdyn.report.digits import number, percent
from urdyn.report.excite.scene import scene
from urdyn.report.excite.summary import FRICTION, rating, safety
from urdyn.report.markup import (
    Html,
    cell,
    document,
    facts,
    grid,
    join,
    key,
    paragraph,
    plot,
    section,
    table,
    tag,
    text,
)  # fmt: skip
from urdyn.report.names import QUANTITIES, maker, spoken
from urdyn.report.traces import downsample
from urdyn.types import Array

DRAWN = 600  # points of a line
FIRST = (
    "Bring the arm to the first pose by hand or slowly: that way is yours to watch. Run the script "
    "at 10 % first, as it is written, with a hand on the stop button; then raise `speed` in it. At "
    "any share of its speed the path is the same, and no limit is passed."
)


def excite_page(found: Excitation, wall: float) -> str:
    """HTML of an excitation; `wall` is the time that it took to find [s]."""
    name = maker(found.arm.name)
    return document(
        f"{name} excitation",
        _headline(found, name, wall),
        scene(found),
        _motion(found),
        _spreads(found),
        section("Safety", safety(found), paragraph(FIRST)),
    )


def _headline(found: Excitation, name: str, wall: float) -> Html:
    rated, ask = rating(found), found.ask
    told = {
        "kind": ask.kind,
        "length": f"{number(ask.duration, 3)} s at {ask.rate:g} Hz",
        "condition number": number(rated.condition, 3),
        "found in": f"{number(wall)} s",
        "seed": str(ask.seed),
    }
    gained = found.expected.gained()
    halved = int((gained > 0.75).sum())
    words = (
        f"{number(ask.duration, 3)} s of motion more than halves the uncertainty of {halved} of "
        f"{int((found.expected.before > 0.0).sum())} parameters."
    )
    return join(
        [
            tag("h1", text(f"{name} · excitation")),
            paragraph(words, "headline"),
            paragraph(_interest(found), "lead"),
            facts(told),
        ]
    )


def _interest(found: Excitation) -> str:
    ask = found.ask
    what = ", ".join(ask.interest) or "everything that motion shows"
    return f"Asked for: {what}. {safety(found)}"


def _motion(found: Excitation) -> Html:
    rows, limits, names = found.trajectory, found.ask.limits, found.arm.joint_names
    assert limits is not None
    torque = found.question.point.arm.torque(rows.q, rows.v, rows.a, found.question.point.loaded())
    plots = [
        plot(_lines(found, (rows.q - limits.middle) / limits.room), "Angles", "from the middle"),
        plot(_lines(found, rows.v / limits.velocity), "Velocities"),
        plot(_lines(found, rows.a / limits.acceleration), "Accelerations"),
        plot(_lines(found, np.abs(torque) / limits.torque), "Torques", "of rigid bodies"),
    ]
    colours = {spoken(n): c for n, c in joint_colours(names).items()}
    lead = "Every joint over time; dashed, what it may not exceed."
    return section("The motion", lead, key(colours), grid(*plots, kind="two"))


def _lines(found: Excitation, share: Array) -> go.Figure:
    """Shares of the joints' limits [-] over time, and where these are."""
    traces, t, y = [], found.trajectory.t, 100.0 * share
    for j, (name, colour) in enumerate(joint_colours(found.arm.joint_names).items()):
        some = downsample(y[:, j], DRAWN)
        traces.append(line(t[some], y[some, j], spoken(name), colour))
    sides = (100.0, -100.0) if y.min() < 0.0 else (100.0,)
    return figure(traces, "time [s]", "% of the limit", shapes=[rule(y=side) for side in sides])


def _spreads(found: Excitation) -> Html:
    lead = (
        "Standard deviation of every parameter before the run and after it, as identification will "
        "compute it of this very run. Masses of single links stay wide: from a fixed base nobody "
        "can weigh one by itself."
    )
    return section("What it will tell", lead, _bars(found), _friction(found), _bodies(found))


def _bars(found: Excitation) -> Html:
    """How much of each variance is removed, by quantity and joint."""
    told, joints = found.expected, found.arm.joint_names
    gained = dict(zip(told.parameters.names, told.gained(), strict=True))
    bars = [
        go.Bar(
            x=[QUANTITIES[field] for field in FRICTION],
            y=[100.0 * gained[f"{joint}.{field}"] for field in FRICTION],
            name=spoken(joint),
            marker={"color": colour},
            hovertemplate="%{x}: %{y:.1f} %",
        )
        for joint, colour in joint_colours(joints).items()
    ]
    drawing = figure(bars, "", "variance removed [%]", 280, barmode="group", bargap=0.2)
    colours = {spoken(n): c for n, c in joint_colours(joints).items()}
    return plot(drawing, "Share of the variance that the run removes", "", colours)


def _friction(found: Excitation) -> Html:
    rows = [
        [text(spoken(joint)), *(_two(found, f"{joint}.{field}") for field in FRICTION)]
        for joint in found.arm.joint_names
    ]
    return table(["sd before → after", *(QUANTITIES[field] for field in FRICTION)], rows)


def _bodies(found: Excitation) -> Html:
    payload = ["payload_0"] if found.question.unknowns.payloads else []
    heads = ["sd before → after", "mass", "centre x", "centre y", "centre z"]
    fields = ("mass", "com_x", "com_y", "com_z")
    rows = [
        [text(spoken(body.removesuffix("_0"))), *(_two(found, f"{body}.{f}") for f in fields)]
        for body in (*found.arm.link_names, *payload)
    ]
    return table(heads, rows)


def _two(found: Excitation, name: str) -> Html:
    told = found.expected
    k = told.parameters.names.index(name)
    before, after = float(told.before[k]), float(told.after[k])
    unit = told.parameters.units[k]
    unit = "" if unit == "-" else f" {unit}"
    return cell(f"{number(before)} → {number(after)}{unit}", percent(float(told.gained()[k])))
