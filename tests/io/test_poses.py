"""Sessions of poses as trackers and controllers write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from urdyn.errors import LogError
from urdyn.io.pose_columns import pose_columns
from urdyn.io.poses import LEAST, Poses, read_poses
from urdyn.types import Array

JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
GOAL = ("Goal x", "Goal y", "Goal z", "Goal roll")


def numbers(count: int = 20) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(1)
    q, place = rng.uniform(-3.0, 3.0, (count, 6)), rng.uniform(-2.5, 2.5, (count, 3))
    return q, place, rng.uniform(-3.0, 3.0, (count, 3))


def written(path: Path, heads: tuple[str, ...], *columns: Array, decimal: str = ".") -> Path:
    rows = (";".join(repr(float(x)) for x in row) for row in np.hstack(columns))
    path.write_text(
        "\n".join([";".join(heads), *(row.replace(".", decimal) for row in rows)]) + "\n"
    )
    return path


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize(
    ("place", "turn"),
    [
        (("measurement_x", "measurement_y", "measurement_z"),
         ("measurement_rx", "measurement_ry", "measurement_rz")),
        (("meas_x_mm", "meas_y_mm", "meas_z_mm"), ("meas_rx_deg", "meas_ry_deg", "meas_rz_deg")),
        (("X", "Y", "Z"), ("roll", "pitch", "yaw")),
        (("tracker.pos_x", "tracker.pos_y", "tracker.pos_z"),
         ("tracker.rot_rx", "tracker.rot_ry", "tracker.rot_rz")),
    ],
)  # fmt: skip
def test_spellings_of_one_style_are_one_session(
    tmp_path: Path, place: tuple[str, ...], turn: tuple[str, ...], decimal: str
) -> None:
    q, p, r = numbers()
    heads = ("Timestamp", *GOAL, *JOINTS, "measurement_temperature", *place, *turn)
    other = np.ones((20, 1))
    path = written(
        tmp_path / "session.csv", heads, 1e6 * other, np.zeros((20, 4)), q, 23.0 * other,
        1e3 * p, np.degrees(r), decimal=decimal,
    )  # fmt: skip
    poses = read_poses(path, JOINTS)
    np.testing.assert_allclose(poses.q, q, atol=1e-12)
    np.testing.assert_allclose(poses.place, p, atol=1e-12)
    assert poses.angles is not None
    np.testing.assert_allclose(poses.angles, r, atol=1e-12)
    assert not poses.own and poses.reading == ""


@pytest.mark.parametrize(
    "joints",
    [
        [f"q{k}" for k in range(1, 7)],
        [f"actual_q_{k}" for k in range(6)],
        [name.removesuffix("_joint") for name in JOINTS],
        [f"Joint {k} [rad]" for k in range(1, 7)],
        [f"actual {name} (rad)" for name in JOINTS],
    ],
)
def test_joints_have_several_names(tmp_path: Path, joints: list[str]) -> None:
    q, p, _ = numbers()
    heads = (*joints, "measurement_x", "measurement_y", "measurement_z")
    poses = read_poses(written(tmp_path / "session.csv", heads, q, p), JOINTS)
    np.testing.assert_allclose(poses.q, q, atol=1e-12)
    assert poses.angles is None
    assert np.isnan(poses.turn).all()


@pytest.mark.parametrize("title", ["q{} [deg]", "J{}_rad", "Joint {} (rad)", "q{} [°]"])
@pytest.mark.parametrize("most", [3.0, 9.0])  # by their size these would be [rad], and [deg]
def test_a_joints_title_says_its_unit(tmp_path: Path, title: str, most: float) -> None:
    q, p, _ = numbers()
    q *= most / 3.0
    heads = (*(title.format(k) for k in range(1, 7)), "x", "y", "z")
    poses = read_poses(written(tmp_path / "session.csv", heads, q, p), JOINTS)
    expected = q if "rad" in title else np.radians(q)
    np.testing.assert_allclose(poses.q, expected, atol=1e-12)


@pytest.mark.parametrize("other", ["marker", "robot_base_offset", "tcp"])
def test_of_several_triples_the_measured_one_is_read(other: str) -> None:
    measured, others = ([f"{owner}_{axis}" for axis in "xyz"] for owner in ("measurement", other))
    for heads in ([*others, *measured], [*measured, *others]):
        assert pose_columns(heads, (), "session.csv").place == tuple(measured)


def test_a_controllers_own_poses_need_no_clock(tmp_path: Path) -> None:
    q, p, r = numbers()
    heads = [f"actual_q_{k}" for k in range(6)] + [f"actual_TCP_pose_{k}" for k in range(6)]
    poses = read_poses(written(tmp_path / "log.csv", tuple(heads), q, p, r), JOINTS)
    assert poses.own
    np.testing.assert_allclose(poses.turn, Rotation.from_rotvec(r).as_matrix(), atol=1e-12)
    with pytest.raises(LogError, match="fewer joints than the arm, 7"):
        read_poses(tmp_path / "log.csv", (*JOINTS, "seventh"))


def test_rows_without_all_numbers_are_left_out_and_counted(tmp_path: Path) -> None:
    q, p, _ = numbers()
    path = written(
        tmp_path / "s.csv", (*JOINTS, "measurement_x", "measurement_y", "measurement_z"), q, p
    )
    lines = path.read_text().splitlines()
    lines[4] = lines[4].rsplit(";", 1)[0] + ";"
    path.write_text("\n".join(lines))
    poses = read_poses(path, JOINTS)
    assert len(poses) == 19
    assert poses.defects


@pytest.mark.parametrize("turned", [0, 10, 11, 14, 15, 29])
def test_angles_of_a_few_poses_do_not_cost_the_places_of_others(turned: int) -> None:
    """Three numbers a place, and six a pose: what is more is used, if it is enough."""
    q, p, r = numbers(30 if turned > 11 else 20)
    r[turned:] = np.nan
    poses = Poses(q, p, r, "").whole()
    oriented = turned >= max(LEAST, len(q) / 2)
    assert (poses.angles is not None) == oriented
    assert len(poses) == (turned if oriented else len(q))
    assert poses.defects[0].count == len(q) - turned


@pytest.mark.parametrize(
    ("heads", "reason"),
    [
        ((*JOINTS, "Goal x", "Goal y", "Goal z"), "no measured x, y, z"),
        (
            (*JOINTS[:5], "other", "measurement_x", "measurement_y", "measurement_z"),
            "wrist_3_joint",
        ),
    ],
)
def test_what_is_missing_is_named(tmp_path: Path, heads: tuple[str, ...], reason: str) -> None:
    q, p, _ = numbers()
    with pytest.raises(LogError, match=reason):
        read_poses(written(tmp_path / "s.csv", heads, q, p), JOINTS)


def test_a_dozen_poses_are_too_few_for_less(tmp_path: Path) -> None:
    q, p, _ = numbers(8)
    heads = (*JOINTS, "measurement_x", "measurement_y", "measurement_z")
    with pytest.raises(LogError, match="8 whole poses"):
        read_poses(written(tmp_path / "s.csv", heads, q, p), JOINTS)


def test_some_poses_keep_their_angles() -> None:
    q, p, r = numbers()
    some = Poses(q, p, r, "XYZ").take(np.array([1, 5]))
    np.testing.assert_array_equal(some.place, p[[1, 5]])
    np.testing.assert_allclose(some.turn, Rotation.from_euler("XYZ", r[[1, 5]]).as_matrix())


def test_poses_made_in_python_are_held_to_what_those_of_a_file_are() -> None:
    q, p, r = numbers()
    q[3, 0] = np.nan
    whole = Poses(q, p, r).whole()
    assert len(whole) == len(q) - 1 and whole.defects[0].count == 1
    assert whole.whole() is whole
    with pytest.raises(LogError, match="0 whole poses; calibrate needs 12"):
        Poses(q[:0], p[:0]).whole()
