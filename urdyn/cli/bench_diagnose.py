"""urdyn bench diagnose: which kinds of fault are taken for which others, on a virtual arm."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer

from urdyn.cli.kinds import as_counts, broken, kinds_table, summed
from urdyn.cli.options import Json, OneRobot, Page, Quiet
from urdyn.cli.voice import Voice
from urdyn.report.bench.shares import share_of
from urdyn.report.digits import percent
from urdyn.version import __version__

if TYPE_CHECKING:
    from urdyn.bench.diagnosis_trials import Trial
    from urdyn.report.bench.confusion import Kinds

Runs = Annotated[int, typer.Option(min=1, help="Of each kind, and of each pair of kinds.")]
Seed = Annotated[int, typer.Option(min=0, help="Of the arm and of all runs.")]
Noise = Annotated[
    Literal["white", "real"],
    typer.Option(help="Of the current: white, or real, as recordings show it."),
]


def bench_diagnose(
    out: Page = None,
    runs: Runs = 6,
    robot: OneRobot = "ur10e",
    seed: Seed = 0,
    noise: Noise = "white",
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Commission a virtual arm, break it in every way, and count what is found.

    Example: [bold]urdyn bench diagnose --runs 4 --out kinds.html[/bold]
    """
    from urdyn.bench.diagnosis_trials import ALONE, PAIRS, counted, reliability
    from urdyn.cli.results import require_place

    require_place(out)
    voice = Voice(json, quiet)
    with voice.progress("commissioning") as progress:
        done = broken(robot, seed, runs, noise, (*ALONE, *PAIRS), progress)
    kinds = counted(done)
    words = summed(done, kinds)
    voice.show(kinds_table(kinds), words)
    for confidence, share, n in reliability(done):
        sure = f"of {n} findings told with {percent(confidence)} confidence"
        voice.show(f"{sure} {share_of(share, n)} are right; in brackets a 95 % interval")
    about = {"urdyn": __version__, "robot": robot, "noise": noise, "seed": seed, "runs": len(done)}
    if out is not None:
        _draw(out, about, words, kinds)
        voice.note(f"written: {out}")
    voice.result(about | as_counts(kinds) | _figures(done, kinds))


def _figures(done: list[Trial], kinds: Kinds) -> dict[str, Any]:
    """What the trials come to, for JSON."""
    from urdyn.bench.diagnosis_trials import named, reliability

    timed = [held for t in done for held in t.timed]
    delays = [t.delay for t in done if len(t.truth) == 1 and t.right and t.delay is not None]
    return {
        "findings": kinds.findings,
        "right": kinds.right,
        "named": named(done),
        "median_delay_s": float(np.median(delays)) if delays else None,
        "onsets": {"found": len(timed), "held": sum(timed)},
        "reliability": [
            {"confidence": confidence, "right": share, "findings": n}
            for confidence, share, n in reliability(done)
        ],
        "trials": [
            {"truth": t.truth, "told": t.told, "delay_s": t.delay, "hidden": t.hidden} for t in done
        ],
    }


def _draw(out: Path, about: Mapping[str, Any], summed: str, kinds: Kinds) -> None:
    from urdyn.io import write_text
    from urdyn.report.bench.confusion import told_apart
    from urdyn.report.markup import document, facts, paragraph, tag, text
    from urdyn.report.names import capital

    page = document(
        "Kinds of fault",
        tag("h1", text("Kinds of fault, told apart")),
        paragraph(f"{capital(summed)}.", "headline"),
        facts({name: str(value) for name, value in about.items()}),
        told_apart(kinds),
    )
    write_text(out, page)
