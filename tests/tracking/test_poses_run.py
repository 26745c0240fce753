"""Runs with a tracker's poses from a file: as a user has them, also where they are damaged."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner
from workshop import KilledError, assert_same, killed_at

import urdyn as ud
from urdyn.cli.app import app
from urdyn.cli.listening import listening
from urdyn.errors import InputError, LogError
from urdyn.identify.kinematics import calibrate
from urdyn.io import write
from urdyn.io.calibration_file import calibration_text
from urdyn.io.poses import read_pose_stream, read_poses
from urdyn.model.geometry.drawing import drawing_of
from urdyn.model.geometry.turns import places_of
from urdyn.signal import Causal, samples
from urdyn.simulate.watched import watched
from urdyn.tracking import QUICKER, Tracker, open_source, run
from urdyn.tracking.streams.of_source import WATCHED, beside, pose_stream, with_poses
from urdyn.types import Gaussian, Log


@pytest.fixture(scope="module")
def poses(workshop, tmp_path_factory):
    """What a tracker sees of the workshop's arm at work, at 10 Hz."""
    path = tmp_path_factory.mktemp("poses") / "poses.csv"
    log, rng = workshop.log, np.random.default_rng(1)
    seen = watched(workshop.fit.dynamics, log.t, log.channels["actual_q"], 10.0, rng)
    write(seen, path)
    return path


def tracked(workshop, source, out):
    streams = beside(workshop.fit.dynamics.arm, source, tracked=True)
    tracker = Tracker(workshop.fit, QUICKER["simplified"], source.period, WATCHED, streams=streams)
    return run(tracker, source, out)


@pytest.mark.slow
def test_a_run_with_poses_that_is_killed_goes_on(workshop, poses, tmp_path):
    source = with_poses(open_source(str(workshop.recording), duration=11.0), poses)
    whole = tracked(workshop, source, tmp_path / "whole")
    with pytest.raises(KilledError):
        tracked(workshop, killed_at(source, 1050), tmp_path / "parts")
    again = tracked(workshop, source, tmp_path / "parts")
    assert_same(tmp_path / "parts", tmp_path / "whole")
    assert again["final"] == whole["final"]
    told = whole["final"]["kinematics.elbow_joint.a"]
    assert told["unit"] == "m" and abs(told["mean"]) < 5.0 * told["sd"] < 1e-3
    table = pq.read_table(tmp_path / "whole" / "history.parquet")
    unknown = np.isnan(table["kinematics.elbow_joint.a"].to_numpy())
    assert unknown[0] and not unknown[-1]


def test_rows_of_a_pose_file_are_read_at_any_width(poses, tmp_path):
    rows, _ = read_pose_stream(poses)
    assert rows.shape[1] == 7 and (np.diff(rows[:, 0]) > 0.0).all()
    few = Log(rows[:, 0], {name: 1e3 * rows[:, k + 1] for k, name in enumerate("xyz")})
    write(few, tmp_path / "places.csv")
    again, _ = read_pose_stream(tmp_path / "places.csv")
    # Numbers beyond any room's size are millimetres; where no angles were measured there are none.
    np.testing.assert_allclose(again[:, 1:4], rows[:, 1:4], rtol=1e-12)
    assert np.isnan(again[:, 4:]).all()


def test_a_pose_file_without_a_clock_is_refused(tmp_path):
    (tmp_path / "poses.csv").write_text("x,y,z\n1,2,3\n2,3,4\n")
    with pytest.raises(LogError, match="timestamp"):
        read_pose_stream(tmp_path / "poses.csv")


def test_a_log_with_none_but_the_controllers_pose_is_told_how_that_is_taken(tmp_path):
    heads = ",".join(f"actual_TCP_pose_{k}" for k in range(6))
    (tmp_path / "log.csv").write_text(f"timestamp,{heads}\n0,1,2,3,4,5,6\n")
    with pytest.raises(LogError, match="own pose is --poses own") as refused:
        read_pose_stream(tmp_path / "log.csv")
    assert "no actual_TCP_pose" not in str(refused.value)


def test_poses_from_a_file_go_with_a_log(workshop, poses):
    live = replace(open_source(str(workshop.recording)), live=True)
    with pytest.raises(InputError, match="live"):
        with_poses(live, poses)


