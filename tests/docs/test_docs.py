"""The docs build without a warning, and what they tell people to type is there."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer

from urdyn.cli.app import app
from urdyn.identify.excite.cell_file import cell_of
from urdyn.model.arm import load_arm
from urdyn.model.cell import SIZES
from urdyn.report.fleet.gather import STATES
from urdyn.report.fleet.page import BADGE
from urdyn.simulate.tool import tool_pose
from urdyn.types import NORMAL90

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
READMES = [ROOT / "README.md", ROOT / "identification" / "README.md"]
BLOCK = re.compile(r"^```(sh|python)(.*?)\n(.*?)^```", re.S | re.M)
BESIDE = "in another terminal"
INLINE = re.compile(r"`(urdyn [a-z][^`]*)`")
RUN = (  # the rest: minutes
    "tutorials/integrator.md",
    "howto/faults.md",
    "howto/rules.md",
    "reference/inference.md",
    "reference/signal.md",
)


def blocks(page: Path) -> list[tuple[str, str, str]]:
    """Language, title and text of every block that can be run."""
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def commands(page: Path) -> list[list[str]]:
    """Every call of ours on a page, as words."""
    lines = [line for kind, _, body in blocks(page) if kind == "sh" for line in body.splitlines()]
    lines += INLINE.findall(page.read_text(encoding="utf-8"))
    words = [shlex.split(line.partition(">")[0].removesuffix("&")) for line in lines]
    return [w[w.index("urdyn") + 1 :] for w in words if "urdyn" in w]


def test_the_docs_build_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs")
    done = subprocess.run(
        (sys.executable, "-m", "mkdocs", "build", "--strict", "-d", tmp_path),
        cwd=ROOT, capture_output=True, text=True, check=False,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    # What the browser asks for is in the folder.
    front = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert not re.search(r'<(script|link)[^>]+(src|href)="https?://', front)
    model = (tmp_path / "reference" / "model" / "index.html").read_text(encoding="utf-8")
    assert "joint torque per motor ampere of a new drive" in model  # a field has its comment
    cited = (tmp_path / "mathematics" / "index.html").read_text(encoding="utf-8")
    sources = (tmp_path / "sources" / "index.html").read_text(encoding="utf-8")
    keys = re.findall(r'href="\.\./sources/#(\w+)"', cited)
    assert len(keys) > 10 and all(f'id="{key}"' in sources for key in keys)


def test_sources_are_in_the_order_of_their_keys():
    keys = re.findall(r"^\* \[(\w+)\]", READMES[0].read_text(encoding="utf-8"), re.M)
    assert keys and keys == sorted(keys)


@pytest.mark.parametrize("page", [*PAGES, *NOTEBOOKS], ids=lambda p: p.name)
def test_code_prints_a_90_per_cent_interval_after_plus_or_minus(page):
    halves = re.findall(r"± \{(.*?)[:}]", page.read_text(encoding="utf-8"))
    assert all(half.startswith(f"{NORMAL90:.3f} * ") for half in halves), halves


def test_every_page_is_in_the_navigation():
    told = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for page in PAGES:
        assert page.relative_to(ROOT / "docs").as_posix() in told


@pytest.mark.parametrize("page", [*READMES, *PAGES], ids=lambda p: p.relative_to(ROOT).as_posix())
def test_every_command_has_the_verb_and_the_options_it_is_shown_with(page):
    group = typer.main.get_command(app)
    for words in commands(page):
        verb = group
        while verb.__dict__.get("commands"):
            verb, words = verb.commands[words[0]], words[1:]
        known = {option for p in verb.params for option in p.opts} | {"--help"}
        assert {word for word in words if word.startswith("--")} <= known


def test_an_arm_on_a_ceiling_is_the_upright_one_with_gravity_turned_over(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    [body] = [b for kind, _, b in blocks(ROOT / "docs/howto/record.md") if kind == "python"]
    exec(body, {})
    upright, hung = load_arm("ur5e"), load_arm("ceiling.urdf")
    q, still = np.array([0.1, -0.5, 0.5, 0.2, 0.3, 0.0]), np.zeros(6)
    torque = upright.torque(q, still, still)
    np.testing.assert_allclose(hung.torque(q, still, still), -torque, atol=1e-9)
    assert np.abs(torque).max() > 10.0
    assert hung.pose(q)[2, 3] == pytest.approx(2.5 - upright.pose(q)[2, 3])
    np.testing.assert_allclose(tool_pose(hung, q[None]), tool_pose(upright, q[None]), atol=1e-9)


def test_a_cell_is_described_as_it_is_read():
    """What is said of places: a controller's Base has x and y reversed, solids have centres."""
    page = (ROOT / "docs/howto/excite.md").read_text(encoding="utf-8")
    [body] = re.findall(r"^```toml.*?\n(.*?)^```", page, re.S | re.M)
    cell, arm = cell_of(tomllib.loads(body)), load_arm("ur5e")
    assert {solid.shape for solid in cell.solids} == {*SIZES} and len(cell.walls) == 2
    [table] = [solid for solid in cell.solids if solid.name == "table"]
    assert table.xyz[2] == table.size[2] / 2.0  # it stands on the floor
    q = np.array([0.1, -0.5, 0.5, 0.2, 0.3, 0.0])
    np.testing.assert_allclose(
        tool_pose(arm, q[None])[0, :3], arm.pose(q)[:3, 3] * [-1.0, -1.0, 1.0], atol=1e-9
    )


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN)
def test_what_a_page_says_runs_in_an_empty_folder(page, tmp_path):
    tools = tmp_path / ".bin"
    tools.mkdir()
    ours = tools / "urdyn"
    ours.write_text(f'#!/bin/sh\nPYTHONPATH={ROOT} exec {sys.executable} -m urdyn "$@"\n')
    ours.chmod(0o755)
    path = {"PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    beside: list[subprocess.Popen[str]] = []
    try:
        for kind, title, body in blocks(ROOT / "docs" / page):
            shell = ("bash", "-e", "-c") if kind == "sh" else (sys.executable, "-c")
            process = subprocess.Popen(
                (*shell, f"exec {body}" if BESIDE in title else body), cwd=tmp_path, text=True,
                env=os.environ | path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            )  # fmt: skip
            if BESIDE in title:
                beside.append(process)
                assert "Ctrl-C ends it" in process.stdout.readline()
            else:
                told, _ = process.communicate()
                assert process.returncode == 0, f"{body}\n{told}"
    finally:
        for process in beside:
            process.terminate()
            process.communicate()


def test_every_state_of_a_robot_in_a_fleet_is_explained():
    page = (ROOT / "docs" / "tutorials" / "maintenance.md").read_text(encoding="utf-8")
    explained = re.findall(r"^\| ([^|]+) \|", page, re.M)
    for state in STATES:
        badge = BADGE.get(state, state)
        assert any(re.search(rf"\b{badge}\b", words) for words in explained), badge
