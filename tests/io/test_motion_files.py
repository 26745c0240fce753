"""A planned motion in the languages of robots: read back, each is the motion that was meant."""

from __future__ import annotations

import re

import numpy as np
import pytest
import yaml

from urdyn.io.motion_files import FIRST_SPEED, joint_trajectory, motion_csv, urscript
from urdyn.model.arm import load_arm
from urdyn.simulate import from_file
from urdyn.simulate.fourier import draw, series_within

KNOT, LENGTH = 0.04, 8.0
STEP = 0.002  # [s] of the pretended controller


@pytest.fixture(scope="module")
def series():
    arm = load_arm("ur5e")
    return series_within(arm, draw(6, LENGTH, np.random.default_rng(3), 5))


def rows(series, step):
    t = np.arange(round(LENGTH / step) + 1) * step
    return t, *series.at(t)


def played(script: str, speed: float) -> np.ndarray:
    """Poses that a controller is given: the script is Python but for `end` and `global`."""
    body = re.sub(r"^\s*end$", "", script, flags=re.MULTILINE)
    body = body.replace("def to(q, v):", "def to(q, v):\n    global u, from_q, from_v")
    body = re.sub(r"global (speed|u|step|from_q|from_v) = ", r"global \1; \1 = ", body)
    body = body.replace(f"speed = {FIRST_SPEED:g}", f"speed = {speed}")
    given: list[list[float]] = []
    said = {
        "get_steptime": lambda: STEP,
        "servoj": lambda q, **_: given.append(list(q)),
        "movej": lambda q, **_: given.append(list(q)),
        "sleep": lambda _: None,
        "stopj": lambda _: None,
    }
    exec(compile(body, "script", "exec"), said)
    return np.array(given)


@pytest.mark.parametrize("speed", [1.0, 0.1])
def test_the_script_follows_the_path_at_its_speed(series, speed):
    t, q, v, _ = rows(series, KNOT)
    given = played(urscript(t, q, v, "a test"), speed)[1:]
    when = np.minimum(speed * STEP * np.arange(1, len(given) + 1), LENGTH)
    assert abs(len(given) - LENGTH / (speed * STEP)) <= 1
    # A cubic through both ends' angles and velocities errs by h⁴/384 of the fourth derivative,
    # which is the acceleration's peak times the highest frequency squared at most.
    fourth = np.abs(series.at(t)[2]).max() * (2 * np.pi / LENGTH * 5) ** 2
    assert np.abs(given - series.at(when)[0]).max() < KNOT**4 / 384 * fourth + 1e-8


def test_the_script_begins_at_a_tenth_and_goes_to_the_first_pose(series):
    t, q, v, _ = rows(series, KNOT)
    script = urscript(t, q, v, "two\nlines")
    assert "global speed = 0.1\n" in script
    assert "# two lines\n" in script
    assert script.index("movej(from_q") < script.index("  to([")
    assert script.count("  to([") == len(t) - 1
    np.testing.assert_allclose(played(script, 1.0)[0], q[0], atol=1e-9)


def test_the_yaml_is_a_joint_trajectory(series):
    t, q, v, a = rows(series, KNOT)
    arm = load_arm("ur5e")
    message = yaml.safe_load(joint_trajectory(t, q, v, a, arm.joint_names, "a test"))
    assert set(message) == {"header", "joint_names", "points"}
    assert message["joint_names"] == list(arm.joint_names)
    points = message["points"]
    stamps = [p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points]
    np.testing.assert_allclose(stamps, t, atol=1e-9)
    for key, values in (("positions", q), ("velocities", v), ("accelerations", a)):
        np.testing.assert_allclose([p[key] for p in points], values, atol=1e-9)


def test_the_csv_is_played_back_as_it_was_meant(series, tmp_path):
    t, q, v, a = rows(series, STEP)
    path = tmp_path / "motion.csv"
    path.write_text("".join(motion_csv(t, q, v, a)))
    table = np.genfromtxt(path, delimiter=",", names=True)
    assert table.dtype.names == ("t", *(f"{x}{j}" for x in "qva" for j in range(6)))
    np.testing.assert_allclose(table["a5"], a[:, 5], atol=1e-9)
    back = from_file(path, load_arm("ur5e"), 1.0 / STEP)
    np.testing.assert_allclose(back.q, q, atol=1e-9)
    np.testing.assert_allclose(back.v, v, atol=1e-6)
