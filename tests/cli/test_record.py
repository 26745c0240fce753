"""urdyn record, against a controller of our own on loopback."""

import json
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack

import numpy as np
import pytest
from story import DEAF
from typer.testing import CliRunner

import urdyn as ud
from urdyn.cli.app import app
from urdyn.io.rtde import play, serve

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once


@pytest.fixture(scope="module")
def log():
    return ud.simulate(ud.load_arm("ur5e"), 4.0, 500.0, seed=4)[0]


def recorded(log, out, *options):
    with serve(play(log, loop=True), port=0) as controller:
        command = ["record", f"127.0.0.1:{controller.port}", "--out", str(out), *options]
        return CliRunner().invoke(app, command)


def test_a_recording_holds_what_was_sent(log, tmp_path):
    out = tmp_path / "run.parquet"
    told = recorded(log, out, "--duration", "1.5", "--json")
    assert told.exit_code == 0, told.stderr
    document = json.loads(told.stdout)
    assert document["lost"] == document["torn"] == 0
    assert document["samples"] == pytest.approx(750, abs=10)
    read = ud.read(out)
    rows = np.searchsorted(log.t, read.t - 1e-6)
    np.testing.assert_array_equal(read.joint("actual_q"), log.joint("actual_q")[rows])
    np.testing.assert_array_equal(read.joint("actual_current"), log.joint("actual_current")[rows])


def test_a_recipe_file_says_what_is_recorded(log, tmp_path):
    recipe = tmp_path / "recipe.txt"
    recipe.write_text("actual_q\nactual_current\n")
    out = tmp_path / "run.csv"
    told = recorded(
        log, out, "--duration", "0.6", "--recipe", str(recipe), "--frequency", "125", "-q"
    )
    assert told.exit_code == 0, told.stderr
    assert told.stdout == ""
    header = out.read_text().splitlines()[0]
    assert "actual_q_0" in header and "target_q_0" not in header


def test_who_asks_for_a_rate_that_cannot_be_had_is_told_which_it_was(log, tmp_path):
    told = recorded(log, tmp_path / "run.csv", "--duration", "0.6", "--frequency", "300")
    assert "sent at 500 Hz, for 300 Hz cannot be had" in told.stderr
    told = recorded(log, tmp_path / "run.csv", "--duration", "0.6", "--frequency", "250")
    assert told.exit_code == 0 and "Hz cannot be had" not in told.stderr


def test_an_outage_is_told_by_how_long_nothing_came(log, tmp_path):
    with serve(play(log), port=0) as first, ExitStack() as later:

        def begin_again():
            first.close()
            time.sleep(1.0)
            later.enter_context(serve(play(log, loop=True), port=first.port))

        threading.Timer(1.5, begin_again).start()
        where = ("record", f"127.0.0.1:{first.port}", "--out", str(tmp_path / "run.csv"))
        told = CliRunner().invoke(app, [*where, "--duration", "6"])
    said = " ".join(told.stdout.split())
    assert "none lost while connected, none torn, 1 connection dropped and taken up" in said
    silent = float(re.search(r"nothing for ([0-9.]+) s while the connection was down", said)[1])
    assert 0.9 < silent < 5.0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_whoever_ends_it_has_the_recording(log, tmp_path, number):
    """Though a script began it in the background, which makes processes deaf to Ctrl-C."""
    out = tmp_path / "run.csv"
    with serve(play(log, loop=True), port=0) as controller:
        command = (sys.executable, "-m", "urdyn", "record", f"127.0.0.1:{controller.port}")
        begun = (*DEAF, *command, "--out", str(out), "--json")
        with subprocess.Popen(begun, stdout=-1, stderr=-1, text=True) as process:
            deadline = time.monotonic() + 60.0
            while not list(tmp_path.iterdir()) and time.monotonic() < deadline:
                time.sleep(0.05)
            time.sleep(0.5)
            process.send_signal(number)
            told, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert json.loads(told)["samples"] == len(ud.read(out)) > 0


@pytest.mark.parametrize(
    ("host", "options"),
    [
        ("127.0.0.1:1", ()),
        ("127.0.0.1:notaport", ()),
        ("127.0.0.1:1", ("--duration", "-1")),
        ("127.0.0.1:1", ("--recipe", "absent.xml")),
    ],
)
def test_what_cannot_be_recorded_is_told_in_one_line(host, options, tmp_path):
    out = tmp_path / "run.csv"
    told = CliRunner().invoke(app, ["record", host, "--out", str(out), *options])
    assert told.exit_code == 1
    assert told.stderr.startswith("urdyn: ") and told.stderr.count("\n") == 1
    assert not out.exists()
