"""urdyn convert: a recording, or results of tracking, in another form."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import urdyn as ud
from urdyn.cli.asked import gains_of
from urdyn.cli.idle import idle
from urdyn.cli.options import Columns, Gains, Json, Quiet, Rate, Robot, Rows, Unit
from urdyn.cli.voice import Voice, complaints
from urdyn.errors import InputError
from urdyn.io import is_log
from urdyn.io.effort import Effort

In = Annotated[Path, typer.Argument(metavar="IN", show_default=False)]
Out = Annotated[Path, typer.Argument(metavar="OUT", show_default=False)]


def convert(
    context: typer.Context,
    log: In,
    out: Out,
    columns: Columns = None,
    rows: Rows = None,
    rate: Rate = None,
    effort_unit: Unit = None,
    drive_gain: Gains = None,
    robot: Robot = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a recording in another form; what was written reads back equal.

    IN is a log (CSV, Parquet, MCAP, a ROS 1 or ROS 2 bag), a history.parquet or findings.json of
    `urdyn track`, or the folder with both. OUT ends in .csv, .csv.zst, .parquet, .mcap or .db3;
    without an ending it is the folder of a ROS 2 bag. MCAP opens in Foxglove and PlotJuggler.

    Example: [bold]urdyn convert monday.parquet monday.mcap[/bold]
    """
    from urdyn.cli.recording import slice_of
    from urdyn.io import read, write
    from urdyn.io.tracked import is_tracked, write_tracked

    voice = Voice(json, quiet)
    _require_other(log, out)
    if is_tracked(log):
        of_logs = ("columns", "rows", "rate", "effort_unit", "drive_gain", "robot")
        idle(context, f"with {log}, which is no recording", *of_logs)
        count, kinds = write_tracked(log, out)
        voice.show(f"{out}: {count} messages of {' and '.join(kinds)}")
        voice.result({"path": str(out), "messages": count, "of": kinds})
        return
    if effort_unit != "Nm":
        idle(context, "without --effort-unit Nm", "drive_gain", "robot")
    if drive_gain is not None:
        idle(context, "with --drive-gain", "robot")
    effort = _effort(effort_unit, drive_gain, robot)
    part = slice_of(rows) if rows is not None else None
    with voice.progress("converting"):
        found = read(log, columns=columns, rows=part, rate=rate, effort=effort)
        write(found, out)
    voice.note(*complaints(log, found.defects))
    voice.show(f"{out}: {len(found)} samples, {len(found.channels)} channels")
    voice.result(
        {
            "path": str(out),
            "samples": len(found),
            "duration_s": float(found.t[-1] - found.t[0]),
            "channels": list(found.channels),
            "defects": list(map(str, found.defects)),
        }
    )


def _require_other(log: Path, out: Path) -> None:
    """InputError where OUT would take the place of IN: no recording can be made again."""
    if not (log.exists() and out.exists()):
        return
    part = log.resolve() in out.resolve().parents and is_log(log)  # of a bag
    if out.samefile(log) or part or out.resolve() in log.resolve().parents:
        raise InputError(f"{out}: would take the place of {log}; name another")


def _effort(unit: str | None, drive_gain: str | None, robot: str | None) -> Effort:
    """The unit of the recording's efforts; gains are those given, else typical of the robot."""
    if unit != "Nm":
        return Effort(unit)
    if drive_gain is None and robot is None:
        raise InputError(
            "efforts in Nm become currents by drive gains: give --drive-gain or --robot"
        )
    from urdyn.cli.carry_out import typical_gain

    known = gains_of(drive_gain)
    return Effort(unit, known if known is not None else typical_gain(ud.load_arm(str(robot))))
