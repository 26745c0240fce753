"""Options of `urdyn track`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

FILTERS = {
    "ukf": "UKF",
    "ekf": "EKF",
    "information": "InformationFilter",
    "particle": "ParticleFilter",
    "variational": "Variational",
}

TwinFile = Annotated[Path, typer.Argument(metavar="TWIN", show_default=False)]
SourceNames = Annotated[list[str], typer.Argument(metavar="SOURCE...", show_default=False)]
Out = Annotated[Path, typer.Option(metavar="DIR", help="Where the history is written.")]
FilterName = Annotated[
    Literal["ukf", "ekf", "information", "particle", "variational"] | None,
    typer.Option(
        "--filter",
        metavar="NAME",
        help=f"{', '.join(FILTERS)}; ukf if not given, ekf in quicker modes.",
    ),
]
ModeName = Annotated[
    Literal["full", "simplified", "realtime"],
    typer.Option(
        metavar="MODE",
        help="full, or quicker and linearised: simplified (drives independent, given "
        "the bodies), realtime (joints whose currents tell little are updated less often).",
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        metavar="HZ", help="Of a log without time stamps; or samples a second that a robot sends."
    ),
]
Duration = Annotated[
    float | None, typer.Option(metavar="S", help="Stop after so much of the source's time.")
]
Serial = Annotated[
    str,
    typer.Option(
        metavar="NUMBER",
        help="Serial number of the arm, for those who are told; --mqtt names its topics by it.",
    ),
]
Prometheus = Annotated[
    str | None,
    typer.Option(
        "--prometheus",
        metavar="[HOST:]PORT",
        help="Serve metrics; on this computer's loopback unless a host is named.",
    ),
]
Mqtt = Annotated[
    str | None, typer.Option("--mqtt", metavar="HOST[:PORT]", help="Tell an MQTT broker.")
]
Publish = Annotated[
    list[str] | None,
    typer.Option(
        "--publish",
        metavar="WHAT",
        help="What a controller may act on, with ros2://: feed_forward (torques), "
        "friction_scales; repeatable.",
    ),
]
HandOver = Annotated[
    list[str] | None,
    typer.Option(
        "--hand-over",
        metavar="WHAT",
        help="Write at the end, into DIR, for a controller: urdf, payload (a URScript line); "
        "repeatable.",
    ),
]
PosesFile = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|own",
        help="Poses to learn geometry and joints' zeros from: a tracker's, measured meanwhile "
        "(timestamp in s by the log's clock, x, y, z, and rx, ry, rz if it has them, at any rate); "
        "own: the controller's actual_TCP_pose, which tells its calibration.",
    ),
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="What the arm's geometry was: of `urdyn calibrate`, or a kinematics.yaml.",
    ),
]
Wrench = Annotated[
    bool,
    typer.Option(
        "--wrench", help="Weigh the payload by the force sensor too, where the source has one."
    ),
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Begin anew, whatever DIR holds.")]
