"""urdyn calibrate as users call it: poses in, files and one JSON object out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from deltas import table_of
from scipy.spatial.transform import Rotation
from story import urdyn
from typer.testing import CliRunner, Result

from urdyn.cli.app import app
from urdyn.io.calibration_file import calibration_text, read_calibration
from urdyn.model.arm import load_arm
from urdyn.model.geometry.chain_pose import flange
from urdyn.model.geometry.dh import Deltas
from urdyn.model.geometry.drawing import drawing_of
from urdyn.model.geometry.turns import exponential, places_of
from urdyn.types import Array

KEYS = {"n", "rms_mm", "p95_mm", "rms_mrad", "nominal_rms_mm", "rank", "parameters"}


def calibrate(*arguments: object) -> Result:
    """The verb, in this process."""
    return CliRunner().invoke(app, ["calibrate", *map(str, arguments)])


def written(path: Path, table: Array, seed: int, count: int = 80) -> Path:
    """A tracker's session with decimal commas."""
    arm, rng = load_arm("ur10"), np.random.default_rng(seed)
    q = rng.uniform(-2.8, 2.8, (count, 6))
    base, tool = exponential(rng.uniform(-2, 2, 6)), exponential(0.1 * rng.standard_normal(6))
    pose = base @ flange(table, q) @ tool
    place = 1e3 * pose[:, :3, 3] + 0.01 * rng.standard_normal((count, 3))
    turn = Rotation.from_matrix(pose[:, :3, :3]).as_euler("XYZ", degrees=True)
    places, turns = ([f"measurement_{a}{x}" for x in "xyz"] for a in ("", "r"))
    heads = ["Timestamp", *arm.joint_names, *places, *turns]
    rows = np.column_stack([np.arange(count), q, place, turn])
    lines = [";".join(f"{x:.9f}" for x in row).replace(".", ",") for row in rows]
    path.write_text("\n".join([";".join(heads), *lines]) + "\n")
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, dict[str, object]]:
    """A session, the folder of its calibration, and what was printed."""
    folder = tmp_path_factory.mktemp("calibrate")
    form = drawing_of(load_arm("ur10")).form
    table = form.table(1e-3 * np.random.default_rng(0).standard_normal(22))
    first = written(folder / "first.csv", table, 1)
    written(folder / "second.csv", table, 2, 40)
    run = urdyn("calibrate", first, "--robot", "ur10", "--out", folder / "out", "--json")
    assert run.returncode == 0, run.stderr
    (folder / "said.txt").write_text(run.stderr)
    return folder, folder / "out", json.loads(run.stdout)


def test_the_table_has_units(made: tuple[Path, Path, dict[str, object]]) -> None:
    said = (made[0] / "said.txt").read_text()
    assert (said.count("[mm]"), said.count("[mrad]")) == (2, 3)


def test_one_command_writes_every_form(made: tuple[Path, Path, dict[str, object]]) -> None:
    _, out, told = made
    assert told.keys() >= KEYS
    assert float(str(told["rms_mm"])) < 0.05 < 0.5 < float(str(told["nominal_rms_mm"]))
    names = {path.name for path in out.iterdir()}
    assert names == {"kinematics.yaml", "calibrated.urdf", "calibration.toml", "report.html"}
    frames = read_calibration(out / "kinematics.yaml")
    drawn = drawing_of(load_arm(out / "calibrated.urdf")).form.nominal
    np.testing.assert_allclose(places_of(drawn), frames, atol=1e-12)
    assert "sha256" in (out / "kinematics.yaml").read_text().splitlines()[0]


@pytest.mark.parametrize("what", ["out", "out/kinematics.yaml"])
def test_other_poses_score_it(
    made: tuple[Path, Path, dict[str, object]], what: str, tmp_path: Path
) -> None:
    folder, _, _ = made
    asked = ("--robot", "ur10", "--evaluate", folder / what, "--out", tmp_path, "--json")
    run = calibrate(folder / "second.csv", *asked)
    assert [path.name for path in tmp_path.iterdir()] == ["evaluation.html"]
    assert run.exit_code == 0, run.stderr
    told = json.loads(run.stdout)
    assert told.keys() >= KEYS
    assert told["rms_mm"] < 0.05
    assert told["nominal_rms_mm"] > 10.0 * told["rms_mm"]


def test_a_factory_calibration_is_told_in_other_forms(
    made: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    _, out, _ = made
    source = out / "kinematics.yaml"
    run = calibrate(source, "--robot", "ur10", "--out", tmp_path / "x", "--json")
    assert run.exit_code == 0, run.stderr
    told = json.loads(run.stdout)
    form = drawing_of(load_arm("ur10")).form
    table = table_of(form, Deltas(**{k: np.array(v) for k, v in told["dh_deltas"].items()}))
    frames = read_calibration(source)
    np.testing.assert_allclose(places_of(table), frames, atol=1e-12)
    np.testing.assert_allclose(
        read_calibration(tmp_path / "x" / "kinematics.yaml"), frames, atol=1e-12
    )
    drawn = drawing_of(load_arm(tmp_path / "x" / "calibrated.urdf")).form.nominal
    np.testing.assert_allclose(places_of(drawn), frames, atol=1e-12)


def test_poses_are_proposed_as_a_file_for_a_pipe() -> None:
    run = calibrate("--suggest", 5, "--robot", "ur3e")
    assert run.exit_code == 0, run.stderr
    heads, *rows = run.stdout.splitlines()
    assert heads.split(",") == list(load_arm("ur3e").joint_names)
    assert len(rows) == 5


def test_bad_input_is_one_line_and_no_file(
    made: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    folder, _, _ = made
    flipped = places_of(drawing_of(load_arm("ur10")).form.nominal)
    flipped[2, :3, :3] = np.diag([-1.0, 1.0, -1.0])
    (tmp_path / "kinematics.yaml").write_text(calibration_text(flipped))
    (tmp_path / "other.csv").write_text("a;b\n1;2\n")
    first, out = folder / "first.csv", tmp_path / "out"
    for arguments, reason in (
        ((first, "--evaluate", tmp_path / "kinematics.yaml"), "elbow_joint is turned by 180.0 deg"),
        ((first, "--evaluate", folder), "holds no calibration"),
        ((tmp_path / "other.csv", "--out", out), "shoulder_pan_joint"),
    ):
        run = calibrate(*arguments, "--robot", "ur10")
        assert run.exit_code == 1, run.stdout
        assert reason in run.stderr
        assert run.stderr.count("\n") == 1
        assert not out.exists()
    wrong = calibrate(first, "--robot", "ur5", "--out", out)
    assert wrong.exit_code == 1
    assert "no ur5 was there" in wrong.stderr
    assert not out.exists()
    assert calibrate(first, "--robot", "ur10").exit_code == 2
