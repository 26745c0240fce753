"""urdyn track: a twin beside its robot, or along a recording of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import urdyn as ud
from urdyn.cli.diagnosing import (
    FAILED,
    FailOnFinding,
    Hours,
    NoDiagnosis,
    RulesFile,
    faulty,
    known_rules,
    onlooker,
    summed,
    undiagnosed,
)
from urdyn.cli.ending import ended_by
from urdyn.cli.idle import idle
from urdyn.cli.listening import listening, unused, wanted
from urdyn.cli.options import Columns, Contact, Json, Quiet, Rows, Unit
from urdyn.cli.recording import contact_named, slice_of
from urdyn.cli.track_options import (
    FILTERS,
    CalibrationFile,
    Duration,
    FilterName,
    Fresh,
    HandOver,
    ModeName,
    Mqtt,
    Out,
    PosesFile,
    Prometheus,
    Publish,
    Rate,
    Serial,
    SourceNames,
    TwinFile,
    Wrench,
)
from urdyn.cli.twin_file import load_fit
from urdyn.cli.voice import Voice
from urdyn.errors import InputError
from urdyn.io.effort import Effort

if TYPE_CHECKING:
    from urdyn.estimate import Filter
    from urdyn.io.helper import Helper
    from urdyn.tracking import Source


def track(
    context: typer.Context,
    twin: TwinFile,
    sources: SourceNames,
    out: Out,
    filter: FilterName = None,
    mode: ModeName = "full",
    columns: Columns = None,
    rows: Rows = None,
    rate: Rate = None,
    effort_unit: Unit = None,
    contact: Contact = None,
    duration: Duration = None,
    poses: PosesFile = None,
    calibration: CalibrationFile = None,
    wrench: Wrench = False,
    fresh: Fresh = False,
    no_diagnosis: NoDiagnosis = False,
    rules: RulesFile = None,
    false_alarm_hours: Hours = None,
    fail_on_finding: FailOnFinding = False,
    serial: Serial = "",
    prometheus: Prometheus = None,
    mqtt: Mqtt = None,
    publish: Publish = None,
    hand_over: HandOver = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Follow friction, health and payload of an arm, from a log or while it works.

    TWIN is a twin.toml of `urdyn identify`, SOURCE a log, or several that follow each other, or of
    a robot at work rtde://HOST[:PORT] or ros2://TOPIC, which also publishes /diagnostics and what
    is learnt under /urdyn.
    Faults are told as they are found, and written to DIR/findings.json.
    A run that was killed goes on where it was; Ctrl-C ends a live one in good order.

    Example: [bold]urdyn track twin/twin.toml rtde://192.168.0.10 --out monday[/bold]
    """
    # Arrow's own pools keep freed memory; a twin beside its robot has to stay small.
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    from urdyn.cli.announcing import HANDED, PUBLISHED, announcing, both, hand, known
    from urdyn.cli.results import require_folder
    from urdyn.cli.watching import watching
    from urdyn.tracking import Tracker, open_source, run

    source, *more = sources
    plants = prometheus is not None or mqtt is not None
    _refuse_idle(context, source, poses, no_diagnosis, plants)
    voice, chosen = Voice(json, quiet), _filter(filter, mode, wrench)
    known(publish, PUBLISHED, "--publish")
    known(hand_over, HANDED, "--hand-over")
    require_folder(out)
    _require_free(out)
    (fit, twin_sha256), part = load_fit(twin, sources), slice_of(rows) if rows is not None else None
    touch = contact_named(contact)
    effort, beside = Effort(effort_unit, fit.dynamics.drive.gain), wanted(poses, wrench)
    healthy = None if no_diagnosis else known_rules(rules, false_alarm_hours)
    with (
        _ahead("://" in source, fit, chosen, bool(healthy)) as (writer, helper),
        announcing(fit, source, serial, prometheus, mqtt, publish or ()) as told,
        closing(
            open_source(
                source,
                columns,
                part,
                rate,
                duration,
                effort,
                beside,
                voice.note,
                more,
                touch,
            )
        ) as stream,
        watching(fit.dynamics.arm.joint_names, voice) as shown,
        ended_by(stream.close) if stream.live else nullcontext(),
    ):
        stream, streams, drift = listening(stream, fit.dynamics, poses, wrench, calibration)
        if not fresh:
            _require_own(out, stream)
        summary = run(
            Tracker(
                fit, chosen, stream.period, drift, streams=streams, velocities=stream.velocities
            ),
            stream,
            out,
            twin_sha256=twin_sha256,
            fresh=fresh,
            watch=both(shown, told),
            observer=onlooker(fit, stream, healthy, voice, helper) if healthy else None,
            writer=writer,
        )
    summary |= {"filter": filter or ("ukf" if mode == "full" else "ekf")}
    if healthy is None:
        undiagnosed(out)
    summary |= {"surprise": _report(out, summary, voice)}
    if poses and (why := unused(summary)):
        voice.note(why)
    if touch and not summary["quality"]["in_contact"]:
        voice.note(f"{stream.name}: {touch.unfelt}")
    _tell(summary, voice)
    for path in hand(fit, summary, hand_over or (), out):
        voice.note(f"written: {path}")
    if fail_on_finding and faulty(summary):
        raise typer.Exit(FAILED)


