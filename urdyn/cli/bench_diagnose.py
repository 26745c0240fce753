"""urdyn bench diagnose: which kinds of fault are taken for which others, on a virtual arm."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice
from urdyn.errors import InputError
from urdyn.report.bench.shares import share_of
from urdyn.report.digits import percent
from urdyn.version import __version__

if TYPE_CHECKING:
    from urdyn.cli.diagnosis_trials import Trial

Out = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw it to an HTML page.")]
Runs = Annotated[int, typer.Option(min=1, help="Of each kind, and of each pair of kinds.")]
Seed = Annotated[int, typer.Option(min=0, help="Of the arm and of all runs.")]
Noise = Annotated[
    str, typer.Option(metavar="KIND", help="Of the current: white, or real, as recordings show it.")
]
RobotName = Annotated[str, typer.Option("--robot", help="Arm type.")]


def bench_diagnose(
    out: Out = None,
    runs: Runs = 6,
    robot: RobotName = "ur10e",
    seed: Seed = 0,
    noise: Noise = "white",
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Commission a virtual arm, break it in every way, and count what is told.

    Example: [bold]urdyn bench diagnose --runs 4 --out kinds.html[/bold]
    """
    if out is not None and not out.resolve().parent.is_dir():
        raise InputError(f"{out}: cannot be written: its folder does not exist")
    from urdyn.cli.diagnosis_trials import counted

    voice = Voice(json, quiet)
    done = _broken(robot, seed, runs, noise, voice)
    counts, truth, told = counted(done)
    _show(voice, done, counts, truth, told)
    about = {"urdyn": __version__, "robot": robot, "noise": noise, "seed": seed, "runs": len(done)}
    if out is not None:
        _draw(out, about, done, counts, truth, told)
        voice.note(f"written: {out}")
    table = {"truth": truth, "told": told, "counts": counts.tolist()}
    voice.result(about | table | _figures(done, counts))


def _broken(robot: str, seed: int, runs: int, noise: str, voice: Voice) -> list[Trial]:
    """A virtual arm that was broken in every way, so often."""
    from threadpoolctl import threadpool_limits

    from urdyn.bench.truth import SENSORS
    from urdyn.cli.diagnosis_trials import FAULTS, PAIRS, commissioned, trials
    from urdyn.model.arm import load_arm

    if noise not in SENSORS:
        raise InputError(f"--noise {noise!r}: is one of {', '.join(SENSORS)}")
    sensors = SENSORS[noise](load_arm(robot))
    done: list[Trial] = []
    total = runs * (1 + len(FAULTS) + len(PAIRS))
    with voice.progress("commissioning") as told, threadpool_limits(1):
        dynamics, fit = commissioned(robot, seed, sensors)
        for trial in trials(dynamics, fit, sensors, runs, seed):
            done.append(trial)
            told("breaking the arm", len(done) / total)
    return done


def _show(
    voice: Voice, done: list[Trial], counts: np.ndarray, truth: list[str], told: list[str]
) -> None:
    from urdyn.cli.diagnosis_trials import reliability

    voice.show(_table(counts, truth, told))
    voice.show(_summed(done, counts))
    for confidence, share, n in reliability(done):
        sure = f"of {n} findings told with {percent(confidence)} confidence"
        voice.show(f"{sure} {share_of(share, n)} are right; in brackets a 95 % interval")


def _summed(done: list[Trial], counts: np.ndarray) -> str:
    right, findings = _right(counts)
    return f"kind and joint right in {right} of {findings} findings; {_missed(done)}"


def _right(counts: np.ndarray) -> tuple[int, int]:
    """Findings that had the right kind and joint, and all."""
    kinds = len(counts) - 1
    return int(np.trace(counts[:kinds, :kinds])), int(counts[:, :-1].sum())


def _figures(done: list[Trial], counts: np.ndarray) -> dict[str, Any]:
    """What the trials come to, for JSON."""
    from urdyn.cli.diagnosis_trials import named, reliability

    right, findings = _right(counts)
    delays = [t.delay for t in done if len(t.truth) == 1 and t.right and t.delay is not None]
    return {
        "findings": findings,
        "right": right,
        "named": named(done),
        "median_delay_s": float(np.median(delays)) if delays else None,
        "reliability": [
            {"confidence": confidence, "right": share, "findings": n}
            for confidence, share, n in reliability(done)
        ],
        "trials": [
            {"truth": t.truth, "told": t.told, "delay_s": t.delay, "hidden": t.hidden} for t in done
        ],
    }


def _missed(done: list[Trial]) -> str:
    broken = sum(len(t.truth) for t in done)
    found = sum(len(set(t.truth) & set(t.told)) for t in done)
    healthy = [t for t in done if not t.truth]
    cried = sum(bool(t.told) for t in healthy)
    hidden = sum(len(set(t.hidden) - set(t.told)) for t in done)
    unseen = f" ({hidden} of the others do not show in their motion)" if hidden else ""
    return f"{found} of {broken} faults found{unseen}; {cried} of {len(healthy)} healthy runs alarm"


def _table(counts: np.ndarray, truth: list[str], told: list[str]) -> Table:
    table = Table("truth")
    for name in told:
        table.add_column(name.replace("_", " "), justify="right")
    for name, row in zip(truth, counts, strict=True):
        table.add_row(name.replace("_", " "), *(str(n) if n else "" for n in row))
    return table


def _draw(
    out: Path,
    about: Mapping[str, Any],
    done: list[Trial],
    counts: np.ndarray,
    truth: list[str],
    told: list[str],
) -> None:
    from urdyn.io import write_text
    from urdyn.report.bench.confusion import confusion
    from urdyn.report.markup import document, facts, paragraph, plot, section, tag, text
    from urdyn.report.names import capital

    names = [[name.replace("_", " ") for name in row] for row in (truth, told)]
    lead = "Rows are what was wrong with a virtual arm, columns what was told of it."
    page = document(
        "Kinds of fault",
        tag("h1", text("Kinds of fault, told apart")),
        paragraph(f"{capital(_summed(done, counts))}.", "headline"),
        facts({name: str(value) for name, value in about.items()}),
        section("What was told", lead, plot(confusion(counts, *names), "counts", "")),
    )
    write_text(out, page)
