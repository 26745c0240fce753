"""Options of `urdyn excite`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

Again = Annotated[
    Path | None,
    typer.Argument(metavar="FILE", show_default=False),
]
All = Annotated[
    Path | None,
    typer.Option(
        "--all", metavar="DIR", help="DIR/ARM/excitation.toml of every arm of the library instead."
    ),
]
Duration = Annotated[float, typer.Option(metavar="S", help="Length of the motion.")]
Kind = Annotated[
    Literal["fourier", "probe", "poses"],
    typer.Option(
        help="fourier: everything at once; probe: one joint's friction and backlash; poses: slowly "
        "from pose to pose, for gravity.",
    ),
]
Joint = Annotated[
    str | None, typer.Option(metavar="NAME|J", help="Joint of a probe: elbow, or 2 counted from 0.")
]
Criterion = Annotated[
    Literal["D", "A", "E", "condition"],
    typer.Option(
        help="What is made small of what stays unknown: volume, mean variance, the worst "
        "direction, or the worst over the best.",
    ),
]
Interest = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAMES",
        help="What is to be learned, like 'payload' or 'elbow friction, gains'; all if not given.",
    ),
]
TwinFile = Annotated[
    Path | None,
    typer.Option("--twin", metavar="TWIN", help="What is known already; the motion adds to it."),
]
CellFile = Annotated[
    Path | None,
    typer.Option(
        "--cell",
        metavar="FILE",
        help="Floor, walls, boxes and the tool's shape: TOML, as in docs/howto/excite.md.",
    ),
]
Margin = Annotated[float, typer.Option(metavar="M", help="Metres kept from everything.")]
Mass = Annotated[float | None, typer.Option(metavar="KG", help="Mass of a payload at the tool.")]
Com = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z",
        help="Its centre of mass from the flange, in metres; 0,0,0.06 if not given.",
    ),
]
Excursion = Annotated[
    float | None, typer.Option(metavar="RAD", help="To either side of upright; 1.5 if not given.")
]
Velocity = Annotated[
    float | None, typer.Option(metavar="SHARE", help="Of the largest velocity; 0.9 if not given.")
]
Acceleration = Annotated[
    float | None, typer.Option(metavar="RAD/S2", help="Of every joint; 4 if not given.")
]
Rate = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="Of the controller; the robot's own if not given."),
]
Harmonics = Annotated[
    int | None, typer.Option(metavar="N", help="Of the Fourier series; several are tried.")
]
Restarts = Annotated[int, typer.Option(metavar="N", help="Random beginnings.")]
Processes = Annotated[int, typer.Option(min=1, help="Of them at a time; the result is the same.")]
Seed = Annotated[int, typer.Option(min=0, help="The same seed gives the same motion.")]
