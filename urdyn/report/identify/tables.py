"""Tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from urdyn.identify import Fit, Score
from urdyn.model.drive import UNITS
from urdyn.model.friction import WORKING_SPEED
from urdyn.report.digits import interval90, number, percent
from urdyn.report.evidence import seen
from urdyn.report.identify.comparison import Comparison, Truth, compare
from urdyn.report.names import joints, robot, spoken, terms, title
from urdyn.report.terminal import terminal_table

DRIVE = {"viscous": "viscous", "rotor_inertia": "rotor", "gain": "gain"}


def identify_table(fit: Fit) -> Table:
    """Friction, drive and link mass of every joint, each ± its 90 % interval.

    Friction is of all terms, at the speed at which tracking tells it: they trade off.
    """
    drives = (f"{word}\n[{UNITS[q]}]" for q, word in DRIVE.items())
    sliding = f"friction at\n{WORKING_SPEED} rad/s\n[N·m]"
    heads = ("joint", sliding, *drives, "link mass\n[kg]", "in-\nformed", "terms")
    arm, friction, rows = fit.dynamics.arm, fit.friction(WORKING_SPEED), []
    for j, (joint, link) in enumerate(zip(arm.joint_names, arm.link_names, strict=True)):
        drive = [_estimate(fit, f"{joint}.{q}") for q in DRIVE]
        mass = f"{link}.mass"
        words = ", ".join(terms(fit, j)) or "–"
        carried = (_estimate(fit, mass), percent(fit.informed(mass)))
        slides = interval90(float(friction.mean[j]), float(friction.sd[j]))
        rows.append((spoken(joint), slides, *drive, *carried, words))
    return terminal_table(f"{robot(fit)}: estimates ± 90 %", heads, rows)


def _estimate(fit: Fit, name: str) -> str:
    return interval90(fit.value(name), fit.spread(name))


def validate_table(scores: Sequence[Score], fit: Fit) -> Table:
    """Relative error of every joint: model, controller, sensor floor; and while it moves."""
    heads = (name.replace(" ", "\n", 1) for name in joints(fit))
    table = terminal_table("relative error of predicted current [%]", ["", *heads])
    for score in scores:
        rows = {
            "this model": [number(x) for x in score.rre_percent],
            "controller": [number(x) for x in score.target_rre_percent],
            "sensor floor": [number(x) for x in score.floor_percent],
            "standing": [percent(x) for x in score.standing],
            "moving: this model": [number(x) for x in score.moving_rre_percent],
            "moving: inside 90 %": [percent(x) for x in score.coverage90],
        }
        head = f"{title(score.log.source)} ({seen(fit, score.log.source)})"
        table.add_row(Text(head, style="bold"))
        for what, values in rows.items():
            table.add_row(what, *values)
        table.add_section()
    return table


def truth_table(fit: Fit, truth: Truth) -> Table:
    """All that was estimated: truth, estimate ± 90 %, and whether they agree."""
    heads = ("", "quantity", "unit", "truth", "estimate", "z", "inside")
    rows = map(_agreement, compare(fit, truth))
    return terminal_table("truth and estimate ± 90 %", heads, rows, 3)


def _agreement(c: Comparison) -> list[str | Text]:
    return [
        spoken(c.owner),
        c.quantity.replace("_", " "),
        c.unit,
        number(c.true, 3),
        interval90(c.estimate, c.sd),
        number(c.z),
        "yes" if c.inside else Text("no", style="bold"),
    ]
