"""Tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from urdyn.identify import Fit, Score
from urdyn.model.drive import UNITS
from urdyn.report.digits import interval90, number, percent
from urdyn.report.evidence import seen
from urdyn.report.identify.comparison import Comparison, Truth, compare
from urdyn.report.names import TERMS, joints, robot, spoken, terms, title
from urdyn.report.terminal import terminal_table

DRIVE = {"coulomb": "Coulomb", "viscous": "viscous", "rotor_inertia": "rotor", "gain": "gain"}
TRUTHS = (*DRIVE, "structural", "offset", "mass")


def identify_table(fit: Fit) -> Table:
    """Friction and mass of every joint and the link that it moves, each ± its 90 % interval."""
    heads = [f"{word}\n[{UNITS[q]}]" for q, word in DRIVE.items()]
    columns = ["joint", *heads, "link mass\n[kg]", "in-\nformed", "terms"]
    arm, rows = fit.dynamics.arm, []
    for j, (joint, link) in enumerate(zip(arm.joint_names, arm.link_names, strict=True)):
        drive = [_estimate(fit, f"{joint}.{q}") for q in DRIVE]
        mass = f"{link}.mass"
        words = ", ".join(terms(fit, j)) or "–"
        if "stribeck" in fit.terms[j]:
            words = words.replace(TERMS["stribeck"], _stribeck(fit, joint))
        carried = (_estimate(fit, mass), percent(fit.informed(mass)))
        rows.append((spoken(joint), *drive, *carried, words))
    return terminal_table(f"{robot(fit)}: estimates ± 90 %", columns, rows)


def _stribeck(fit: Fit, joint: str) -> str:
    """The friction added at rest, and the velocity at which most of it is gone."""
    size, speed = fit.value(f"{joint}.stribeck"), fit.value(f"{joint}.stribeck_velocity")
    units = UNITS["stribeck"], UNITS["stribeck_velocity"]
    return f"{TERMS['stribeck']} {number(size)} {units[0]}, {number(speed)} {units[1]}"


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
    """Joint friction and link masses: truth, estimate ± 90 %, and whether they agree."""
    heads = ("", "quantity", "unit", "truth", "estimate", "z", "inside")
    rows = (_agreement(c) for c in compare(fit, truth) if c.quantity in TRUTHS)
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
