"""Options of `urdyn simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

OutLog = Annotated[
    Path | None,
    typer.Option("--out", metavar="LOG", help="Where to write it: .csv, .csv.gz, ..., .parquet."),
]
Duration = Annotated[float, typer.Option(metavar="S", help="Length of a random motion.")]
SampleRate = Annotated[float, typer.Option(metavar="HZ", help="Sample rate, 500 at most.")]
Seed = Annotated[int, typer.Option(min=0, help="The same seed makes the same arm and noise.")]
Run = Annotated[int, typer.Option(min=0, help="Another motion and other noise of that arm.")]
Motion = Annotated[
    Literal["fourier", "point_to_point", "pick_and_place", "shift"],
    typer.Option(metavar="KIND", help="fourier, point_to_point, pick_and_place or shift."),
]
TrajectoryFile = Annotated[
    Path | None,
    typer.Option("--trajectory", help="CSV of t, q0, ... in s and rad, to follow in its place."),
]
TwinFile = Annotated[
    Path | None, typer.Option("--twin", help="Simulate this identified arm, not a random one.")
]
Mass = Annotated[float | None, typer.Option(metavar="KG", help="Mass of a payload at the tool.")]
Com = Annotated[
    str | None, typer.Option(metavar="X,Y,Z", help="Its centre of mass from the flange, in metres.")
]
Faults = Annotated[
    list[str] | None,
    typer.Option(
        "--fault",
        metavar="KIND:...",
        help="What befalls the arm, as in the example; several at once by several --fault. A kind "
        "alone tells what it needs, a wrong one which there are.",
    ),
]
Heat = Annotated[bool, typer.Option("--heat", help="Joints begin cold and warm up by their work.")]
Deviations = Annotated[
    bool, typer.Option("--deviations", help="Joints are where a real arm's are, not as drawn.")
]
Noise = Annotated[
    str,
    typer.Option(
        metavar="real|white|SCALE",
        help="real: coloured, with steps of temperature and the wrench; a number: times the usual "
        "white noise; 0: perfect sensors.",
    ),
]
RecorderKind = Annotated[
    Literal["exact", "polling", "several_rates"],
    typer.Option(
        "--recorder",
        metavar="KIND",
        help="exact; polling: rows repeat, are torn and lost; several_rates: NaN between samples.",
    ),
]
Truth = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Write what the arm truly is, and becomes: .json, .toml, or .parquet with a .json.",
    ),
]
Watched = Annotated[
    Path | None,
    typer.Option(
        "--poses", metavar="FILE", help="Write what a laser tracker sees meanwhile, as CSV."
    ),
]
PoseRate = Annotated[float, typer.Option(metavar="HZ", help="Poses a second that it measures.")]
FidelityName = Annotated[
    Literal["inverse", "forward", "elastic"],
    typer.Option(
        "--fidelity",
        metavar="KIND",
        help="inverse: the current that the motion takes; forward: a closed loop, tick by tick; "
        "elastic: the same with gears that give.",
    ),
]
Serve = Annotated[
    bool,
    typer.Option(
        "--serve",
        help="Be an RTDE controller whose arm repeats its motion, and goes back where that "
        "does not end as it began; noise is new in every round, heat and faults go on.",
    ),
]
Host = Annotated[str, typer.Option(metavar="ADDRESS", help="Where to serve.")]
Port = Annotated[
    int, typer.Option(metavar="N", min=0, max=65535, help="Where to serve; 0: any free port.")
]