def test_poses_by_another_clock_are_refused_in_a_line(workshop, poses, tmp_path):
    rows, _ = read_pose_stream(poses)
    late = tmp_path / "late.csv"
    write(Log(rows[:, 0] + 1e3, {name: rows[:, k + 1] for k, name in enumerate("xyz")}), late)
    words = (
        "track",
        workshop.twin,
        workshop.recording,
        "--out",
        tmp_path / "run",
        "--rows",
        "0:90",
    )
    done = command(*words, "--poses", late, "--mode", "realtime", "--no-diagnosis")
    assert done.exit_code == 1 and len(done.stderr.strip().splitlines()) == 1
    assert "one clock" in done.stderr and "late.csv" in done.stderr
    assert not (tmp_path / "run" / "history.parquet").exists()


def test_poses_that_are_of_no_arm_like_this_are_told_to_tell_nothing(
    workshop, poses, tmp_path, monkeypatch
):
    monkeypatch.setattr("urdyn.report.track.apart.draw", lambda *of: 1.0)
    rows, _ = read_pose_stream(poses)
    sides = dict(zip("xyz", rows[:, 1:4].T * [[-1.0], [1.0], [1.0]], strict=True))
    write(Log(rows[:, 0], sides), tmp_path / "mirrored.csv")
    words = ("track", workshop.twin, workshop.recording, "--out", tmp_path / "run")
    how = ("--rows", "0:500", "--mode", "realtime", "--no-diagnosis")
    done = command(*words, *how, "--poses", tmp_path / "mirrored.csv")
    assert done.exit_code == 0 and "leave --poses out" in done.stderr
    assert "leave --poses out" not in command(*words, *how, "--poses", poses, "--fresh").stderr


def test_who_goes_on_begins_with_the_same_calibration(workshop, poses, tmp_path):
    of, source = workshop.fit.dynamics, open_source(str(workshop.recording))
    form, files = drawing_of(of.arm).form, [tmp_path / f"{name}.yaml" for name in "abc"]
    for path, sd in zip(files, (0.0, 1e-3, 0.0), strict=True):
        built = sd * np.random.default_rng(3).standard_normal(len(form.names))
        path.write_text(calibration_text(places_of(form.table(built))))
    a, b, c = (listening(source, of, str(poses), False, path)[0].identity for path in files)
    assert a == c != b


def command(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_from_the_command_line(workshop, poses, tmp_path):
    out = tmp_path / "run"
    words = ("track", workshop.twin, workshop.recording, "--out", out, "--rows", "0:500")
    done = command(*words, "--poses", poses, "--mode", "realtime", "--no-diagnosis", "--json", "-q")
    assert done.exit_code == 0, done.stderr
    final = json.loads(done.stdout)["final"]
    for joint in workshop.fit.dynamics.arm.joint_names:
        told = final[f"{joint}.zero"]
        assert abs(told["mean"]) < 3.0 * told["sd"] and told["sd"] < 5e-4
    assert final["kinematics.base.x"]["sd"] < 1e-3
    page = (out / "report.html").read_text()
    assert "Geometry" in page and "tracker beside the arm" in page


@pytest.mark.parametrize(
    "asked, said",
    [
        (("--poses", "nowhere.csv"), "cannot be read"),
        (("--calibration", "nowhere"), "--poses"),
        (("--wrench",), "actual_TCP_force"),
    ],
)
def test_what_cannot_be_had_is_said_in_a_line(workshop, tmp_path, asked, said):
    out = tmp_path / "run"
    done = command("track", workshop.twin, workshop.recording, "--out", out, *asked)
    assert done.exit_code == 1
    assert said in done.stderr and len(done.stderr.strip().splitlines()) == 1
    assert not (out / "history.parquet").exists()


def test_the_controllers_poses_of_a_real_log_are_those_of_its_calibration(recordings):
    """Sample by sample, as `urdyn calibrate` has it from the whole log."""
    arm, path = ud.load_arm("ur3e"), recordings / "ur3e_rtde" / "ur3e_payload_1070g.csv"
    stream, causal = pose_stream(arm, True), Causal(0.04)
    sights, state, nothing = stream.init(), causal.init(6), Gaussian(np.zeros(0), np.zeros((0, 0)))
    for sample in samples(ud.read(path)):
        state, now = causal.step(state, sample)
        if now is not None:
            sights, _ = stream.take(sights, now, sample.beside["pose"][0], nothing)
    mean, sd = stream.estimates(sights)
    batch = calibrate(arm, read_poses(path, arm.joint_names)).geometric.placement.deviations
    assert (np.abs(mean[:22] - batch) < 3.0 * sd[:22]).all()
    # Lengths to 20 um, but for what the tool does as well.
    lengths = [k for k, name in enumerate(stream.names[:20]) if name[-2:] in (".a", ".d")]
    assert sd[lengths].max() < 2e-5
