"""urdyn bench faults: the paper's Table III and Figure 4 beside what urdyn finds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice
from urdyn.errors import InputError
from urdyn.report.bench.shares import share_of
from urdyn.report.digits import percent
from urdyn.version import __version__

if TYPE_CHECKING:
    from urdyn.report.bench.faults import Kept, Predicted, Row

FEWEST = 12  # lives, from which the oracle's threshold is told

Out = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw it to an HTML page.")]
Lives = Annotated[int, typer.Option(min=FEWEST, help="Of each fault at each level of noise.")]
Seed = Annotated[int, typer.Option(min=0, help="Of the random lives.")]


def bench_faults(
    out: Out = None, lives: Lives = 600, seed: Seed = 0, json: Json = False, quiet: Quiet = False
) -> None:
    """Find the paper's faults in many simulated lives: rates, delays, false alarms, forecasts.

    Example: [bold]urdyn bench faults --lives 120 --out faults.html[/bold]
    """
    if out is not None and not out.resolve().parent.is_dir():
        raise InputError(f"{out}: cannot be written: its folder does not exist")
    from threadpoolctl import threadpool_limits

    from urdyn.bench import FAULTS
    from urdyn.cli import fault_trials
    from urdyn.io import write_text
    from urdyn.report.bench.faults import fault_page
    from urdyn.simulate.paper import FRICTION_INCREASE, JOINTS, reconstruction

    theirs = {f.name: (f.found, f.false, f.steps) for f in FAULTS if f.name in fault_trials.FAULTS}
    voice, trials = Voice(json, quiet), fault_trials.Trials(lives - lives % JOINTS, seed)
    with voice.progress("finding faults") as told, threadpool_limits(1):
        rows = list(fault_trials.rated(trials))
        told("healthy data of all kinds", 0.5)
        kept = list(fault_trials.kept(trials.runs, seed))
        told("forecasts", 0.8)
        predicted = list(fault_trials.predicted(trials))
        drawn = fault_trials.figure4(seed)
    voice.show(_rates(rows, theirs), _promises(kept), _forecasts(predicted))
    if out is not None:
        taken = reconstruction(replace(FRICTION_INCREASE, motion="steady"))
        write_text(out, fault_page(rows, kept, drawn, predicted, theirs, taken))
        voice.note(f"written: {out}")
    voice.result(
        {
            "urdyn": __version__,
            "lives": trials.runs,
            "promise_steps": fault_trials.PROMISE,
            "faults": [_numbers(row) for row in rows],
            "promise": [_numbers(one) for one in kept],
            "forecasts": [_numbers(one) for one in predicted],
        }
    )


def _numbers(row: Any) -> dict[str, Any]:
    """Fields of a row; what has no value is null."""
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in asdict(row).items()
    }


def _rates(rows: Sequence[Row], theirs: Mapping[str, tuple[float, float, float]]) -> Table:
    table = Table(title="before the warning level, at a promise of 1 false alarm in 10,000 steps")
    heads = (
        "fault", "growth/sigma", "detector", "found (95 %)", "delay", "x oracle", "false/1000",
    )  # fmt: skip
    for head in heads:
        table.add_column(head, no_wrap=True)
    for fault, (found, positive, latency) in theirs.items():
        rate = f"{percent(positive)} FP"
        table.add_row(fault, "not told", "the paper", percent(found), f"{latency:g}", "-", rate)
    for row in rows:
        delay = "-" if math.isnan(row.delay) else f"{row.delay:.1f}"
        ratio = "-" if math.isnan(row.against_oracle) else f"{row.against_oracle:.2f}"
        false = f"{row.false_per_1000:.3g}"
        growth = f"{row.ratio:g}"
        mine = share_of(row.found, row.lives)
        table.add_row(row.fault, growth, row.detector, mine, delay, ratio, false)
    return table


def _promises(kept: Sequence[Kept]) -> Table:
    table = Table(title="healthy runs of 1000 steps with an alarm")
    for head in ("noise", "runs with an alarm (95 %)", "promised at most"):
        table.add_column(head, no_wrap=True)
    for one in kept:
        table.add_row(one.noise, share_of(one.share, one.runs), f"{one.promised:.1%}")
    return table


def _forecasts(predicted: Sequence[Predicted]) -> Table:
    table = Table(title="time to the critical level")
    for head in ("sigma", "after onset", "left", "median error", "90 % intervals cover (95 %)"):
        table.add_column(head, no_wrap=True)
    for one in predicted:
        cells = (f"{one.sigma:g}", str(one.age), f"{one.left:g}")
        table.add_row(*cells, percent(one.error), share_of(one.coverage, one.lives))
    return table
