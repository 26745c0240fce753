"""urdyn bench: time and memory of a fresh process on this machine."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from typing import Annotated, Any

import typer
from rich.table import Table

from urdyn.cli.fresh import fresh
from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice
from urdyn.report.terminal import terminal_table

GIGABYTE = 1e9

Quick = Annotated[bool, typer.Option("--quick", help="A tenth of the long log.")]


@dataclass(frozen=True)
class Case:
    """A log to identify, and the time and memory that this may take."""

    name: str
    duration: float  # [s]
    rate: float  # [Hz]
    most_wall: float  # [s]
    most_rss: float  # [GB]


CASES = (
    Case("2875 rows at 100 Hz", 28.75, 100.0, 10.0, 2.0),
    Case("an hour at 500 Hz", 3600.0, 500.0, 60.0, 2.0),
)


def bench_identify(quick: Quick = False, json: Json = False, quiet: Quiet = False) -> None:
    """Identify a short and a long simulated log from a cold start, each in a fresh process.

    Example: [bold]urdyn bench identify --quick[/bold]
    """
    voice = Voice(json, quiet)
    cases = (CASES[0], Case("six minutes at 500 Hz", 360.0, 500.0, 60.0, 2.0)) if quick else CASES
    with voice.progress("preparing") as progress:
        figures = []
        for k, case in enumerate(cases):
            progress(case.name, k / len(cases))
            figures.append(_measure(case))
    voice.show(_table(figures))
    voice.result({"cases": figures})


def _measure(case: Case) -> dict[str, Any]:
    """Simulate in one process, whose memory must not count, and identify in another."""
    with tempfile.TemporaryDirectory(prefix="urdyn-bench-") as folder:
        log, out = f"{folder}/log.parquet", f"{folder}/twin"
        how = ("--duration", str(case.duration), "--rate", str(case.rate), "--seed", "1")
        fresh("simulate", "--robot", "ur10e", *how, "--out", log)
        took = fresh("identify", log, "--robot", "ur10e", "--out", out)
    rss = took.rss / GIGABYTE
    return {
        "name": case.name,
        "duration_s": case.duration,
        "rate_hz": case.rate,
        "wall_s": took.wall,
        "wall_target_s": case.most_wall,
        "peak_rss_gb": rss,
        "peak_rss_target_gb": case.most_rss,
        "pass": took.wall <= case.most_wall and rss <= case.most_rss,
    }


def _table(figures: list[dict[str, Any]]) -> Table:
    heads = ("identify", "wall [s]", "target", "peak memory [GB]", "target", "verdict")
    rows = (
        (
            took["name"],
            f"{took['wall_s']:.1f}",
            f"{took['wall_target_s']:g}",
            f"{took['peak_rss_gb']:.2f}",
            f"{took['peak_rss_target_gb']:g}",
            "pass" if took["pass"] else "fail",
        )
        for took in figures
    )
    return terminal_table("", heads, rows)
