"""urdyn track, on a recording."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace

import pyarrow.parquet as pq
import pytest
from story import without_pages
from typer.testing import CliRunner

import urdyn as ud
from urdyn.cli.app import app
from urdyn.cli.twin_file import load_fit
from urdyn.errors import InputError
from urdyn.io import alone, sha256


def tracked(*arguments):
    return CliRunner().invoke(app, ["track", *map(str, arguments)])


@pytest.fixture(scope="module")
def twin(story):
    return story.out / "twin.toml"


def test_a_recording_is_tracked(story, twin, tmp_path):
    told = tracked(twin, story.held_out, "--out", tmp_path, "--rows", "0:300", "--json")
    assert told.exit_code == 0, told.stderr
    summary = json.loads(told.stdout)
    assert summary["samples"] == 300
    assert (summary["filter"], summary["mode"]) == ("ukf", "full")
    assert set(summary["latency_ms"]) == {"p50", "p99", "max"}
    assert summary["final"]["payload.mass"]["unit"] == "kg"
    assert len(pq.read_table(tmp_path / "history.parquet")) > 25
    assert "<html" in (tmp_path / "report.html").read_text()


def test_a_quiet_run_says_nothing(story, twin, tmp_path):
    command = (twin, story.held_out, "--out", tmp_path, "-q", "--filter", "ekf", "--rows", "0:200")
    with without_pages():
        told = tracked(*command)
    assert (told.exit_code, told.stdout, told.stderr) == (0, "", "")


def test_a_finished_run_is_not_lost_to_another_log_unasked(story, twin, tmp_path):
    """Nor where it was not diagnosed; the same log is tracked again without asking.

    What somebody has acknowledged is known to the next run, whichever log's it is.
    """
    quick = ("--filter", "ekf", "--rows", "0:100", "--out", tmp_path)

    def ends(log, *more):
        told = tracked(twin, log, *quick, *more)
        said = "--fresh" in told.stderr and told.stderr.count("\n") == 1
        return told.exit_code, said

    history, findings = tmp_path / "history.parquet", tmp_path / "findings.json"
    with without_pages():
        assert ends(story.log, "--no-diagnosis") == ends(story.log) == (0, False)
        before = history.read_bytes(), findings.read_bytes()
        assert ends(story.held_out) == (1, True)
        assert (history.read_bytes(), findings.read_bytes()) == before
        findings.unlink()
        assert ends(story.held_out) == (1, True)
        (tmp_path / "acknowledged.json").write_text("{}")
        assert ends(story.log, "--no-diagnosis") == (0, False)
        assert ends(story.held_out, "--fresh", "--no-diagnosis") == (0, False)
        assert (tmp_path / "acknowledged.json").exists()


def test_logs_that_follow_each_other_are_one_run(story, twin, tmp_path):
    """The second's stamps begin anew: they count on, after a gap of a minute, which is no data."""
    log = ud.read(story.held_out)
    days = [tmp_path / "monday.parquet", tmp_path / "tuesday.parquet"]
    for day, path in enumerate(days):
        ud.write(log.slice(300 * day, 300 * day + 200), path)
    anew = ud.read(days[1])
    ud.write(replace(anew, t=anew.t - anew.t[0]), days[1])
    with without_pages():
        told = tracked(twin, *days, "--out", tmp_path, "--filter", "ekf", "--json")
    assert told.exit_code == 0, told.stderr
    summary = json.loads(told.stdout)
    assert summary["samples"] == 400
    assert summary["data_s"] == pytest.approx(log.t[199] - log.t[0] + anew.t[-1] - anew.t[0])
    provenance = json.loads((tmp_path / "findings.json").read_text())["provenance"]
    assert provenance["source.sha256"] == " ".join(map(sha256, days))


def test_a_run_that_is_never_in_contact_by_what_was_named_says_so(story, twin, tmp_path):
    quick = ("--out", tmp_path, "--filter", "ekf", "--no-diagnosis", "--rows", "0:20")
    with without_pages():
        told = tracked(twin, story.held_out, *quick, "--contact", "payload:5")
    assert told.exit_code == 0, told.stderr
    assert f"{story.held_out}: never in contact by payload:5: is it the right" in told.stderr


