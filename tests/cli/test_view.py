"""urdyn view says in one line what it lacks; what it shows is tested where it is drawn."""

import importlib.util
import json
import shutil

import pyarrow.parquet as pq
import pytest
from story import without_pages
from typer.testing import CliRunner

from urdyn.cli.app import app
from urdyn.cli.campaign import read_campaign
from urdyn.cli.viewing import Asked, find
from urdyn.io import read, write


def view(*arguments):
    return CliRunner().invoke(app, ["view", *map(str, arguments)])


def refused(told) -> str:
    assert told.exit_code == 1, told.stdout
    assert told.stderr.startswith("urdyn: ") and told.stderr.count("\n") == 1
    return told.stderr


@pytest.fixture(scope="module")
def tracked(story, tmp_path_factory):
    folder = tmp_path_factory.mktemp("view")
    log, out = folder / "moved.parquet", folder / "monday"
    shutil.copy(story.held_out, log)
    command = ("track", story.out / "twin.toml", log, "--out", out, "--filter", "ekf", "-q")
    with without_pages():
        assert CliRunner().invoke(app, [*map(str, (*command, "--rows", "0:300"))]).exit_code == 0
    return log, out


@pytest.fixture(autouse=True)
def _extra(monkeypatch):
    """The extra need not be installed to be told what else is missing."""
    monkeypatch.setattr("urdyn.view.stage.require", lambda: None)


def test_without_the_extra_the_way_to_it_is_told(tracked, monkeypatch):
    monkeypatch.undo()
    real = importlib.util.find_spec
    without = lambda name, *rest: None if name == "viser" else real(name, *rest)  # noqa: E731
    monkeypatch.setattr("urdyn.view.stage.find_spec", without)
    assert "pip install -e '.[viewer]'" in refused(view(tracked[1], "--robot", "ur10e"))


def renamed(history, folder, robot: str | None, **other: str):
    """The history in a folder of its own, of another robot or of nobody knows which."""
    table = pq.read_table(history)
    key = b"urdyn.provenance"
    origin = json.loads(table.schema.metadata[key])
    del origin["robot"]
    told = (origin if robot is None else origin | {"robot": robot}) | other
    metadata = table.schema.metadata | {key: json.dumps(told).encode()}
    pq.write_table(table.replace_schema_metadata(metadata), folder / history.name)
    return folder


@pytest.mark.parametrize("robot", [None, "my own arm"])
def test_which_arm_it_is_has_to_be_said(tracked, story, tmp_path, robot):
    unknown = renamed(tracked[1] / "history.parquet", tmp_path, robot)
    for source in (unknown, story.held_out, "rtde://127.0.0.1:1"):
        assert "--twin" in refused(view(source))


def test_a_history_says_which_arm_it_is_of(tracked):
    found = find(Asked(str(tracked[1])))
    assert found.arm.name == "ur10e"


def test_the_log_is_asked_for_where_it_is_gone_or_another(tracked, story):
    log, out = tracked
    twin = ("--twin", story.out / "twin.toml")
    aside = log.rename(log.with_suffix(".aside"))
    assert "--log LOG" in refused(view(out, *twin))
    assert "is not the log" in refused(view(out, *twin, "--log", story.log))
    aside.rename(log)


def test_a_run_of_several_logs_is_shown_wherever_they_are(tracked, tmp_path):
    log = read(tracked[0], rows=(0, 300))
    parts = tmp_path / "first.parquet", tmp_path / "second.parquet"
    for part, rows in zip(parts, ((0, 100), (100, 300)), strict=True):
        write(log.slice(*rows), part)
    told = {"source": " ".join(map(str, parts)), "source.sha256": read(*parts).source.sha256}
    run = renamed(tracked[1] / "history.parquet", tmp_path, "ur10e", **told)
    assert find(Asked(str(run))).film.end == pytest.approx(log.t[-1] - log.t[0], abs=0.2)
    aside = tuple(part.rename(part.with_suffix(".aside")) for part in parts)
    assert "--log LOG" in refused(view(run))
    assert "is not the log" in refused(view(run, "--log", aside[1], "--log", aside[0]))
    assert find(Asked(str(run), logs=aside)).film is not None


def test_a_live_run_that_is_over_needs_a_recording_of_it(tracked, story, tmp_path):
    live = {"source": "rtde://192.168.0.10", "source.sha256": ""}
    over = renamed(tracked[1] / "history.parquet", tmp_path, "ur10e", **live)
    told = refused(view(over, "--twin", story.out / "twin.toml"))
    assert "is of rtde://192.168.0.10, which was live" in told and "`urdyn record`" in told
    assert find(Asked(str(over), logs=(tracked[0],), rows=(0, 300))).film is not None


def test_a_run_that_has_just_begun_does_not_say_what_it_is_of(tracked, story, tmp_path):
    parts = tmp_path / "history.parts"
    parts.mkdir()
    table = pq.read_table(tracked[1] / "history.parquet").replace_schema_metadata(None)
    pq.write_table(table, parts / "part-000000.parquet")
    told = refused(view(tmp_path, "--twin", story.out / "twin.toml"))
    assert "has just begun" in told and "log it is" not in told


def test_another_twin_is_refused(tracked, story, tmp_path):
    other = tmp_path / "twin.toml"
    other.write_text((story.out / "twin.toml").read_text() + "\n")
    assert "is not the twin" in refused(view(tracked[1], "--twin", other))


@pytest.mark.parametrize("source", ["absent.csv", "rtde://127.0.0.1:1", "rtde://127.0.0.1:nowhere"])
def test_a_source_that_is_not_there_is_told(source):
    refused(view(source, "--robot", "ur10e"))


def test_a_folder_without_a_history_is_told(tmp_path):
    assert str(tmp_path) in refused(view(tmp_path, "--robot", "ur5e"))


def test_what_is_not_there_is_not_asked_for_its_robot():
    assert "is no folder, log or rtde" in refused(view("absent"))


def test_a_run_is_not_shown_on_another_arm(tracked):
    assert "is of ur10e; leave --robot ur3 out" in refused(view(tracked[1], "--robot", "ur3"))


def test_a_run_of_an_arm_that_is_sold_anew_opens_as_that(tracked, tmp_path):
    run = renamed(tracked[1] / "history.parquet", tmp_path, "ur12e")
    assert find(Asked(str(run))).arm.name == "ur12e"
    assert "is of ur12e; leave --robot ur10e out" in refused(view(run, "--robot", "ur10e"))


def test_a_bag_folder_is_a_log(tracked, story, tmp_path):
    pytest.importorskip("rosbags", reason="the extra ros2 is not installed")
    bag, run = tmp_path / "bag", tmp_path / "run"
    run.mkdir()
    write(read(tracked[0], rows=(0, 300)), bag)
    told = {"source": str(bag), "source.sha256": read(bag).source.sha256}
    renamed(tracked[1] / "history.parquet", run, "ur10e", **told)
    campaign = tmp_path / "campaign.toml"
    campaign.write_text('robot = "ur10e"\n[[log]]\npath = "bag"')
    assert find(Asked(str(run))).film is not None
    assert find(Asked(str(bag), robot="ur10e")).film is not None
    assert read_campaign(campaign).logs[0].path == bag


def test_the_rate_of_a_log_without_stamps_can_be_said(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("\n".join([",".join(f"actual_q_{j}" for j in range(6)), *["0,0,0,0,0,0"] * 99]))
    assert "--rate" in refused(view(log, "--robot", "ur10e"))
    assert find(Asked(str(log), robot="ur10e", rate=49.0)).film.end == 2.0
