"""urdyn bench faults: the paper's Table III and Figure 4 beside what urdyn finds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from urdyn.cli.kinds import as_counts, broken, kinds_table, summed
from urdyn.cli.options import Json, Page, Quiet
from urdyn.cli.voice import Voice
from urdyn.io.plain import jsonable
from urdyn.report.bench.shares import share_of
from urdyn.report.digits import number
from urdyn.report.terminal import terminal_table

if TYPE_CHECKING:
    from rich.table import Table

    from urdyn.bench.diagnosis_trials import Trial
    from urdyn.report.bench.confusion import Kinds
    from urdyn.report.bench.faults import Kept, Paper, Predicted
    from urdyn.report.bench.figure_four import Foreseen
    from urdyn.report.bench.table_three import OnArm, Row

FEWEST = 12  # lives, to determine the oracle's threshold
ROBOT, NOISE = "ur10e", "white"  # of the virtual arm

Lives = Annotated[int, typer.Option(min=FEWEST, help="Of each fault at each level of noise.")]
Runs = Annotated[
    int, typer.Option(min=0, help="Of a virtual arm with each kind of fault; 0: of none.")
]
Seed = Annotated[int, typer.Option(min=0, help="Of the random lives, and of the arm.")]


@dataclass(frozen=True, eq=False)
class Measured:
    """Results of a bench."""

    lives: int
    rows: Sequence[Row]
    kept: Sequence[Kept]
    predicted: Sequence[Predicted]
    life: Foreseen
    done: list[Trial]  # of the virtual arm; none where it was not asked for

    @property
    def kinds(self) -> Kinds | None:
        """Which kinds were reported as which; None: no arm was broken."""
        from urdyn.bench.diagnosis_trials import counted

        return counted(self.done) if self.done else None

    def on_arm(self, faults: Iterable[str]) -> list[OnArm]:
        """The virtual arm's rows of Table III."""
        from urdyn.bench.diagnosis_trials import on_arm

        return [on_arm(self.done, name.replace(" ", "_"), name) for name in faults if self.done]


