"""urdyn simulate --serve, as a process of its own, and urdyn record beside it."""

import json
import signal
import subprocess
import sys
from itertools import islice, takewhile

import numpy as np
import pytest
from story import DEAF
from typer.testing import CliRunner

import urdyn as ud
from urdyn.cli.app import app

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once
ROUND = 1500  # rows of the controller's, of 3 s
URDYN = (sys.executable, "-m", "urdyn")


@pytest.fixture
def controller():
    """A serving process, and its port."""
    command = (*URDYN, "simulate", "--robot", "ur5e", "--serve", "--port", "0", "--duration", "3")
    process = subprocess.Popen((*command, "--json", "-q"), stdout=subprocess.PIPE, text=True)
    told = json.loads("".join(takewhile(lambda line: line != "}\n", process.stdout)) + "}")
    assert (told["robot"], told["host"], told["rate_hz"]) == ("ur5e", "127.0.0.1", 500.0)
    yield process, told["port"]
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60)[0] == "" and process.returncode == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_whoever_ends_it_ends_it_in_good_order(number):
    """Though it was begun in the background by a script, which makes processes deaf to Ctrl-C."""
    command = (*URDYN, "simulate", "--robot", "ur5e", "--serve", "--port", "0", "--duration", "1")
    with subprocess.Popen((*DEAF, *command), stderr=subprocess.PIPE, text=True) as process:
        assert "serves RTDE" in process.stderr.readline()
        process.send_signal(number)
        assert process.wait(60) == 0


def test_a_served_arm_can_be_recorded_and_identified(controller, tmp_path):
    _, port = controller
    out = tmp_path / "run.parquet"
    command = (
        *URDYN,
        "record",
        f"127.0.0.1:{port}",
        "--out",
        str(out),
        "--duration",
        "4",
        "--json",
    )
    told = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    document = json.loads(told.stdout)
    assert document["lost"] == document["torn"] == 0
    log = ud.read(out)
    assert len(log) == document["samples"] > 1900
    assert np.median(np.diff(log.t)) == pytest.approx(0.002, abs=1e-6)
    current = log.joint("actual_current")
    assert np.isfinite(current).all()
    assert (current[ROUND:] != current[:-ROUND]).all(), "noise is new in every round"


def test_a_round_begins_where_the_last_one_ended(monkeypatch):
    """No joint is anywhere else from one sample to the next, and no stamp is left out."""
    rounds = []
    monkeypatch.setattr("urdyn.cli.simulate.serve_logs", lambda logs, *of: rounds.extend(logs))
    monkeypatch.setattr("urdyn.cli.simulate.apart", lambda make: islice(make(), 1))
    asked = ("simulate", "--robot", "ur5e", "--serve", "--duration", "5", "--quiet")
    done = CliRunner().invoke(app, [*asked, "--motion", "point_to_point"])
    assert done.exit_code == 0, done.output
    first, second = rounds
    q = [log.channels["target_q"][row] for log in rounds for row in (0, -1)]
    np.testing.assert_array_equal(q, q[:1] * 4)
    assert second.t[0] - first.t[-1] == pytest.approx(0.002)


def test_serving_an_address_that_is_not_ours_is_one_line():
    asked = ("simulate", "--robot", "ur5e", "--serve", "--duration", "1")
    told = CliRunner().invoke(app, [*asked, "--host", "203.0.113.7"])
    assert told.exit_code == 1
    assert told.stderr.startswith("urdyn: ") and told.stderr.count("\n") == 1


def test_one_of_out_and_serve_is_needed():
    told = CliRunner().invoke(app, ["simulate", "--robot", "ur5e"])
    assert told.exit_code == 2 and "--serve" in told.stderr
