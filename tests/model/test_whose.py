"""Whose log it is, is told by what the controller works out; and no arm is taken for another."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from realarm import COLUMNS
from scipy.spatial.transform import Rotation

from urdyn.errors import LogError
from urdyn.identify import Fit, validate
from urdyn.io import read
from urdyn.io.calibration_file import read_calibration
from urdyn.model.arm import load_arm, read_arm
from urdyn.model.geometry.turns import pose_of, turn_z
from urdyn.model.library import RERATED, names
from urdyn.model.whose import CLEARLY, EXACT, STEADY, misplaced, misweighed
from urdyn.simulate.tool import tool_pose
from urdyn.tracking.offline import track
from urdyn.types import Array, Log

ARMS = names()
ROWS = 400
WORK = np.array([0.3, -1.5, 1.4, -1.4, -1.6, 0.2])  # [rad] where arms work
UPRIGHT = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])

shipped = cache(load_arm)


@pytest.fixture(autouse=True)
def _read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The library's arms, which are asked for a thousand times here."""
    monkeypatch.setattr("urdyn.model.whose.load_arm", shipped)


def waves(seed: int, most: float) -> Array:
    """Angles (ROWS, 6) around WORK, by some waves of up to `most` [rad] each."""
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 12.0, ROWS)[:, None]
    return WORK + sum(
        rng.uniform(-most, most, 6) * np.sin(k * t + rng.uniform(0.0, 6.0, 6)) for k in (1, 2, 3)
    )


def picks(seed: int) -> Array:
    """Angles of an arm whose tool points down and goes here and there."""
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 12.0, ROWS)
    lift, reach = -1.6 + 0.4 * np.sin(t + rng.uniform(0, 6)), 1.6 + 0.4 * np.sin(2.0 * t)
    turn, still = rng.uniform(0.1, 1.0) * np.sin(0.5 * t), np.zeros(ROWS)
    return np.column_stack([turn, lift, reach, -np.pi / 2 - lift - reach, still - np.pi / 2, turn])


def log_of(q: Array, **channels: Array) -> Log:
    t = 0.01 * np.arange(len(q))
    return Log(t, {"actual_q": q, "actual_qd": np.gradient(q, t, axis=0)} | channels)


def reached(pose: Array, q: Array, tool: Array) -> Log:
    """A log whose controller tells where a tool (3,) in such flanges (N, 4, 4) is."""
    place = pose[:, :3, 3] + pose[:, :3, :3] @ tool
    turned = Rotation.from_matrix(pose[:, :3, :3]).as_rotvec()
    return log_of(q, actual_TCP_pose=np.hstack([place, turned]))


def drawn(name: str, q: Array) -> Log:
    """A log of an arm of the library, with a tool of 15 cm."""
    told = tool_pose(shipped(name), q)
    return reached(pose_of(told[:, :3], Rotation.from_rotvec(told[:, 3:]).as_matrix()), q,
                   np.array([0.02, -0.03, 0.15]))  # fmt: skip


@pytest.mark.parametrize("true", ARMS)
@pytest.mark.parametrize("named", ARMS)
def test_where_the_tool_is_tells_which_arm_it_was(true: str, named: str) -> None:
    said = misplaced(shipped(named), drawn(true, waves(1, 0.3)))
    assert said == "" if named == true else f"where a {true} has its tool" in said


@pytest.mark.parametrize("motion", [waves(2, 0.1), waves(3, 0.7), picks(4), picks(5)])
def test_a_calibrated_arm_is_never_taken_for_another(recordings, motion: Array) -> None:
    files = sorted((recordings / "ur_calibration_yaml").glob("*.yaml"))
    assert len(files) == 12
    for file in files:
        pose = np.eye(4)
        for origin, angle in zip(read_calibration(file), motion.T, strict=True):
            pose = pose @ (origin @ turn_z(angle))
        name = file.name.partition("_")[0]
        assert misplaced(shipped(name), reached(pose, motion, np.array([0.0, 0.05, 0.2]))) == ""


