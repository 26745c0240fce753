"""Stories of `urdyn simulate` with faults: what is asked for is in the log, and in the truth."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import urdyn as ud
from urdyn.cli.app import app
from urdyn.simulate import course, parse_fault, virtual_arm

ARM = ("simulate", "--robot", "ur5e", "--duration", 40, "--rate", 50, "--seed", 4)
FRICTION = "friction_increase:joint=2,onset=10,rate=0.01"
STUCK = "sensor_fault:joint=4,onset=20,mode=dropped"


def simulated(*how: object) -> Result:
    return CliRunner().invoke(app, [*map(str, (*ARM, *how))])


def test_the_truth_tells_the_course_of_every_fault(tmp_path: Path) -> None:
    out, told = tmp_path / "log.parquet", tmp_path / "truth.toml"
    done = simulated("--fault", FRICTION, "--fault", STUCK, "--out", out, "--truth", told)
    assert done.exit_code == 0, done.stderr
    truth = tomllib.loads(told.read_text())
    assert truth["schedule"][0] == {
        "kind": "friction_increase",
        "joint": 2,
        "rate": 0.01,
        "onset": 10.0,
        "shape": "linear",
        "viscous": 0.0,
    }
    assert set(truth["course"]) == {"t", "elbow_joint.coulomb", "wrist_2_joint.sensor_dropped"}
    t = np.array(truth["course"]["t"])
    assert np.diff(t).max() <= 1.0
    dynamics = virtual_arm(ud.load_arm("ur5e"), 4)
    now = course(dynamics, [parse_fault(FRICTION, 6)], t)
    wanted = dynamics.drive.coulomb[2] * now.coulomb[:, 2]
    assert truth["course"]["elbow_joint.coulomb"] == wanted.tolist()
    assert truth["joints"][2]["coulomb"] == wanted[0]
    log = ud.read(out)
    lost = np.isnan(log.channels["actual_current"])
    assert lost[log.t >= 20.0, 4].all() and not lost[log.t < 20.0].any()


def test_the_truth_as_parquet_has_the_rest_beside_it(tmp_path: Path) -> None:
    out, told = tmp_path / "log.parquet", tmp_path / "truth.parquet"
    done = simulated("--motion", "pick_and_place", "--heat", "--out", out, "--truth", told)
    assert done.exit_code == 0, done.stderr
    over_time = ud.read(told)
    assert {"payload.mass", "elbow_joint.temperature"} <= set(over_time.channels)
    assert over_time.channels["elbow_joint.temperature"][0] == pytest.approx(22.0)
    assert json.loads((tmp_path / "truth.json").read_text())["schedule"] == []


def test_everything_at_once(tmp_path: Path) -> None:
    out = tmp_path / "log.csv"
    how = ("--noise", "real", "--deviations", "--heat", "--recorder", "several_rates")
    done = simulated("--motion", "shift", *how, "--fault", FRICTION, "--out", out, "--json")
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["truth"]["schedule"] and "course" not in told["truth"]
    log = ud.read(out)
    assert {"actual_TCP_force", "ft_raw_wrench"} <= set(log.channels)
    assert np.isnan(log.channels["joint_temperatures"]).any()


def test_what_the_command_writes_is_what_the_library_gives(tmp_path: Path) -> None:
    out = tmp_path / "log.parquet"
    assert simulated("--fault", FRICTION, "--heat", "--out", out).exit_code == 0
    events = (parse_fault(FRICTION, 6),)
    log, _ = ud.simulate(ud.load_arm("ur5e"), 40.0, 50.0, 4, events=events, heat=True)
    back = ud.read(out)
    np.testing.assert_array_equal(back.channels["actual_current"], log.channels["actual_current"])


@pytest.mark.parametrize(
    ("option", "reason"),
    [
        (("--fault", "rust:joint=1"), "no kind 'rust'; name one of friction_increase"),
        (("--fault", "joint_backlash:joint=6,rate=1"), "joints count from 0 to 5"),
        (("--truth", "truth.yaml"), ".parquet"),
    ],
)
def test_what_cannot_be_is_one_line(tmp_path: Path, option: tuple[str, str], reason: str) -> None:
    done = simulated(*option, "--out", tmp_path / "log.csv")
    assert done.exit_code == 1 and reason in done.stderr and "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("encoder_offset:joint=2", "needs offset or rate"),
        ("thermal_drift:rate=3", "changes nothing without --heat"),
    ],
)
def test_a_fault_that_would_change_nothing_is_refused(
    fault: str, said: str, tmp_path: Path
) -> None:
    told = CliRunner().invoke(
        app, [*map(str, ARM), "--fault", fault, "--out", str(tmp_path / "x.csv")]
    )
    assert told.exit_code == 1 and said in told.stderr and told.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())
