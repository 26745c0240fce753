"""Stories of the virtual arm: the seed decides, the truth is told, the log is read back."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.io import read, write
from urdyn.model.arm import load_arm
from urdyn.model.consistency import is_consistent
from urdyn.simulate import Payload, perfect_sensors, simulate, virtual_arm, write_truth
from urdyn.version import __version__

LOAD = Payload(2.805, np.array([0.0, 0.02, 0.06]))


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur5e")


def bytes_of(log):
    return {name: values.tobytes() for name, values in log.channels.items()}


def test_the_same_seed_gives_the_same_bytes(arm):
    (one, truth), (two, again) = (simulate(arm, 3.0, 100.0, 4) for _ in range(2))
    other, _ = simulate(arm, 3.0, 100.0, 5)
    assert bytes_of(one) == bytes_of(two) and truth == again
    assert bytes_of(one)["actual_current"] != bytes_of(other)["actual_current"]


def test_neither_sensors_nor_duration_make_another_arm(arm):
    _, one = simulate(arm, 2.0, 100.0, 4)
    _, two = simulate(arm, 3.0, 500.0, 4, sensors=perfect_sensors(arm))
    assert one["joints"] == two["joints"] and one["links"] == two["links"]


def test_another_run_is_another_motion_of_the_same_arm(arm):
    (one, truth), (two, same) = (simulate(arm, 2.0, 100.0, 4, run=run) for run in (0, 1))
    assert truth["joints"] == same["joints"]
    assert bytes_of(one)["actual_q"] != bytes_of(two)["actual_q"]


def test_the_truth_is_the_arm(arm):
    _, truth = simulate(arm, 2.0, 100.0, 9, payload=LOAD)
    dynamics = virtual_arm(arm, 9, LOAD)
    assert truth["robot"] == "ur5e" and truth["seed"] == 9
    assert [joint["name"] for joint in truth["joints"]] == list(arm.joint_names)
    assert [joint["coulomb"] for joint in truth["joints"]] == dynamics.drive.coulomb.tolist()
    assert truth["drive_gain"] == dynamics.drive.gain.tolist()
    assert [link["mass"] for link in truth["links"]] == dynamics.inertials[:, 0].tolist()
    assert truth["payload"]["mass"] == LOAD.mass
    np.testing.assert_allclose(truth["payload"]["com"], LOAD.com, rtol=0, atol=1e-15)


def test_every_virtual_arm_can_be_built(arm):
    for seed in range(20):
        dynamics = virtual_arm(arm, seed, LOAD)
        assert is_consistent(dynamics.inertials).all() and is_consistent(dynamics.payload)


def test_a_payload_is_a_solid_ball(arm):
    ball = Payload(3.0, np.array([0.1, 0.0, 0.0]))
    radius = (3 * 3.0 / (4 * np.pi * 3000.0)) ** (1 / 3)
    own, away = 0.4 * 3.0 * radius**2, 3.0 * 0.1**2
    wanted = [3.0, 0.3, 0, 0, own, 0, own + away, 0, 0, own + away]
    np.testing.assert_allclose(ball.inertials(), wanted, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("payload", [LOAD, None])
def test_the_truth_is_written_as_json_and_as_toml(tmp_path, arm, payload):
    _, truth = simulate(arm, 2.0, 100.0, 2, payload=payload)
    for name in ("t.json", "t.toml"):
        write_truth(tmp_path / name, truth)
    assert json.loads((tmp_path / "t.json").read_text()) == truth
    told = {name: value for name, value in truth.items() if value is not None}
    assert told["urdyn"] == __version__
    assert tomllib.loads((tmp_path / "t.toml").read_text()) == told


def test_the_truth_in_another_format_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"\.json or \.toml"):
        write_truth(tmp_path / "truth.yaml", {})


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"seed": -1}, "seed -1: takes a whole number from 0 to"),
        ({"seed": 1.5}, "seed 1.5: takes a whole number"),
        ({"seed": 2**70}, "seed 1180591620717411303424: takes a whole number from 0 to"),
        ({"run": -1}, "run -1: takes a whole number, 0 or more"),
        ({"terms": frozenset({"stribek"})}, "terms: no 'stribek'; name some of ripple_cos"),
    ],
)
def test_an_arm_that_nobody_can_draw_is_refused(arm, asked, told):
    with pytest.raises(InputError, match=told):
        simulate(arm, 2.0, 50.0, **{"seed": 0} | asked)


def test_a_payload_without_mass_is_refused():
    with pytest.raises(InputError, match="cannot be carried"):
        Payload(-1.0)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_log_is_read_back(tmp_path, arm, suffix):
    log, _ = simulate(arm, 2.0, 125.0, 1)
    write(log, tmp_path / f"log{suffix}")
    back = read(tmp_path / f"log{suffix}")
    np.testing.assert_array_equal(back.t, log.t)
    assert set(back.channels) == set(log.channels)
    for name in log.channels:
        np.testing.assert_array_equal(back.channels[name], log.channels[name])
