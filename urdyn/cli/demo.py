"""urdyn demo: the whole way in one go, on an arm whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from urdyn.cli.campaign import Campaign
from urdyn.cli.options import Json, Quiet
from urdyn.cli.virtual import Simulation
from urdyn.cli.voice import Voice

if TYPE_CHECKING:
    from urdyn.cli.results import Outcome

Out = Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results.")]
Seed = Annotated[int, typer.Option(min=0, help="Another seed, another arm.")]
Arm = Annotated[str, typer.Option("--robot", help="Arm type, or a URDF file.")]
Open = Annotated[bool, typer.Option("--open", help="Open the report in a browser.")]

PAYLOAD = 3.0  # [kg], what the smallest arms are rated for


def demo(
    out: Out = Path("urdyn-demo"),
    robot: Arm = "ur10e",
    seed: Seed = 1,
    show: Open = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Record a virtual arm, identify it, and compare what was found with the truth.

    Example: [bold]urdyn demo --seed 7[/bold]
    """
    from urdyn.cli.results import carry_out, save
    from urdyn.report.page import identify_page
    from urdyn.report.summary import identified
    from urdyn.report.tables import truth_table

    voice = Voice(json, quiet)
    ask = Simulation(duration=20.0, rate=125.0, seed=seed, payload_mass=PAYLOAD)
    voice.note(
        f"a virtual {robot} moves for {ask.duration:g} s without and with a payload of {PAYLOAD:g} "
        f"kg, then along another path to be judged by"
    )
    outcome = carry_out(Campaign(robot, out=out, simulate=ask), voice)
    fit, truth = outcome.fit, outcome.truth
    assert truth is not None, "the arm is virtual"
    save(fit, identify_page(fit, outcome.scores, outcome.wall, truth), out)
    voice.show(truth_table(fit, truth), *_found(outcome), f"the report: {out / 'report.html'}")
    voice.result(identified(fit, outcome.wall))
    if show:
        typer.launch(str(out / "report.html"))


def _found(outcome: Outcome) -> list[str]:
    """What was found, in plain words."""
    from urdyn.report.comparison import compare

    assert outcome.truth is not None, "the arm is virtual"
    found, held_out = compare(outcome.fit, outcome.truth), outcome.scores[-1]
    inside = sum(c.inside for c in found)
    low, high = held_out.rre_percent.min(), held_out.rre_percent.max()
    least, most = held_out.floor_percent.min(), held_out.floor_percent.max()
    return [
        f"identified in {outcome.wall:.1f} s; {inside} of {len(found)} true values lie inside "
        "their 90 % intervals (nine in ten should)",
        f"on the path that it has not seen, the model misses {low:.1f} to {high:.1f} % of the "
        f"current, joint by joint; sensor noise alone is {least:.1f} to {most:.1f} %",
        "no single link can be weighed from a fixed base: where masses are uncertain, the data "
        "cannot tell them, but what the joints feel of them is known",
    ]
