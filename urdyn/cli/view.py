"""urdyn view: the arm in three dimensions, in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from urdyn.cli.idle import idle
from urdyn.cli.options import Columns, Quiet, Rate, Robot, Rows
from urdyn.cli.recording import slice_of
from urdyn.cli.voice import Voice
from urdyn.io.address import LOOPBACK

if TYPE_CHECKING:
    from urdyn.cli.viewing import Found
    from urdyn.view.stage import Stage

DRAWN = "calibrated.urdf"  # among the files of a calibration

What = Annotated[str, typer.Argument(metavar="SOURCE", show_default=False)]
TwinFile = Annotated[
    Path | None,
    typer.Option("--twin", metavar="TWIN", help="The twin.toml that it was tracked by."),
]
LogFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--log",
        metavar="LOG",
        help="The log that was tracked, if it was moved since, of several each, in their order; "
        "of a live run that is over, a recording that was made meanwhile.",
    ),
]
Calibration = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        "--calibrated",
        metavar="DIR|URDF",
        help="Of `urdyn calibrate`; the nominal arm becomes a ghost.",
    ),
]
Host = Annotated[str, typer.Option(help="Where to listen; others than this let others look on.")]
Port = Annotated[
    int,
    typer.Option(
        metavar="N", min=1, max=65535, help="Where to listen; if it is taken, the next free one."
    ),
]
Open = Annotated[bool, typer.Option("--open", help="Open it in a browser.")]


def view(
    context: typer.Context,
    source: What,
    twin: TwinFile = None,
    robot: Robot = None,
    log: LogFiles = None,
    calibration: Calibration = None,
    columns: Columns = None,
    rows: Rows = None,
    rate: Rate = None,
    host: Host = LOOPBACK,
    port: Port = 8080,
    show: Open = False,
    quiet: Quiet = False,
) -> None:
    """Show an arm in a browser, coloured by what has changed: replayed, or live.

    SOURCE is a folder of `urdyn track`; or rtde://HOST[:PORT] of a robot at work, which is only
    listened to; or a log, to see how the arm moved. A run of a live robot is shown while it goes
    on; later, by a --log that was recorded meanwhile.

    Example: [bold]urdyn view monday --twin model/twin.toml[/bold]
    """
    from urdyn.cli.viewing import Asked, find
    from urdyn.view.stage import require

    require()
    _refuse_idle(context, source, twin)
    voice, part = Voice(quiet=quiet), slice_of(rows) if rows is not None else None
    found = find(Asked(source, twin, robot, tuple(log or ()), columns, part, rate))
    try:
        stage = _stage(found, source, calibration, host, port)
        voice.show(f"{stage.address} shows {source}; Ctrl-C ends it.")
        if host != LOOPBACK:
            voice.note(f"{host}: whoever reaches this computer can look on and turn the controls")
        if show:
            typer.launch(stage.address)
        _run(stage, found)
    finally:
        found.close()


def _refuse_idle(context: typer.Context, source: str, twin: Path | None) -> None:
    """InputError at an option that has no effect for this source, or beside another option."""
    from urdyn.io import is_log

    if "://" in source:
        idle(context, f"with a live source, {source}", "log", "columns", "rows", "rate")
    if is_log(Path(source)):
        idle(context, f"with {source}, which is no folder of `urdyn track`", "log")
    if twin is not None:
        idle(context, "with --twin, which says it", "robot")


def _stage(found: Found, source: str, calibration: Path | None, host: str, port: int) -> Stage:
    """The arm, before its first moment."""
    from urdyn.model.arm import load_arm
    from urdyn.view.scene import Scene
    from urdyn.view.shapes import shapes
    from urdyn.view.stage import open_stage

    arm = found.arm
    if calibration is not None:
        arm = load_arm(calibration / DRAWN if calibration.is_dir() else calibration)
    scene = Scene(arm, found.arm, shapes(found.arm))
    return open_stage(scene, f"{found.arm.name} · {source}", found.film, host, port)


def _run(stage: Stage, found: Found) -> None:
    """Show until the end, or Ctrl-C."""
    from urdyn.view.show import play, watch

    try:
        if found.film is not None:
            play(stage, found.film)
        elif found.moments is not None:
            watch(stage, found.moments)
    except KeyboardInterrupt:
        return
    finally:
        stage.close()
