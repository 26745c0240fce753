"""Bags at the command line: what effort is has to be said, once, and in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from ros_messages import bag, joint_states, values

from urdyn.cli.app import app
from urdyn.io import read
from urdyn.model.arm import load_arm
from urdyn.model.population import population

GAIN = "2,4,5,8,10,16"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return bag(tmp_path / "bag", joint_states(30))


def run(*words: object):
    return CliRunner().invoke(app, list(map(str, words)))


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ((), "--effort-unit A"),
        (("--effort-unit", "Nm"), "give --drive-gain or --robot"),
        (("--effort-unit", "Nm", "--drive-gain", "1,2"), "6 joints; give as many"),
        (("--effort-unit", "Nm", "--drive-gain", "1,2,3,4,5,-6"), "above 0"),
    ],
)
def test_what_is_missing_is_told_in_one_line(path, tmp_path, options, reason):
    told = run("convert", path, tmp_path / "x.csv", *options)
    assert told.exit_code == 1 and reason in told.stderr
    assert told.stderr.count("\n") == 1 and not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("verb", ["identify", "validate", "track"])
def test_every_verb_that_reads_takes_the_unit(verb):
    assert "--effort-unit" in run(verb, "--help").stdout


def test_torque_is_divided_by_the_gains_in_use(path, tmp_path):
    effort = np.array([values(k)[2] for k in range(30)])
    given = ("--drive-gain", GAIN), ("--robot", "ur10")
    known = np.fromstring(GAIN, sep=","), population(load_arm("ur10")).drive["gain"].typical
    for options, gain in zip(given, known, strict=True):
        told = run("convert", path, tmp_path / "x.csv", "--effort-unit", "Nm", *options)
        assert told.exit_code == 0, told.stderr
        current = read(tmp_path / "x.csv").channels["actual_current"]
        np.testing.assert_array_equal(current, effort / gain)
