"""urdyn track: a twin beside its robot, or along a recording of it."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import urdyn as ud
from urdyn.cli.diagnosing import (
    FAILED,
    FailOnFinding,
    Hours,
    NoDiagnosis,
    RulesFile,
    onlooker,
    summed,
)
from urdyn.cli.options import Columns, Json, Quiet, Rows
from urdyn.cli.recording import slice_of
from urdyn.cli.voice import Voice

if TYPE_CHECKING:
    from urdyn.estimate import Filter
    from urdyn.tracking import Source

FILTERS = {
    "ukf": "UKF",
    "ekf": "EKF",
    "information": "InformationFilter",
    "particle": "ParticleFilter",
    "variational": "Variational",
}

# With a hundred states sigma points lie ten sd out unless told otherwise, where a logarithm is far
# from straight; so they lie some sqrt(3).
SPREAD = 0.17

TwinFile = Annotated[Path, typer.Argument(metavar="TWIN", show_default=False)]
From = Annotated[str, typer.Argument(metavar="SOURCE", show_default=False)]
Out = Annotated[Path, typer.Option(metavar="DIR", help="Where the history is written.")]
Named = Annotated[str, typer.Option("--filter", metavar="NAME", help=f"{', '.join(FILTERS)}.")]
Rate = Annotated[
    float | None,
    typer.Option(
        metavar="HZ", help="Of a log without time stamps; or samples a second that a robot sends."
    ),
]
Duration = Annotated[
    float | None, typer.Option(metavar="S", help="Stop after so much of the source's time.")
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Begin anew, whatever DIR holds.")]


def track(
    twin: TwinFile,
    source: From,
    out: Out,
    filter: Named = "ukf",  # noqa: A002 - the domain's word
    columns: Columns = None,
    rows: Rows = None,
    rate: Rate = None,
    duration: Duration = None,
    fresh: Fresh = False,
    no_diagnosis: NoDiagnosis = False,
    rules: RulesFile = None,
    false_alarm_hours: Hours = None,
    fail_on_finding: FailOnFinding = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Follow friction, health and payload of an arm, from a log or while it works.

    TWIN is a twin.toml of `urdyn identify`, SOURCE a log, or rtde://HOST[:PORT] of a robot at work.
    Faults are told as they are found, and written to DIR/findings.json.
    A run that was killed goes on where it was; Ctrl-C ends a live one in good order.

    Example: [bold]urdyn track twin/twin.toml rtde://192.168.0.10 --out monday[/bold]
    """
    from urdyn.cli.results import require_folder
    from urdyn.cli.watching import verdict, watching
    from urdyn.io import sha256
    from urdyn.tracking import Tracker, open_source, run

    voice, chosen = Voice(json, quiet), _filter(filter)
    require_folder(out)
    fit, part = ud.Twin.load(twin).fit, slice_of(rows) if rows is not None else None
    stream = open_source(source, columns, part, rate, duration)
    _end_in_good_order(stream)
    tracker: Tracker[Any] = Tracker(fit, chosen, stream.period)
    looking = None if no_diagnosis else onlooker(fit, stream, rules, false_alarm_hours, voice)
    try:
        with watching(fit.dynamics.arm.joint_names, quiet) as watch:
            summary = run(tracker, stream, out, sha256(twin), fresh, watch, looking)
    finally:
        stream.close()
    summary["filter"] = filter
    _report(out, summary, voice)
    voice.show(verdict(summary))
    voice.show(summed(summary))
    voice.result(summary)
    if fail_on_finding and any(not f["acknowledged"] for f in summary.get("findings", ())):
        raise typer.Exit(FAILED)


def _filter(name: str) -> Filter[Any]:
    if name not in FILTERS:
        raise typer.BadParameter(f"no filter {name!r}; choose one of {', '.join(FILTERS)}")
    from urdyn import estimate

    settings = {"alpha": SPREAD} if name == "ukf" else {}
    made: Filter[Any] = getattr(estimate, FILTERS[name])(**settings)
    return made


def _end_in_good_order(source: Source) -> None:
    """Ctrl-C, and a service manager's way to end a process, close a live stream."""
    if source.live:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: source.close())


def _report(out: Path, summary: dict[str, Any], voice: Voice) -> None:
    """Write DIR/report.html."""
    from urdyn.io import write_text
    from urdyn.report.track_page import track_page

    write_text(out / "report.html", track_page(out / "history.parquet", summary))
    voice.note(f"written: {out / 'history.parquet'}, {out / 'report.html'}")
