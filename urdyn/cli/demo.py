"""urdyn demo: the whole way in one go, on an arm whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from urdyn.cli.asked import typed
from urdyn.cli.campaign import Campaign
from urdyn.cli.options import Json, OneRobot, Quiet
from urdyn.cli.virtual import Simulation
from urdyn.cli.voice import Voice

if TYPE_CHECKING:
    from urdyn.cli.carry_out import Outcome

Out = Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results.")]
Seed = Annotated[int, typer.Option(min=0, help="Another seed, another arm.")]
Open = Annotated[bool, typer.Option("--open", help="Open the report in a browser.")]

PAYLOAD = 3.0  # [kg], what the smallest arms are rated for


def demo(
    out: Out = Path("urdyn-demo"),
    robot: OneRobot = "ur10e",
    seed: Seed = 1,
    show: Open = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Record a virtual arm, identify it, and compare what was found with the truth.

    Example: [bold]urdyn demo --seed 7[/bold]
    """
    from urdyn.cli.carry_out import carry_out
    from urdyn.cli.results import require_folder, save
    from urdyn.report.identify.page import identify_page
    from urdyn.report.identify.summary import identified
    from urdyn.report.identify.tables import truth_table

    voice = Voice(json, quiet)
    ask = Simulation(duration=20.0, rate=125.0, seed=seed, payload_mass=PAYLOAD)
    require_folder(out)
    with voice.progress("a virtual arm moves") as progress:
        outcome = carry_out(Campaign(robot, out=out, simulate=ask), progress)
    fit, truth = outcome.fit, outcome.truth
    assert truth is not None, "the arm is virtual"
    save(fit, identify_page(fit, outcome.scores, typed(), outcome.wall, truth), out)
    voice.show(truth_table(fit, truth), _work(ask, robot), *_found(outcome))
    voice.show(f"Report: {out / 'report.html'}")
    voice.result(identified(fit, outcome.wall))
    if show:
        typer.launch(str(out / "report.html"))


def _work(ask: Simulation, robot: str) -> str:
    """What was done, in words."""
    return (
        f"A virtual {robot}, drawn at random, moved for {ask.duration:g} s, as long with a payload "
        f"of {PAYLOAD:g} kg, and as long along another path, to judge by."
    )


def _found(outcome: Outcome) -> list[str]:
    """What was found, in words."""
    from urdyn.cli.verdict import verdict
    from urdyn.report.identify.comparison import compare

    assert outcome.truth is not None, "the arm is virtual"
    found = compare(outcome.fit, outcome.truth)
    inside = sum(c.inside for c in found)
    return [
        f"Identified in {outcome.wall:.1f} s: {inside} of {len(found)} true values lie inside "
        "their 90 % intervals (nine in ten should).",
        verdict(outcome.fit, outcome.scores),
        "Intervals of link masses stay wide: from a fixed base no link can be weighed by itself.",
    ]