def bench_faults(
    out: Page = None,
    lives: Lives = 600,
    runs: Runs = 2,
    seed: Seed = 0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """The paper's Table III and Figure 4 beside ours: rates, delays, false alarms, forecasts.

    Friction and health wear in many simulated lives; a virtual arm is broken in every way, and
    what is told of it is counted by kind. More of that, in pairs too: urdyn bench diagnose.

    Example: [bold]urdyn bench faults --lives 120 --runs 1 --out faults.html[/bold]
    """
    from urdyn.cli.results import require_place

    require_place(out)
    voice, paper = Voice(json, quiet), _paper()
    found = _measured(lives, runs, seed, voice)
    _show(voice, found, paper)
    if out is not None:
        _draw(out, found, paper)
        voice.note(f"written: {out}")
    voice.result(jsonable({"runs": runs, "seed": seed} | _document(found, paper)))


def _paper() -> Paper:
    from urdyn.bench import FAULTS, paper
    from urdyn.report.bench.faults import Paper
    from urdyn.report.bench.figure_four import Told

    figure4 = Told(paper.NOTICED, paper.LATE, paper.LOW, paper.SAID, paper.AHEAD)
    return Paper({f.name: (f.found, f.false, f.steps) for f in FAULTS}, figure4)


def _measured(lives: int, runs: int, seed: int, voice: Voice) -> Measured:
    from threadpoolctl import threadpool_limits

    from urdyn.bench import fault_trials
    from urdyn.bench.diagnosis_trials import ALONE
    from urdyn.simulate.paper import JOINTS

    trials = fault_trials.Trials(lives - lives % JOINTS, seed)
    share = 0.2 if runs else 1.0  # of the time, taken by lives
    with voice.progress("finding faults") as progress, threadpool_limits(1):
        rows = list(fault_trials.rated(trials))
        progress("healthy data of all kinds", 0.5 * share)
        kept = list(fault_trials.kept(trials.runs, seed))
        progress("forecasts", 0.8 * share)
        predicted = list(fault_trials.predicted(trials))
        life = fault_trials.figure4(seed)
        done = broken(
            ROBOT, seed, runs, NOISE, ALONE,
            lambda doing, x: progress(doing, share + (1.0 - share) * x),
        )  # fmt: skip
    return Measured(trials.runs, rows, kept, predicted, life, done)


def _show(voice: Voice, found: Measured, paper: Paper) -> None:
    from urdyn.report.bench import figure_four, table_three
    from urdyn.report.bench.faults import forecasts

    arm, kinds = found.on_arm(paper.faults), found.kinds
    compared = table_three.table_three(found.rows, arm, paper.faults)
    life = f"Figure 4: friction grows from step {found.life.onset}, sigma {found.life.sigma:g}"
    voice.show(
        _rates(found.rows),
        _promises(found.kept),
        terminal_table("Table III, the paper's and ours", table_three.HEADS, compared, 2),
    )
    if kinds:
        voice.show(kinds_table(kinds), summed(found.done, kinds))
    voice.show(
        terminal_table(life, figure_four.HEADS, figure_four.beside(found.life, paper.figure4)),
        terminal_table(
            "Figure 4 over many lives: time to the critical level",
            ("sigma", "after onset", "left", "median error", "90 % intervals cover (95 %)"),
            forecasts(found.predicted),
        ),
    )


def _draw(out: Path, found: Measured, paper: Paper) -> None:
    from urdyn.io import write_text
    from urdyn.report.bench.faults import fault_page
    from urdyn.simulate.paper import FRICTION_INCREASE, reconstruction

    taken = reconstruction(replace(FRICTION_INCREASE, motion="steady"))
    arm = found.on_arm(paper.faults)
    page = fault_page(
        found.rows, found.kept, found.life, found.predicted, found.kinds, arm, paper, taken
    )
    write_text(out, page)


def _document(found: Measured, paper: Paper) -> dict[str, Any]:
    """All of it in plain numbers."""
    from urdyn.bench.fault_trials import PROMISE
    from urdyn.report.bench.figure_four import figures

    kinds = found.kinds
    return {
        "lives": found.lives,
        "promise_steps": PROMISE,
        "table3": _table3(found, paper),
        "figure4": figures(found.life, paper.figure4),
        "kinds": as_counts(kinds) if kinds else None,
        "faults": [asdict(row) for row in found.rows],
        "promise": [asdict(one) for one in found.kept],
        "forecasts": [asdict(one) for one in found.predicted],
    }


def _table3(found: Measured, paper: Paper) -> list[dict[str, Any]]:
    """Each of the paper's rows, with ours on its scenario and on the virtual arm."""
    from urdyn.report.bench.table_three import TOGETHER

    arm = {
        one.fault: asdict(one) | {"false_per_1000": one.false_per_1000}
        for one in found.on_arm(paper.faults)
    }
    ours = [row for row in found.rows if row.detector == TOGETHER]
    return [
        {
            "fault": name,
            "paper": {"found": rate, "fp_rate": false, "delay": steps},
            "scenario": [asdict(row) for row in ours if row.fault == name],
            "arm": arm.get(name),
        }
        for name, (rate, false, steps) in paper.faults.items()
    ]


def _rates(rows: Sequence[Row]) -> Table:
    title = "found before the warning level, at a promise of 1 false alarm in 10,000 steps"
    heads = (
        "fault", "growth\n/sigma", "detector", "found\n(95 %)", "delay", "x\noracle",
        "false\n/1000",
    )  # fmt: skip
    cells = (
        (
            row.fault,
            f"{row.ratio:g}",
            row.detector,
            share_of(row.found, row.lives),
            number(row.delay, 3),
            number(row.against_oracle, 3),
            f"{row.false_per_1000:.3g}",
        )
        for row in rows
    )
    return terminal_table(title, heads, cells, 3)


def _promises(kept: Sequence[Kept]) -> Table:
    heads = ("noise", "runs with an alarm (95 %)", "promised at most")
    cells = ((one.noise, share_of(one.share, one.runs), f"{one.promised:.1%}") for one in kept)
    return terminal_table("healthy runs of 1000 steps with an alarm", heads, cells)
