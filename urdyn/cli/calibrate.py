"""urdyn calibrate: poses -> how the arm's geometry differs from its drawing."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import urdyn as ud
from urdyn.cli.asked import typed
from urdyn.cli.idle import idle
from urdyn.cli.options import Columns, Folder, Json, OneRobot, Quiet, Rows
from urdyn.cli.recording import slice_of
from urdyn.cli.voice import Voice, complaints

if TYPE_CHECKING:
    from urdyn.io.poses import Poses
    from urdyn.model.arm import Arm

PosesFile = Annotated[Path | None, typer.Argument(metavar="POSES", show_default=False)]
Evaluate = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Score the calibration in DIR, or a kinematics.yaml, on these poses; base and tool "
        "alone are fitted anew.",
    ),
]
Suggest = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        max=500,
        help="Print the N poses that would tell most, as CSV (DIR/poses.csv with --out); with "
        "POSES, most of what they leave open.",
    ),
]


def calibrate(
    context: typer.Context,
    robot: OneRobot,
    poses: PosesFile = None,
    out: Folder = None,
    evaluate: Evaluate = None,
    suggest: Suggest = None,
    columns: Columns = None,
    rows: Rows = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find out how an arm's geometry differs from its drawing, and how sure that is.

    POSES are static poses that a tracker measured beside the joint angles (CSV; positions alone
    will do), or an RTDE log with actual_q and actual_TCP_pose. A kinematics.yaml of UR's ROS driver
    is checked, and told as URDF and as the controller's DH deltas.

    Example: [bold]urdyn calibrate tracker.csv --robot ur10 --out geometry/[/bold]
    """
    voice = Voice(json, quiet)
    arm = ud.load_arm(robot)
    if poses is None:
        if suggest is None or evaluate is not None:
            raise typer.BadParameter("missing: POSES, or --suggest N to learn which to measure")
        idle(context, "without POSES", "columns", "rows")
        return _suggest(arm, suggest, out, voice)
    if poses.suffix.lower() in (".yaml", ".yml"):
        idle(context, f"with {poses}", "evaluate", "suggest", "columns", "rows")
        return _exchange(arm, poses, out, voice)
    read = _read(poses, arm, columns, rows)
    if evaluate is not None:
        idle(context, "with --evaluate", "suggest")
        return _evaluate(arm, read, evaluate, out, voice)
    if out is None:
        raise typer.BadParameter("missing: name a folder", param_hint="--out")
    return _calibrate(arm, read, out, suggest, voice)


def _read(path: Path, arm: Arm, columns: str | None, rows: str | None) -> Poses:
    from urdyn.io.poses import read_poses

    part = slice_of(rows) if rows is not None else None
    return read_poses(path, arm.joint_names, columns=columns, rows=part)


def _calibrate(arm: Arm, poses: Poses, out: Path, suggest: int | None, voice: Voice) -> None:
    """Calibrate, save, print."""
    from urdyn.cli.calibrate_results import FILES, as_csv, save, suggested
    from urdyn.cli.results import require_folder
    from urdyn.identify.kinematics import calibrate
    from urdyn.io import write_text
    from urdyn.report.calibrate.page import calibrate_page
    from urdyn.report.calibrate.summary import calibrated
    from urdyn.report.calibrate.tables import calibrate_table, calibrate_words

    require_folder(out)
    begin = time.perf_counter()
    with voice.progress("fitting") as progress:
        found = calibrate(arm, poses, progress)
        summary = calibrated(found, time.perf_counter() - begin)
        progress("writing", 0.95)
        save(found, calibrate_page(found, summary, typed()), out)
    voice.note(*complaints(poses.source.path, poses.defects))
    voice.show(calibrate_table(found), *calibrate_words(found, summary))
    written = [*FILES]
    if suggest is not None:
        write_text(out / "poses.csv", as_csv(arm, suggested(found, suggest)))
        written.append("poses.csv")
    voice.note(f"written to {out}: {', '.join(written)}")
    voice.result(summary)


def _evaluate(arm: Arm, poses: Poses, folder: Path, out: Path | None, voice: Voice) -> None:
    """Score an earlier calibration, print."""
    from urdyn.cli.results import require_folder
    from urdyn.identify.kinematics import evaluate, load_calibration
    from urdyn.io import write_folder
    from urdyn.report.calibrate.page import evaluate_page
    from urdyn.report.calibrate.summary import evaluated
    from urdyn.report.calibrate.words import evaluated_answer

    if out is not None:
        require_folder(out)
    recorded = load_calibration(folder, arm)
    begin = time.perf_counter()
    with voice.progress("fitting base and tool"):
        found = evaluate(arm, poses, recorded)
    summary = evaluated(found, time.perf_counter() - begin)
    voice.note(*complaints(poses.source.path, poses.defects))
    if recorded.sha256 == poses.source.sha256:
        voice.note("these are the poses that the calibration was made from; others would judge it")
    voice.show(evaluated_answer(found))
    if out is not None:
        write_folder(out, {"evaluation.html": evaluate_page(found, summary, folder, typed())})
        voice.note(f"written to {out}: evaluation.html")
    voice.result(summary)


def _exchange(arm: Arm, path: Path, out: Path | None, voice: Voice) -> None:
    """A factory calibration in other forms."""
    from urdyn.cli.calibrate_results import exchange
    from urdyn.cli.results import require_folder
    from urdyn.identify.kinematics.record import factory

    if out is None:
        raise typer.BadParameter("missing: name a folder", param_hint="--out")
    require_folder(out)
    told = exchange(arm, factory(path, arm), path, out)
    voice.note(f"written to {out}: kinematics.yaml, calibrated.urdf")
    voice.result(told)


def _suggest(arm: Arm, count: int, out: Path | None, voice: Voice) -> None:
    """Poses for a first session."""
    import numpy as np

    from urdyn.cli.calibrate_results import as_csv
    from urdyn.cli.results import require_folder
    from urdyn.identify.kinematics import most_informative
    from urdyn.identify.kinematics.calibration import drawn
    from urdyn.io import write_folder
    from urdyn.model.geometry.drawing import drawing_of

    if out is not None:
        require_folder(out)
    start = drawn(arm, drawing_of(arm))
    with voice.progress("choosing poses"):
        q = most_informative(arm, start, count, np.random.default_rng(0))
    if out is not None:
        write_folder(out, {"poses.csv": as_csv(arm, q)})
        voice.note(f"written to {out}: poses.csv")
    else:
        voice.data(as_csv(arm, q))
    voice.result({"robot": arm.name, "joints": list(arm.joint_names), "poses": q.tolist()})