def test_a_tool_that_moves_or_is_told_anew_is_no_other_arm() -> None:
    log = drawn("ur10e", waves(6, 0.5))
    pose = log.channels["actual_TCP_pose"].copy()
    half, swaying = pose.copy(), pose.copy()
    half[ROWS // 2 :, :3] += 0.2
    swaying[:, 0] += 0.1 * np.sin(np.linspace(0.0, 9.0, ROWS))
    for told in (half, swaying, pose + 1.0):  # and a base that is elsewhere
        for arm in ARMS:
            other = log_of(log.channels["actual_q"], actual_TCP_pose=told)
            assert misplaced(shipped(arm), other) == ""


def test_nothing_is_told_of_an_arm_that_stands_or_of_one_s_own_drawing() -> None:
    standing = np.tile(WORK, (ROWS, 1))
    assert misplaced(shipped("ur10"), drawn("ur10e", standing)) == ""
    own = read_arm(shipped("ur10").urdf.replace('name="ur10"', 'name="mine"'))
    assert own.name == "mine" and misplaced(own, drawn("ur10e", waves(1, 0.3))) == ""
    assert misplaced(shipped("ur10"), log_of(standing)) == ""


@pytest.mark.parametrize("true", ARMS)
@pytest.mark.parametrize(("robot", "before"), RERATED.items())
def test_an_arm_that_is_sold_anew_is_no_other_than_its_older_self(
    robot: str, before: str, true: str
) -> None:
    place = misplaced(shipped(robot), drawn(true, waves(1, 0.3)))
    load = misweighed(shipped(robot), resting(true, np.zeros(4), False))
    if true == before:
        assert place == load == ""
        untold = resting(true, np.array([1.3, 0.0, 0.02, 0.08]), False)
        assert misweighed(shipped(robot), untold) == ""
    else:
        assert f"where a {true} has its tool" in place and f"what a {true} takes" in load


def test_a_log_that_no_arm_fits_names_none() -> None:
    """A stranger that no arm fits is not told to be the one that is least far away."""
    log = drawn("ur10e", waves(1, 0.3))
    noise = np.random.default_rng(0).normal(0.0, STEADY * CLEARLY * 2.0, (ROWS, 6))
    noisy = log_of(
        log.channels["actual_q"], actual_TCP_pose=log.channels["actual_TCP_pose"] + noise
    )
    assert misplaced(shipped("ur3"), noisy) == ""


def resting(name: str, payload: Array, told: bool, seed: int = 0, poses: int = 2) -> Log:
    """A log of an arm that rests here and there, with m, m c (4,) set in its controller."""
    rng, arm = np.random.default_rng(seed), shipped(name)
    q = np.repeat(UPRIGHT + rng.uniform(-0.5, 0.5, (poses, 6)), ROWS // poses, axis=0)
    whole = arm.inertials.copy()
    whole[-1, :4] += payload
    log = log_of(q, target_moment=arm.torque(q, 0.0 * q, 0.0 * q, whole))
    log = replace(log, channels=log.channels | {"actual_qd": 0.0 * q})
    if not told:
        return log
    centre = payload[1:] / payload[0] if payload[0] else payload[1:]
    set_to = {"payload": np.full(len(q), payload[0]), "payload_cog": np.tile(centre, (len(q), 1))}
    return replace(log, channels=log.channels | set_to)


@pytest.mark.parametrize("true", ARMS)
def test_torques_at_rest_tell_which_arm_it_was(true: str) -> None:
    for payload, told in ((np.zeros(4), False), (np.array([1.3, 0.0, 0.02, 0.08]), True)):
        log = resting(true, payload, told)
        assert misweighed(shipped(true), log) == ""
        for named in set(ARMS) - {true}:
            assert f"what a {true} takes" in misweighed(shipped(named), log)


def test_torques_of_an_arm_of_which_one_joint_moves_tell_nothing() -> None:
    """Friction and acceleration are in them too."""
    log = resting("ur10e", np.zeros(4), False)
    moving = log.channels | {"actual_qd": np.tile([0.1, *np.zeros(5)], (ROWS, 1))}
    assert misweighed(shipped("ur10"), log)
    assert misweighed(shipped("ur10"), replace(log, channels=moving)) == ""


def test_a_payload_that_nobody_tells_makes_no_other_arm() -> None:
    """Chance would have to hit six torques to EXACT of their size."""
    rng, wrong = np.random.default_rng(7), 0
    for k in range(90):
        mass, centre = np.exp(rng.uniform(-3.0, 1.6)), rng.uniform([-0.03, -0.03, 0.0], 0.15)
        payload = mass * np.array([1.0, *centre])
        name = ARMS[k % len(ARMS)]
        wrong += bool(misweighed(shipped(name), resting(name, payload, False, k)))
    assert wrong == 0 and EXACT < 0.01


def test_the_real_arms_are_told_for_what_they_are(recordings, identified: Fit) -> None:
    """But for the run whose arm is upright throughout, where nothing has to be borne."""
    logs = {
        path: read(path, columns=COLUMNS) for path in (recordings / "ur10e_dynamics").glob("*.csv")
    }
    assert len(logs) == 15
    told = [misweighed(shipped("ur10"), log) for log in logs.values()]
    assert sum("what a ur10e takes" in said for said in told) == 14 and told.count("") == 1
    assert not any(misweighed(shipped("ur10e"), log) for log in logs.values())
    ur3e = read(recordings / "ur3e_rtde" / "ur3e_payload_1070g.csv")
    by_hand = read(recordings / "ur5e_freedrive" / "robot_data_o1.csv", rate=125.0)
    for log, true, named in ((ur3e, "ur3e", "ur3"), (by_hand, "ur5e", "ur5")):
        assert misplaced(shipped(true), log) == misweighed(shipped(true), log) == ""
        assert f"where a {true} has its tool" in misplaced(shipped(named), log)
    for verb in (validate, track):
        with pytest.raises(LogError, match="where a ur3e has its tool"):
            verb(identified, ur3e)