def test_a_robot_at_work_is_tracked_alone(story, twin, tmp_path):
    told = tracked(twin, story.log, "rtde://127.0.0.1:1", "--out", tmp_path)
    assert told.exit_code == 1 and "by itself" in told.stderr and told.stderr.count("\n") == 1


def test_who_tracks_holds_no_reader_of_tables_and_nothing_of_scipy(story, twin, tmp_path):
    """Its memory is promised: what reads and draws histories is in processes of its own."""
    options = ("--filter", "ekf", "--rows", "0:100", "--out", tmp_path, "-q")
    command = (
        sys.executable,
        "-X",
        "importtime",
        "-m",
        "urdyn",
        "track",
        twin,
        story.log,
        *options,
    )
    told = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
    assert "urdyn.tracking.step.change_detection" in told.stderr
    for heavy in ("pyarrow", "pandas", "scipy", "urllib.request"):
        assert heavy not in told.stderr


@pytest.mark.parametrize(
    "options",
    [
        ("absent.csv",),
        ("rtde://127.0.0.1:1",),
        ("rtde://127.0.0.1:nowhere",),
        ("ros9://joints",),
    ],
)
def test_a_source_that_cannot_be_tracked_is_told_in_one_line(twin, options, tmp_path):
    told = tracked(twin, *options, "--out", tmp_path, "--no-diagnosis")
    assert told.exit_code == 1
    assert told.stderr.startswith("urdyn: ") and told.stderr.count("\n") == 1


def test_a_broken_checkpoint_is_told_in_one_line(story, twin, tmp_path):
    (tmp_path / "checkpoint.npz").write_bytes(b"broken")
    told = tracked(twin, story.held_out, "--out", tmp_path)
    assert told.exit_code == 1
    assert told.stderr.count("\n") == 1 and "--fresh" in told.stderr


def test_nobody_is_told_of_a_run_whose_folder_another_writes_to(twin, tmp_path):
    """Or that one's arm would be offline to them, once this one has been refused."""
    told_to = ("--mqtt", "127.0.0.1:1", "--serial", "S1")  # where no broker answers
    with alone(tmp_path):
        told = tracked(twin, "rtde://127.0.0.1:1", "--out", tmp_path, *told_to)
    assert told.exit_code == 1 and "another urdyn is writing there" in told.stderr


def test_a_run_is_of_the_twin_that_it_read_though_another_takes_its_place(
    story, twin, tmp_path, monkeypatch
):
    mine, was, of = shutil.copy(twin, tmp_path / "twin.toml"), sha256(twin), []

    def replaced(path, *others):
        loaded = load_fit(path, *others)
        with mine.open("a") as file:
            file.write("# another")
        return loaded

    def begun(*_, twin_sha256, **__):
        of.append(twin_sha256)
        raise InputError("enough")

    monkeypatch.setattr("urdyn.tracking.run", begun)
    monkeypatch.setattr("urdyn.cli.track.load_fit", replaced)
    told = tracked(mine, story.held_out, "--out", tmp_path / "out", "--no-diagnosis")
    assert "enough" in told.stderr and of == [was] != [sha256(mine)]
    read = ud.Twin.load
    monkeypatch.setattr(ud.Twin, "load", lambda at: (read(at), shutil.copy(twin, mine))[0])
    with pytest.raises(InputError, match="was replaced while it was read"):
        load_fit(mine, ())


def test_a_payload_that_nobody_weighed_is_not_handed_over(story, twin, tmp_path):
    (tmp_path / "payload.script").write_text("set_payload(9, [0, 0, 0])")  # of the run before
    quick = ("--no-diagnosis", "--filter", "ekf", "--out", tmp_path, "--hand-over", "payload")
    told = tracked(twin, story.held_out, "--rows", "0:40", *quick)
    assert told.exit_code == 1 and "nothing to set a payload by" in told.stderr
    assert not (tmp_path / "payload.script").exists()
    with without_pages():
        told = tracked(twin, story.held_out, "--rows", "0:600", *quick)
    assert told.exit_code == 0, told.stderr
    line = (tmp_path / "payload.script").read_text()
    assert line.startswith("set_payload(0.0") and "beside the tool" in line