def _tell(summary: dict[str, Any], voice: Voice) -> None:
    """Print the results, for people and for programs."""
    from urdyn.cli.watching import verdict

    voice.show(verdict(summary))
    voice.show(summed(summary))
    if voice.quiet and "doubt" in summary:
        voice.doubt(summary["doubt"])
    voice.result(summary)


def _refuse_idle(
    context: typer.Context, source: str, poses: str | None, undiagnosed: bool, plants: bool
) -> None:
    """InputError at an option that has no effect for this source, or beside another option."""
    scheme, live, _ = source.partition("://")
    if not poses:
        idle(context, "without --poses", "calibration")
    if undiagnosed:
        idle(context, "with --no-diagnosis", "rules", "false_alarm_hours", "fail_on_finding")
    if live:
        idle(context, f"with a live source, {source}", "columns", "rows")
    if scheme == "rtde":
        idle(context, "with a controller, which sends A", "effort_unit")
    if not plants and scheme != "ros2":
        idle(context, "where nobody is told (--prometheus, --mqtt, ros2://)", "serial")


@contextmanager
def _ahead(
    live: bool, fit: ud.Fit, chosen: Filter[Any], diagnosed: bool
) -> Iterator[tuple[Helper | None, Helper | None]]:
    """Helpers that write and diagnose, started before a live stream, which does not wait."""
    if not live:
        yield None, None
        return
    from urdyn.diagnose.onlooker import begin_diagnosis
    from urdyn.tracking import begin_scribe, rehearse

    with ExitStack() as ends:
        writer = ends.enter_context(closing(begin_scribe()))
        helper = ends.enter_context(closing(begin_diagnosis(fit))) if diagnosed else None
        rehearse(fit, chosen)
        for one in filter(None, (writer, helper)):
            one.await_ready()
        yield writer, helper


def _filter(name: str | None, mode: str, wrench: bool) -> Filter[Any]:
    from urdyn import estimate
    from urdyn.tracking import QUICKER

    if mode != "full":
        if name not in (None, "ekf"):
            raise typer.BadParameter(f"mode {mode} linearises; leave --filter {name} out")
        return QUICKER[mode]
    if name == "particle" and wrench:  # it shows tens of newtons of nothing, ± 1 N
        raise typer.BadParameter("particles are too few for --wrench; leave one of both out")
    name = name or "ukf"
    made: Filter[Any] = getattr(estimate, FILTERS[name])()
    return made


def _require_free(out: Path) -> None:
    """InputError where another run writes to DIR: whom that tells is not to hear of this one."""
    from urdyn.io import alone

    if out.exists():
        with alone(out):
            pass


def _require_own(out: Path, stream: Source) -> None:
    """InputError where DIR holds a finished run of another source, which would be lost.

    One that is not finished is its checkpoint's business.
    """
    from urdyn.io.run_folder import HISTORY
    from urdyn.tracking.output.checkpoint import ANEW, whose

    if whose(out) or not (out / HISTORY).exists():
        return
    name, sha256 = _held(out)
    if (sha256 or name) != (stream.sha256 or stream.name):
        raise InputError(f"{out}: holds the run of {name}; {ANEW}")


def _held(out: Path) -> tuple[str, str]:
    """Source of the finished run in DIR, and its sha256, if it has one."""
    import json

    from urdyn.io.run_folder import FINDINGS

    try:
        made_of = json.loads((out / FINDINGS).read_text(encoding="utf-8"))["provenance"]
        return str(made_of["source"]), str(made_of.get("source.sha256", ""))
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        from urdyn.report.track.history import find_history  # heavy: where no diagnosis says it

        made_of = find_history(out).provenance
        return str(made_of.get("source", "an unknown log")), str(made_of.get("source.sha256", ""))


def _report(out: Path, summary: dict[str, Any], voice: Voice) -> float | None:
    """Write DIR/report.html; the average surprise that it shows."""
    from urdyn.io.run_folder import HISTORY, REPORT
    from urdyn.report.track.apart import draw

    history, page = out / HISTORY, out / REPORT
    page.unlink(missing_ok=True)  # of the run before: it shows another history
    surprise = draw(history, summary, page)
    voice.note(f"written: {history}, {page}")
    return surprise
