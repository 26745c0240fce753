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
from urdyn.version import __version__

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


@dataclass(frozen=True)
class Figure:
    """Time and memory that it took."""

    case: Case
    wall: float  # [s], from starting the process to its end
    rss: float  # [GB], peak

    @property
    def passed(self) -> bool:
        """Within both targets."""
        return self.wall <= self.case.most_wall and self.rss <= self.case.most_rss


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
    voice.result({"urdyn": __version__, "cases": [_numbers(figure) for figure in figures]})


def _measure(case: Case) -> Figure:
    """Simulate in one process, whose memory must not count, and identify in another."""
    with tempfile.TemporaryDirectory(prefix="urdyn-bench-") as folder:
        log, out = f"{folder}/log.parquet", f"{folder}/twin"
        how = ("--duration", str(case.duration), "--rate", str(case.rate), "--seed", "1")
        fresh("simulate", "--robot", "ur10e", *how, "--out", log)
        took = fresh("identify", log, "--robot", "ur10e", "--out", out)
    return Figure(case, took.wall, took.rss / GIGABYTE)


def _table(figures: list[Figure]) -> Table:
    heads = ("identify", "wall [s]", "target", "peak memory [GB]", "target", "verdict")
    rows = [
        (
            figure.case.name,
            f"{figure.wall:.1f}",
            f"{figure.case.most_wall:g}",
            f"{figure.rss:.2f}",
            f"{figure.case.most_rss:g}",
            "pass" if figure.passed else "fail",
        )
        for figure in figures
    ]
    return terminal_table("", heads, rows)


def _numbers(figure: Figure) -> dict[str, Any]:
    case = figure.case
    return {
        "name": case.name,
        "duration_s": case.duration,
        "rate_hz": case.rate,
        "wall_s": figure.wall,
        "wall_target_s": case.most_wall,
        "peak_rss_gb": figure.rss,
        "peak_rss_target_gb": case.most_rss,
        "pass": figure.passed,
    }
