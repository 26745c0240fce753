"""Options that several verbs share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

_ROBOT = typer.Option(
    "--robot",
    help="Arm type (ur3 ur5 ur10 ur3e ur5e ur7e ur10e ur12e ur16e ur20 ur30), upright, or a URDF "
    "file.",
)
Robot = Annotated[str | None, _ROBOT]
OneRobot = Annotated[str, _ROBOT]  # where nothing else determines it
Columns = Annotated[
    str | None,
    typer.Option(
        metavar="SPEC",
        help="Names of the columns of a file without a header, as RTDE calls them; *6 repeats, "
        "- skips: timestamp,actual_q*6,-",
    ),
]
Rows = Annotated[
    str | None,
    typer.Option(metavar="A:B", help="Use data rows A to B - 1 only; the first is 0."),
]
Rate = Annotated[
    float | None, typer.Option(metavar="HZ", help="Sample rate of a log without time stamps.")
]
Contact = Annotated[
    str | None,
    typer.Option(
        metavar="CHANNEL[:BIT]",
        help="What says that the arm works in contact: a channel, or a bit of it, that is not 0 "
        "meanwhile. Nothing is learnt from such rows' currents, or found in them.",
    ),
]
Unit = Annotated[
    Literal["A", "Nm"] | None,
    typer.Option(
        "--effort-unit",
        help="What a bag's efforts, or a log's actual_current, are: A, motor currents, as UR's "
        "driver publishes them; or Nm, joint torques, which become currents by the drive gains "
        "in use.",
    ),
]
Gains = Annotated[
    str | None,
    typer.Option(
        "--drive-gain",
        metavar="K0,K1,...",
        help="Drive gains [N·m/A] that are known, base first; efforts in Nm are divided by them.",
    ),
]
Folder = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Folder of the results; made if need be."),
]
Page = Annotated[
    Path | None, typer.Option("--out", metavar="FILE", help="Draw it to an HTML page.")
]
Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on standard output, nothing else.")
]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print errors, and doubts of the result, only.")
]
Logs = Annotated[list[Path], typer.Argument(metavar="LOG", show_default=False)]
