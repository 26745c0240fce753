"""urdyn validate: how well a twin predicts recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import urdyn as ud
from urdyn.cli.asked import read_as, typed
from urdyn.cli.options import Columns, Contact, Json, Logs, Quiet, Rate, Rows, Unit
from urdyn.cli.recording import Recording
from urdyn.cli.twin_file import load_fit
from urdyn.cli.voice import Voice
from urdyn.io.effort import Effort

TwinFile = Annotated[Path, typer.Argument(metavar="TWIN", show_default=False)]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Write DIR/validation.html.")]


def validate(
    twin: TwinFile,
    logs: Logs,
    columns: Columns = None,
    rows: Rows = None,
    rate: Rate = None,
    effort_unit: Unit = None,
    contact: Contact = None,
    out: Out = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Score a twin on recordings: how much of the measured motor current it predicts.

    TWIN is a twin.toml of `urdyn identify`, LOG a recording of the same arm without a payload.
    What a joint draws while it stands no model tells: intervals are judged by the other rows.

    Example: [bold]urdyn validate twin/twin.toml another_run.csv[/bold]
    """
    from urdyn.cli.results import require_folder
    from urdyn.cli.verdict import verdict
    from urdyn.io import write_folder
    from urdyn.report.identify.doubts import another, misnamed, otherwise_warm, slopes, smooth
    from urdyn.report.identify.page import validate_page
    from urdyn.report.identify.summary import validated
    from urdyn.report.identify.tables import validate_table

    voice, (fit, _) = Voice(json, quiet), load_fit(twin, logs)
    effort = Effort(effort_unit, fit.dynamics.drive.gain)
    asked = tuple(Recording(path, effort=effort) for path in logs)
    recordings = read_as(asked, columns, rows, rate, contact)
    if out is not None:
        require_folder(out)
    with voice.progress("scoring"):
        scores = [ud.validate(fit, recording.read()) for recording in recordings]
    against = [*misnamed(fit, scores), *slopes(scores), *smooth(scores)]
    against += [*otherwise_warm(fit, scores), another(fit, scores)]
    doubt = "; ".join(filter(None, against))
    if out is not None:
        page = validate_page(fit, scores, typed(), [doubt] if doubt else [])
        write_folder(out, {"validation.html": page})
        voice.note(f"written: {out / 'validation.html'}")
    for recording, score in zip(recordings, scores, strict=True):
        voice.note(*recording.complaints(score.log))
    voice.show(validate_table(scores, fit))
    voice.doubt(*([doubt] if doubt else []))
    voice.show(verdict(fit, scores))
    voice.result(validated(scores) | ({"doubt": doubt} if doubt else {}))
