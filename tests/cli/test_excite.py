"""urdyn excite, as users call it."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import urdyn as ud
from urdyn.cli.app import app
from urdyn.errors import InputError
from urdyn.identify.excite.cell_file import cell_of, document_of
from urdyn.io import dump_toml, sha256
from urdyn.model.body import about_frame

FILES = {
    "excitation.csv",
    "excitation.script",
    "excitation.yaml",
    "excitation.toml",
    "report.html",
}
CELL = """
floor = -0.5
[[wall]]
name = "back wall"
point = [-0.9, 0.0, 0.0]
normal = [1.0, 0.0, 0.0]
[[box]]
name = "table"
size = [0.4, 0.4, 0.2]
xyz = [0.9, 0.9, -0.4]
"""
UR5 = ("--robot", "ur5", "--out", "o")


def run(*arguments: object):
    return CliRunner().invoke(app, [str(x) for x in arguments])


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("excite")
    cell = folder / "cell.toml"
    cell.write_text(CELL)
    small = ("--duration", 6, "--harmonics", 2, "--restarts", 1, "--processes", 1)
    where = ("--cell", cell, "--payload-mass", 2.0)
    out = folder / "out"
    told = run("excite", "--robot", "ur5", *small, *where, "--out", out, "--json", "--seed", 3)
    assert told.exit_code == 0, told.output
    return out, json.loads(told.stdout)


def test_all_files_are_there_and_say_the_same(done):
    out, told = done
    assert {path.name for path in out.iterdir()} == FILES
    rows = np.genfromtxt(out / "excitation.csv", delimiter=",", names=True)
    assert len(rows) == told["rows"] == 6 * 125  # a CB3 controller's rate
    document = tomllib.loads((out / "excitation.toml").read_text())
    assert document["robot"]["name"] == told["robot"] == "ur5"
    assert document["payload"]["mass"] == 2.0
    assert document["proven"]["clearance"] == told["proof"]["clearance_m"] >= 0.02
    assert [box["name"] for box in document["cell"]["box"]] == ["table"]
    assert [tool["name"] for tool in document["cell"]["tool"]] == ["payload"]


def test_the_numbers_tell_what_the_run_adds(done):
    _, told = done
    assert all(share <= 1.0 for share in told["proof"]["shares"].values())
    assert [link["name"] for link in told["links"]][-1] == "payload_0"
    for joint in told["joints"]:
        assert joint["coulomb"]["sd_after"] < joint["coulomb"]["sd_before"]


def test_the_page_shows_the_motion_and_both_spreads(done):
    out, _ = done
    page = (out / "report.html").read_text()
    for words in ("UR5 · excitation", "Pose over time", "Velocities", "sd before → after", "10 %"):
        assert words in page
    # Angles, velocities and accelerations go both ways up to their limits, torques are magnitudes.
    assert page.count('"y0":100.0') == 4 and page.count('"y0":-100.0') == 3
    assert "https://" not in page.split("<script>")[0]


def test_a_motion_that_was_found_is_proven_and_written_again(done, tmp_path):
    out, _ = done
    again = run("excite", out / "excitation.toml", "--out", tmp_path / "again", "--json")
    assert again.exit_code == 0, again.output
    for name in ("excitation.csv", "excitation.script", "excitation.yaml", "excitation.toml"):
        assert (tmp_path / "again" / name).read_bytes() == (out / name).read_bytes(), name


@pytest.mark.parametrize("name", ["excitation.toml", "excitation.csv"])
def test_a_virtual_arm_makes_the_motion(done, tmp_path, name):
    out, _ = done
    log = tmp_path / "run.csv"
    how = ("--rate", 125, "--noise", 0, "--out", log)
    done_so = run("simulate", "--robot", "ur5", "--trajectory", out / name, *how)
    assert done_so.exit_code == 0, done_so.output
    rows = np.genfromtxt(out / "excitation.csv", delimiter=",", names=True)
    lived = ud.read(log).joint("actual_q")
    np.testing.assert_allclose(lived[: len(rows), 2], rows["q2"], atol=1e-6)


def test_a_motion_that_meets_a_box_is_refused_and_nothing_is_written(done, tmp_path):
    out, _ = done
    text = (out / "excitation.toml").read_text()
    q = np.genfromtxt(out / "excitation.csv", delimiter=",", names=True)
    arm = ud.load_arm("ur5")
    x, y, z = arm.pose(np.array([q[f"q{j}"][300] for j in range(6)]))[:3, 3]
    inside = text.replace("xyz = [0.9, 0.9, -0.4]", f"xyz = [{x}, {y}, {z}]")
    assert inside != text
    (tmp_path / "moved.toml").write_text(inside)
    told = run("excite", tmp_path / "moved.toml", "--out", tmp_path / "none")
    assert told.exit_code == 1
    assert "not proven safe" in told.output
    assert "table" in told.output
    assert len(told.output.strip().splitlines()) == 1
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[box]]\nsize = [1, 1, 1]\n", "no name"),
        ("[[box]]\nname = 'b'\nsize = [1, 1]\n", "3 numbers"),
        ("[[box]]\nname = 'b'\nsize = [1, -1, 1]\n", "above zero"),
        ("[[box]]\nname = 'b'\nsize = [1, 1, 1]\nxyz = [nan, 0, 0]\n", "metres"),
        ("[[wall]]\nname = 'w'\npoint = [0, 0, 0]\nnormal = [0, 0, 0]\n", "points nowhere"),
        ("[[sofa]]\nname = 's'\n", "unknown key 'sofa'"),
        ("floor = true\n", "1 numbers"),
        ("[[tool]]\nname = 't'\n", "shape"),
        ("[[tool]]\nname = 't'\nshape = ['box']\n", "[[tool]] 1: shape"),
        ("[[ball]]\nname = 'b'\nsize = [1]\n[[ball]]\nname = 'b'\nsize = [1]\n", "two things"),
        ("floor = ", "not TOML"),
    ],
)
def test_a_cell_that_is_wrong_is_told_in_one_line(tmp_path, text, words):
    (tmp_path / "cell.toml").write_text(text)
    told = run(
        "excite", "--robot", "ur5", "--cell", tmp_path / "cell.toml", "--out", tmp_path / "o"
    )
    assert told.exit_code == 1
    assert words in told.output
    assert "cell.toml" in told.output
    assert len(told.output.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("options", "status", "words"),
    [
        (("--robot", "ur5"), 2, "--out"),
        (("--out", "o"), 2, "--robot"),
        (("--robot", "ur5", "--out", "o", "--kind", "probe"), 2, "--joint"),
        (("--robot", "ur5", "--out", "o", "--kind", "probe", "--joint", "knee"), 1, "no joint"),
        (
            ("--robot", "ur5", "--out", "o", "--kind", "probe", "--joint", "1", "--duration", 9),
            1,
            "20",
        ),
        (("--robot", "ur5", "--out", "o", "--velocity", 2), 1, "--velocity"),
        (("--robot", "ur5", "--out", "o", "--acceleration", 14), 1, "the maker allows 13.96"),
        (("--robot", "ur5", "--out", "o", "--interest", "knee"), 1, "known are"),
        (
            ("--robot", "ur5", "--out", "o", "--payload-mass", 90, "--duration", 6),
            1,
            "not proven safe",
        ),
    ],
)
def test_options_that_make_no_sense_are_told(tmp_path, monkeypatch, options, status, words):
    monkeypatch.chdir(tmp_path)
    quick = () if "probe" in options else ("--harmonics", 2, "--restarts", 1, "--processes", 1)
    told = run("excite", "--rate", 50, *quick, *options)
    assert told.exit_code == status, told.output
    assert words in told.output
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("pattern", "replacement"),
    [
        ("period = ", "period = -"),
        ("[motion]", "[notion]"),
        ("kind = ", "kine = "),
        ("name = \"ur5\"", "name = \"ur55\""),
        ("margin = 0.02", "margin = \"wide\""),
        ("velocity = [", "velocity = [1.0, "),
        ("middle = [", "middle = [nan, "),
    ],
)  # fmt: skip
def test_a_damaged_excitation_is_told_in_one_line(done, tmp_path, pattern, replacement):
    text = (done[0] / "excitation.toml").read_text()
    assert pattern in text
    (tmp_path / "bad.toml").write_text(text.replace(pattern, replacement, 1))
    told = run("excite", tmp_path / "bad.toml", "--out", tmp_path / "o")
    assert told.exit_code == 1
    assert "unexpected" not in told.output
    assert len(told.output.strip().splitlines()) == 1
    assert not (tmp_path / "o").exists()


def test_a_probe_moves_its_joint_and_no_other(tmp_path):
    told = run(
        "excite", "--robot", "ur5e", "--kind", "probe", "--joint", "wrist 1", "--out", tmp_path
    )
    assert told.exit_code == 0, told.output
    rows = np.genfromtxt(tmp_path / "excitation.csv", delimiter=",", names=True)
    moved = [np.ptp(rows[f"q{j}"]) for j in range(6)]
    assert [x > 0.0 for x in moved] == [j == 3 for j in range(6)]
    assert "of the limits at most" in told.output


def test_what_adds_to_a_twin_says_to_which(story, tmp_path):
    twin = story.out / "twin.toml"
    probe = ("--kind", "probe", "--joint", "wrist 1")
    assert run("excite", "--twin", twin, *probe, "--out", tmp_path).exit_code == 0
    document = tomllib.loads((tmp_path / "excitation.toml").read_text())
    assert document["asked"]["twin"] == sha256(twin)


def test_what_adds_to_a_twin_is_proven_again_by_that_twin(story, tmp_path):
    """Its tool weighs on every torque: without it, or by another one, nothing is proven."""
    twin, found = tmp_path / "twin.toml", tmp_path / "found"
    fit = ud.Twin.load(story.out / "twin.toml").fit
    tool = about_frame(2.5, np.array([0.0, 0.0, 0.12]), 0.03 * np.eye(3))
    borne = replace(fit, dynamics=replace(fit.dynamics, payload=tool), tool_known=True)
    ud.Twin(fit.dynamics.arm, borne).save(twin)
    probe = ("--kind", "probe", "--joint", "wrist 1")
    assert run("excite", "--twin", twin, *probe, "--out", found).exit_code == 0
    again = ("excite", found / "excitation.toml", "--out", tmp_path / "again")
    assert "name it by --twin" in run(*again).output
    assert "is not the twin" in run(*again, "--twin", story.out / "twin.toml").output
    assert not (tmp_path / "again").exists()
    assert run(*again, "--twin", twin).exit_code == 0
    texts = [folder / "excitation.toml" for folder in (found, tmp_path / "again")]
    assert texts[0].read_bytes() == texts[1].read_bytes()


def test_a_cell_is_what_its_document_says():
    cell = cell_of(tomllib.loads(CELL))
    again = cell_of(tomllib.loads(dump_toml(document_of(cell))))
    assert [w.name for w in again.walls] == ["floor", "back wall"]
    np.testing.assert_array_equal(again.solids[0].xyz, cell.solids[0].xyz)
    with pytest.raises(InputError, match=r"\[\[box\]\]"):
        cell_of({"box": 3})


def test_a_bench_beside_no_random_motion_is_a_usage_error() -> None:
    done = CliRunner().invoke(app, ["bench", "excite", "--random", "0"])
    assert done.exit_code == 2 and "--random" in done.stderr
