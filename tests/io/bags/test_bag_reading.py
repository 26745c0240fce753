"""Bags of any kind are logs: joints by name, every stream on one clock, nothing guessed."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from mcap import writer as mcap_writer
from ros_messages import BEGAN, LATE, MAKERS, STORE, bag, header, joint_states, make, mcap, values

from urdyn.errors import InputError, LogError, MissingExtraError
from urdyn.io import Effort, read
from urdyn.io.bags import forms
from urdyn.io.bags.joints import JOINTS

AMPERES = Effort("A")
ALPHABETICAL = sorted(JOINTS)
MIXED = [f"left_{JOINTS[k]}" for k in (5, 0, 3, 1, 4, 2)]


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("names", [JOINTS, ALPHABETICAL, MIXED], ids=["urdf", "abc", "prefixed"])
def test_joints_are_found_by_name_whatever_their_order(kind, names, tmp_path):
    order = [JOINTS.index(name.removeprefix("left_")) for name in names]
    log = read(MAKERS[kind](tmp_path / "bag", joint_states(20, names, order)), effort=AMPERES)
    want = np.array([values(k) for k in range(20)])
    for place, name in enumerate(("actual_q", "actual_qd", "actual_current")):
        np.testing.assert_array_equal(log.channels[name], want[:, place])
    np.testing.assert_array_equal(log.t, [(BEGAN + 2_000_000 * k) / 1e9 for k in range(20)])
    assert not log.defects


@pytest.mark.parametrize("alone", ["bag.db3", "bag.mcap"])
def test_a_file_of_a_bag_is_the_bag(alone, tmp_path):
    maker = bag if alone.endswith("db3") else mcap
    whole = read(maker(tmp_path / "bag", joint_states(9)), effort=AMPERES)
    part = read(tmp_path / "bag" / alone, effort=AMPERES)
    np.testing.assert_array_equal(part.channels["actual_q"], whole.channels["actual_q"])


def test_torques_are_divided_by_the_gains(tmp_path):
    gain = np.arange(1.0, 7.0)
    log = read(bag(tmp_path / "bag", joint_states(9)), effort=Effort("Nm", gain))
    want = np.array([values(k)[2] for k in range(9)]) / gain
    np.testing.assert_array_equal(log.channels["actual_current"], want)


def test_nobody_guesses_what_effort_is(tmp_path):
    path = bag(tmp_path / "bag", joint_states(9))
    with pytest.raises(LogError, match=r"--effort-unit A .* or --effort-unit Nm.* effort=Effort\("):
        read(path)
    assert "actual_q" in read(path, channels=("actual_q",))  # nobody asks for effort here
    with pytest.raises(InputError, match="drive gains"):
        Effort("Nm")
    with pytest.raises(LogError, match="6 joints; give as many"):
        read(path, effort=Effort("Nm", [1.0, 2.0]))


def test_other_joints_messages_are_counted_not_mixed_in(tmp_path):
    told = joint_states(10)
    told[5:5] = joint_states(3, ["finger_joint"], [0])
    log = read(bag(tmp_path / "bag", told), effort=AMPERES)
    (defect,) = log.defects
    assert len(log) == 10 and defect.count == 3 and "other joints" in defect.kind


def test_rows_are_joint_states(tmp_path):
    path = bag(tmp_path / "bag", joint_states(10))
    log = read(path, rows=(3, 7), effort=AMPERES)
    np.testing.assert_array_equal(
        log.channels["actual_q"][:, 0], [values(k)[0, 0] for k in range(3, 7)]
    )
    assert log.source.rows == (3, 7)
    with pytest.raises(LogError, match="has 10 data rows"):
        read(path, rows=(3, 17), effort=AMPERES)


def test_without_stamps_the_recorder_s_clock_counts(tmp_path):
    log = read(bag(tmp_path / "bag", joint_states(10, stamped=False)), effort=AMPERES)
    np.testing.assert_array_equal(log.t, [(BEGAN + LATE + 2_000_000 * k) / 1e9 for k in range(10)])
    assert [str(d) for d in log.defects] == [
        "10 x message without a stamp (stamped by the recorder's clock)"
    ]


def test_one_message_without_a_stamp_leaves_the_others_on_the_robot_s_clock(tmp_path):
    told = joint_states(1, stamped=False) + joint_states(10)[1:]
    log = read(bag(tmp_path / "bag", told), effort=AMPERES)
    np.testing.assert_array_equal(log.t, [(BEGAN + 2_000_000 * k) / 1e9 for k in range(10)])
    assert [d.count for d in log.defects] == [1]


TURN = Rotation.from_rotvec([0.3, -0.4, 1.2])
FORCE = np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])  # in the tool's axes


def surroundings(count: int) -> list:
    """A pose, a wrench, a speed and temperatures, every fifth joint state."""
    told = []
    for k in range(0, count, 5):
        stamp = BEGAN + k * 2_000_000
        point = make("geometry_msgs/msg/Point", 0.1, 0.2, 0.3 + k)
        turn = make("geometry_msgs/msg/Quaternion", *TURN.as_quat())
        pose = make("geometry_msgs/msg/Pose", point, turn)
        vectors = [make("geometry_msgs/msg/Vector3", *half) for half in np.split(FORCE, 2)]
        wrench = make("geometry_msgs/msg/Wrench", *vectors)
        stamped = {
            ("/tcp_pose_broadcaster/pose", "geometry_msgs/msg/PoseStamped"): (
                header(stamp, "base"),
                pose,
            ),
            ("/force_torque_sensor_broadcaster/wrench", "geometry_msgs/msg/WrenchStamped"): (
                header(stamp, "tool0"),
                wrench,
            ),
            ("/speed_scaling_state_broadcaster/speed_scaling", "std_msgs/msg/Float64"): (50.0 + k,),
            ("/joint_temperatures", "std_msgs/msg/Float64MultiArray"): (
                make("std_msgs/msg/MultiArrayLayout", [], 0),
                30.0 + np.arange(6) + k,
            ),
        }
        for (topic, type_), fields in stamped.items():
            told.append((topic, type_, stamp + LATE, make(type_, *fields)))
    return told


@pytest.mark.parametrize("kind", ["sqlite3", "mcap"])
def test_every_stream_holds_on_the_joints_clock(kind, tmp_path):
    told = sorted(joint_states(20) + surroundings(20), key=lambda one: one[2])
    log = read(MAKERS[kind](tmp_path / "bag", told), effort=AMPERES)
    last = 5 * (np.arange(20) // 5)
    np.testing.assert_array_equal(log.channels["actual_TCP_pose"][:, 2], 0.3 + last)
    np.testing.assert_allclose(log.channels["actual_TCP_pose"][:, 3:], [TURN.as_rotvec()] * 20)
    in_base = np.hstack([TURN.apply(half) for half in np.split(FORCE, 2)])
    np.testing.assert_allclose(log.channels["actual_TCP_force"], [in_base] * 20)
    np.testing.assert_array_equal(log.channels["speed_scaling"], (50.0 + last) / 100)
    np.testing.assert_array_equal(
        log.channels["joint_temperatures"], 30.0 + np.arange(6) + last[:, None]
    )


def renamed(told: list, topics: dict[str, str]) -> list:
    """What was told on some topics, told on others."""
    return [(topics[topic], *rest) for topic, *rest in told if topic in topics]


WRENCH, POSE = "/force_torque_sensor_broadcaster/wrench", "/tcp_pose_broadcaster/pose"


@pytest.mark.parametrize(
    "aims",
    [
        {WRENCH: "/force_mode_controller/target_wrench", POSE: "/controller/tcp_pose_command"},
        {WRENCH: "/admittance/Desired_wrench", POSE: "/goal/tool_pose"},
    ],
)
def test_what_is_asked_for_is_not_what_is_measured(aims, tmp_path):
    around = surroundings(20)
    ask = renamed(around, aims)
    others = [one for one in around if one[0] not in aims]
    mine, both = (
        read(bag(tmp_path / str(k), [*joint_states(20), *told]), effort=AMPERES).channels
        for k, told in enumerate([around, [*ask, *around]])
    )
    named = ("actual_TCP_force", "actual_TCP_pose")
    for name in named:
        np.testing.assert_array_equal(mine[name], both[name])
    alone = read(bag(tmp_path / "alone", [*joint_states(20), *ask, *others]), effort=AMPERES)
    assert not set(named) & set(alone.channels)


@pytest.mark.parametrize(
    ("topic", "other", "channel"),
    [
        (WRENCH, "/left/wrench", "actual_TCP_force"),
        (POSE, "/left/tcp_pose", "actual_TCP_pose"),
        ("/joint_temperatures", "/left/temperatures", "joint_temperatures"),
    ],
)
def test_two_topics_that_tell_one_channel_are_refused_by_name(topic, other, channel, tmp_path):
    around = surroundings(20)
    told = [*joint_states(20), *around, *renamed(around, {topic: other})]
    says = f"more than one {channel} ({', '.join(sorted((topic, other)))}); keep one of them"
    with pytest.raises(LogError, match=re.escape(says)):
        read(bag(tmp_path / "bag", told), effort=AMPERES)


def test_a_topic_a_joint_tells_all_temperatures(tmp_path):
    type_ = "sensor_msgs/msg/Temperature"
    warm = [
        (f"/{joint}/temperature", type_, ns, make(type_, header(ns - LATE), 30.0 + k, 0.0))
        for ns in (BEGAN + LATE + 10_000_000 * n for n in range(3))
        for k, joint in enumerate(JOINTS)
    ]
    log = read(bag(tmp_path / "bag", [*joint_states(10), *warm]), effort=AMPERES)
    np.testing.assert_array_equal(log.channels["joint_temperatures"], [30.0 + np.arange(6)] * 10)


def test_what_a_stream_said_long_ago_no_longer_holds(tmp_path):
    told = sorted(joint_states(100) + surroundings(20), key=lambda one: one[2])
    speed = read(bag(tmp_path / "bag", told), effort=AMPERES).channels["speed_scaling"]
    # The last of four messages, 5 rows apart, stands in row 15: five such steps on, it is stale.
    assert np.isfinite(speed[:41]).all() and np.isnan(speed[41:]).all()


def test_a_bag_without_an_arm_is_refused_with_what_it_has(tmp_path):
    with pytest.raises(LogError, match=r"no joint states.*/joint_temperatures \(std_msgs"):
        read(bag(tmp_path / "bag", surroundings(20)), effort=AMPERES)
    with pytest.raises(LogError, match="joint states of finger_joint only"):
        read(bag(tmp_path / "hand", joint_states(3, ["finger_joint"], [0])), effort=AMPERES)
    left, right = ([f"{side}_{joint}" for joint in JOINTS] for side in ("left", "right"))
    with pytest.raises(LogError, match="more than one arm"):
        both = joint_states(3, [*left, *right], [*range(6), *range(6)])
        read(bag(tmp_path / "two", both), effort=AMPERES)


def test_an_mcap_whose_writer_was_killed_is_read_up_to_there(tmp_path):
    file = mcap(tmp_path / "bag", joint_states(9000)) / "bag.mcap"
    whole = read(file, effort=AMPERES)
    data = file.read_bytes()
    file.write_bytes(data[: int(0.7 * len(data))])
    torn = read(file, effort=AMPERES)
    assert 0.3 * len(whole) < len(torn) < len(whole)
    np.testing.assert_array_equal(
        torn.channels["actual_q"], whole.channels["actual_q"][: len(torn)]
    )
    assert [d.kind for d in torn.defects] == ["file without an end"]
    file.write_bytes(data[:4000])  # no whole chunk
    with pytest.raises(LogError, match=r"it has nothing; 1 x file without an end"):
        read(file, effort=AMPERES)


def test_a_torn_mcap_has_what_every_publisher_of_a_topic_said(tmp_path):
    file, type_ = tmp_path / "torn.mcap", "sensor_msgs/msg/JointState"
    definition = STORE.generate_msgdef(type_, ros_version=2)[0].encode()
    with file.open("wb") as stream:
        writer = mcap_writer.Writer(stream, chunk_size=4000)
        writer.start(profile="ros2")
        schema = writer.register_schema(type_, "ros2msg", definition)
        each = [writer.register_channel("/joint_states", "cdr", schema) for _ in range(2)]
        for k, (_, _, ns, message) in enumerate(joint_states(400)):
            said = bytes(STORE.serialize_cdr(message, type_))
            writer.add_message(each[k // 200], ns, said, ns)
        writer.finish()
    whole = read(file, effort=AMPERES)
    file.write_bytes(file.read_bytes()[:-8])  # the end alone
    torn = read(file, effort=AMPERES)
    assert len(torn) == len(whole) == 400


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("share", [0.02, 0.5, 0.9])
def test_a_torn_bag_is_one_line(kind, share, tmp_path):
    path = MAKERS[kind](tmp_path / "bag", joint_states(200))
    file = path if path.is_file() else next(p for p in path.iterdir() if p.suffix != ".yaml")
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(LogError) as told:
        read(path, effort=AMPERES)
    assert "\n" not in str(told.value) and str(path) in str(told.value)


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("name", ["MONDAY.MCAP", "bag.dat"])
def test_a_bag_is_known_by_its_first_bytes_whatever_its_name(kind, name, tmp_path):
    path = MAKERS[kind](tmp_path / "bag", joint_states(20))
    file = path if path.is_file() else next(p for p in path.iterdir() if p.suffix != ".yaml")
    shutil.copy(file, tmp_path / name)
    assert len(read(tmp_path / name, effort=AMPERES)) == 20


def test_other_folders_and_columns_are_one_line(tmp_path):
    with pytest.raises(LogError, match=r"without metadata\.yaml"):
        read(tmp_path)
    file = bag(tmp_path / "bag", joint_states(9)) / "bag.db3"
    with pytest.raises(LogError, match="leave out --columns"):
        read(file, columns="timestamp,actual_q*6")


def test_a_missing_extra_says_how_to_get_it(tmp_path, monkeypatch):
    path = bag(tmp_path / "bag", joint_states(9))
    monkeypatch.setattr(forms, "find_spec", lambda package: None)
    with pytest.raises(MissingExtraError, match=r"pip install -e '\.\[ros2\]'"):
        read(path)


def test_a_real_ros_1_bag_reads_in_the_right_order(recordings: Path):
    log = read(recordings / "ur5e_ros1_bag" / "static.bag", effort=AMPERES)
    assert len(log) == 1454
    # An arm at rest: the current that holds it against gravity is in the shoulder lift and elbow.
    held = np.abs(log.channels["actual_current"]).mean(axis=0)
    assert set(np.argsort(held)[-2:]) == {1, 2} and held[1] > 4.0
    np.testing.assert_allclose(
        log.channels["actual_q"][0],
        [-0.1423, -0.7081, 1.1693, -0.4617, -0.0436, -3.1671],
        atol=1e-4,
    )


def test_a_real_ros_2_bag_is_a_log(recordings: Path):
    path = recordings / "ur10_dynamics_bag" / "ur10_exciting_trajectory.db3"
    log = read(path, effort=Effort("Nm", np.full(6, 10.0)))
    assert len(log) == 3441 and np.median(np.diff(log.t)) == pytest.approx(0.008)
    assert not log.defects
