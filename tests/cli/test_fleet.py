"""urdyn fleet, on folders that `urdyn track` wrote."""

import json
import shutil

import pytest
from story import without_pages
from typer.testing import CliRunner

from urdyn.cli.app import app
from urdyn.version import __version__


def run(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.fixture(scope="module")
def tracked(story, tmp_path_factory):
    out = tmp_path_factory.mktemp("fleet") / "cell"
    command = ("track", story.out / "twin.toml", story.held_out, "--rows", "0:400", "--out", out)
    with without_pages():
        assert run(*command, "--filter", "ekf", "-q").exit_code == 0
    return out


def test_a_tracked_folder_is_on_the_page_and_in_the_json(tracked, tmp_path):
    page = tmp_path / "new" / "fleet.html"
    told = run("fleet", tracked, tmp_path / "absent", "--out", page, "--json")
    assert told.exit_code == 0, told.stderr
    document = json.loads(told.stdout)
    assert [r["name"] for r in document["robots"]] == ["cell"]
    assert document["unread"] == [{"folder": str(tmp_path / "absent"), "reason": "does not exist"}]
    assert "not read" in told.stderr and "counted from the first stamp of each run" in told.stderr
    assert page.read_text().count("<svg") == 12
    assert document["urdyn"] == __version__ and f">urdyn {__version__}<" in page.read_text()


def test_a_folder_is_shown_by_its_own_name(tracked, tmp_path):
    odd = shutil.copytree(tracked, tmp_path / "[red]cell[")
    told = run("fleet", odd, "--out", tmp_path / "fleet.html")
    assert told.exit_code == 0 and "[red]cell[ " in told.stdout


def test_the_terminal_calls_states_what_the_page_calls_them(tracked, tmp_path):
    bare = shutil.copytree(tracked, tmp_path / "cell")
    (bare / "findings.json").unlink()
    told = run("fleet", bare, "--out", tmp_path / "fleet.html")
    assert "not diagnosed" in told.stdout and "undiagnosed" not in told.stdout


def test_nothing_to_show_is_one_line_and_no_page(tmp_path):
    told = run("fleet", tmp_path, "--out", tmp_path / "fleet.html", "-q")
    assert told.exit_code == 1
    assert told.stderr.count("\n") == 1 and "urdyn track" in told.stderr
    assert not (tmp_path / "fleet.html").exists()
    assert run("fleet", tmp_path, "--out", tmp_path / "fleet.html").stderr == told.stderr


def test_no_robot_s_page_becomes_the_fleet_s(tmp_path):
    (link := tmp_path / "link").symlink_to(tmp_path)
    (page := tmp_path / "report.html").write_text("its own")
    told = run("fleet", tmp_path, "--out", link / "report.html")
    assert told.exit_code == 1 and "own page; name another" in told.stderr
    assert page.read_text() == "its own"


def test_a_robot_that_is_named_twice_counts_once(tracked, tmp_path):
    again = tracked.parent / "." / tracked.name / ".." / tracked.name
    told = run("fleet", tracked, again, "--out", tmp_path / "fleet.html", "--json")
    assert len(json.loads(told.stdout)["robots"]) == 1
