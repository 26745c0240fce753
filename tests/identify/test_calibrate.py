"""Calibration against known truth: it finds it, knows how well, and says where it does not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tracker import HIDDEN, Session, session

from urdyn.errors import ArmError, InputError
from urdyn.identify.kinematics import Recorded, calibrate, evaluate, most_informative, workspace
from urdyn.identify.kinematics.calibration import drawn, everything, rms
from urdyn.identify.kinematics.gross import moderate, weights
from urdyn.identify.kinematics.moments import moments, total
from urdyn.identify.kinematics.placement import Placement, residuals, slopes
from urdyn.identify.kinematics.regions import regions
from urdyn.identify.kinematics.robust import begin, solve
from urdyn.identify.kinematics.workspace import roam
from urdyn.io import read_table
from urdyn.io.calibration_file import read_calibration
from urdyn.io.poses import read_poses
from urdyn.model.arm import Arm, load_arm, read_arm
from urdyn.model.cell import Cell
from urdyn.model.collision import free
from urdyn.model.geometry.chain_pose import flange
from urdyn.model.geometry.drawing import drawing_of, placed
from urdyn.model.geometry.transmission import compliance, transmission
from urdyn.types import Array, Log

SEEN = np.setdiff1d(np.arange(22), HIDDEN)
FILES = (
    "ur10_robot_01", "ur10e_robot_02", "ur10e_robot_03", "ur16e_robot_09", "ur3_robot_05",
    "ur3_robot_06", "ur3e_robot_04", "ur5_robot_10", "ur5_robot_11", "ur5e_robot_07",
    "ur5e_robot_08", "ur5e_robot_12",
)  # fmt: skip


def solved(arm: Arm, one: Session, seed: int = 0) -> tuple[Array, Array, Array]:
    """Estimates, their covariance, and the poses' weights, by geometry alone."""
    rng = np.random.default_rng(seed)
    start, poses = begin(drawn(arm, drawing_of(arm)), one.poses, rng)
    found = solve(start, poses, everything(start, poses), rng)
    return found.placement.deviations, found.posterior.cov[:22, :22], found.weight


def test_slopes_are_finite_differences(ur5e: Arm) -> None:
    rng, drawing = np.random.default_rng(0), drawing_of(ur5e)
    q = rng.uniform(-3.0, 3.0, (8, 6))
    effects = transmission(compliance(ur5e, q), 2)
    nothing = np.zeros(len(effects.owners))
    start = Placement(drawing.form, drawing.form.nominal, effects, nothing, np.eye(4), np.eye(4))
    placement = start.moved(np.full(start.size, 3e-3))
    A, step = slopes(placement, q), 1e-6
    for k in range(placement.size):
        moved = np.zeros(placement.size)
        moved[k] = step
        ahead, behind = (placement.moved(s * moved).poses(q) for s in (1.0, -1.0))
        e = [residuals(placement, q, p[:, :3, 3], p[:, :3, :3]) for p in (ahead, behind)]
        bound = 1e-8 * max(1.0, float(np.abs(A[:, :, k]).max())) ** 2
        np.testing.assert_allclose((e[0] - e[1]) / (2.0 * step), A[:, :, k], atol=bound)


def test_moments_add_up_and_leave_the_sum_of_squares(ur5e: Arm) -> None:
    one = session(ur5e, np.random.default_rng(1), 40)
    rng = np.random.default_rng(0)
    start, poses = begin(drawn(ur5e, drawing_of(ur5e)), one.poses, rng)
    weight = rng.uniform(0.1, 1.0, 40)
    parts = [
        moments(start, poses.q[k], poses.place[k], poses.turn[k], weight[k])
        for k in (slice(0, 15), slice(15, 40))
    ]
    whole = moments(start, poses.q, poses.place, poses.turn, weight)
    np.testing.assert_allclose(total(parts).H, whole.H, rtol=1e-12, atol=1e-9)
    x = 1e-3 * rng.standard_normal(start.size)
    e = residuals(start, poses.q, poses.place, poses.turn) - slopes(start, poses.q) @ x
    direct = [(weight[:, None] * e[:, k] ** 2).sum() for k in (slice(0, 3), slice(3, 6))]
    np.testing.assert_allclose(whole.squares(x), direct, rtol=1e-9)


def test_truth_is_found_with_base_and_tool_unknown(ur10e: Arm) -> None:
    one = session(ur10e, np.random.default_rng(2), 120)
    value, cov, weight = solved(ur10e, one)
    z = ((value - one.deviations) / np.sqrt(np.diag(cov)))[SEEN]
    assert np.abs(z).max() < 4.0  # of 18, by chance once in a thousand sessions
    assert weight.min() > 0.9


@pytest.mark.parametrize("reading", ["rotvec", "XYZ", "xyz"])
def test_what_three_angles_mean_is_found(ur10e: Arm, reading: str) -> None:
    one = session(ur10e, np.random.default_rng(12), 40)
    turn = Rotation.from_matrix(one.poses.turn)
    angles = turn.as_rotvec() if reading == "rotvec" else turn.as_euler(reading)
    unread = replace(one.poses, angles=angles, reading="")
    _, read = begin(drawn(ur10e, drawing_of(ur10e)), unread, np.random.default_rng(0))
    assert read.reading == reading


@pytest.mark.parametrize("positions", [False, True])
def test_gross_errors_do_not_move_it(ur10e: Arm, positions: bool) -> None:
    clean = session(ur10e, np.random.default_rng(3), 150, positions=positions)
    dirty = session(ur10e, np.random.default_rng(3), 150, positions=positions, gross=30)
    value, cov, weight = solved(ur10e, dirty)
    assert (weight < 0.5).sum() == 30
    z = ((value - clean.deviations) / np.sqrt(np.diag(cov)))[SEEN]
    assert np.abs(z).max() < 4.0


@pytest.mark.parametrize(("count", "wrong"), [(16, 1), (30, 6)])
def test_poses_wrong_by_less_than_the_drawing_leave_no_trace(
    ur10e: Arm, count: int, wrong: int
) -> None:
    rng = np.random.default_rng(2)
    one = session(ur10e, rng, count, noise=5e-5, positions=True)
    place = one.poses.place.copy()
    place[:wrong] += 5e-3 * rng.standard_normal((wrong, 3))
    value, cov, weight = solved(ur10e, replace(one, poses=replace(one.poses, place=place)))
    assert weight[:wrong].max() < 0.01
    without = replace(one, poses=one.poses.take(np.arange(wrong, count)))
    expected, same, _ = solved(ur10e, without)
    sd = np.sqrt(np.diag(same))
    # Either fit ends with a step of at most a hundredth of a standard deviation.
    np.testing.assert_allclose((value - expected) / sd, 0.0, atol=0.02)
    np.testing.assert_allclose(np.sqrt(np.diag(cov)), sd, rtol=0.02)


def test_clean_poses_weigh_one_and_wrong_ones_nothing() -> None:
    e = np.zeros((4, 6))
    e[1, 0], e[2, 4], e[3] = 2e-5, 5.0, np.nan
    e[3, :3] = 0.0
    noise = np.array([1e-5, 1e-3])
    np.testing.assert_allclose(weights(e[:2], noise), 1.0, atol=1e-3)
    assert weights(e, noise)[2] < 1e-200
    assert moderate(e, noise).tolist() == [True, True, False, True]


def coverage(arm: Arm, sessions: int, seed: int) -> float:
    """Share of truths inside their 90 % intervals."""
    inside = []
    for k in range(sessions):
        one = session(arm, np.random.default_rng([seed, k]), 40, noise=5e-5)
        value, cov, _ = solved(arm, one, k)
        inside.append(np.abs(value - one.deviations) < 1.645 * np.sqrt(np.diag(cov)))
    return float(np.mean(inside))


def test_intervals_cover(ur10e: Arm) -> None:
    # 14 x 22 draws: 1.7 % of binomial noise, more as a session's are not independent: 3 of double.
    assert 0.90 - 0.10 < coverage(ur10e, 14, 7) < 0.90 + 0.10


@pytest.mark.slow
def test_intervals_cover_in_two_hundred_calibrations(ur10e: Arm) -> None:
    assert 0.85 < coverage(ur10e, 200, 8) < 0.95


def test_little_excitation_is_not_trusted_where_it_was_not(ur10e: Arm) -> None:
    rng = np.random.default_rng(4)
    q = np.array([0.3, -1.2, 1.4, -0.8, -1.5, 0.2]) + rng.uniform(-0.15, 0.15, (80, 6))
    one = session(ur10e, rng, 80, q=q, noise=5e-5)
    found = calibrate(ur10e, one.poses)
    assert not found.verdict.trusted
    assert any("elsewhere" in reason for reason in found.verdict.reasons)
    assert len(found.weak) > 4
    # What it expects of itself elsewhere is what is true: within a factor of two.
    true = one.base @ flange(one.table, found.space.q) @ one.tool
    ours = found.found.placement.poses(found.space.q)
    off = np.linalg.norm((ours - true)[:, :3, 3], axis=1)
    assert np.median(off) < 2.0 * np.median(found.space.error)


def test_good_excitation_is_trusted_and_names_what_base_and_tool_hide(ur10e: Arm) -> None:
    found = calibrate(ur10e, session(ur10e, np.random.default_rng(5), 120).poses)
    assert found.verdict.trusted
    assert (found.rank, found.sought) == (30, 34)
    assert found.choice.chosen.model.name == "geometry"
    told = {w.name: w.partners[0][0] for w in found.weak}
    assert told == {
        "shoulder_pan_joint.d": "base.z",
        "shoulder_pan_joint.theta": "base.rz",
        "wrist_3_joint.d": "tool.z",
        "wrist_3_joint.theta": "tool.rz",
    }


def test_uneven_joints_are_found_where_they_are_and_help_elsewhere(ur10e: Arm) -> None:
    rng = np.random.default_rng(6)
    q = rng.uniform(-2.8, 2.8, (700, 6))
    shift = 4e-4 * np.sin(7.0 * q) + 2e-4 * np.cos(16.0 * q)
    one = session(ur10e, rng, 700, q=q, shift=shift)
    found = calibrate(ur10e, one.poses.take(np.arange(500)))
    assert found.choice.chosen.model.name == "transmission"
    geometry, joints = (
        t for t in found.choice.trials if t.model.name in ("geometry", "transmission")
    )
    assert joints.rms.max() < 0.5 * geometry.rms.min()
    rest = one.poses.take(np.arange(500, 700))
    score = evaluate(ur10e, rest, Recorded(found.geometric.placement, found.found.placement))
    off = {k: np.sqrt((f.residuals[:, :3] ** 2).sum(axis=1).mean()) for k, f in score.fits.items()}
    assert score.best == "geometry and joints"
    assert off["geometry and joints"] < 0.5 * off["geometry"] < 0.5 * off["nominal"]


def test_a_controllers_flange_is_known_for_one(ur5e: Arm) -> None:
    one = session(ur5e, np.random.default_rng(9), 100, noise=1e-5, own=True)
    found = calibrate(ur5e, one.poses)
    assert found.bare
    q = np.random.default_rng(10).uniform(-3.0, 3.0, (300, 6))
    ours, true = flange(found.geometric.placement.table, q), flange(one.table, q)
    assert np.linalg.norm((ours - true)[:, :3, 3], axis=1).max() < 2e-5


def test_an_arm_as_drawn_is_no_doubt(ur5e: Arm) -> None:
    """All its errors are rounding, and none of them is a multiple of another."""
    form = drawing_of(ur5e).form
    table = form.table(np.zeros(int(form.free.sum())))
    exact = session(ur5e, np.random.default_rng(11), 100, noise=0.0, own=True, table=table)
    assert calibrate(ur5e, exact.poses).verdict.trusted


def test_regions_are_halves_of_halves() -> None:
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (160, 6))
    assert np.bincount(regions(q)).tolist() == [20] * 8
    assert np.bincount(regions(q[:20])).tolist() == [10, 10]


def test_chosen_poses_tell_more_than_random_ones(ur5e: Arm) -> None:
    rng = np.random.default_rng(0)
    start = drawn(ur5e, drawing_of(ur5e))
    chosen = most_informative(ur5e, start, 15, rng)
    assert free(ur5e, chosen).all()
    assert (chosen >= ur5e.lower).all() and (chosen <= ur5e.upper).all()

    def told(q: Array) -> float:
        A = slopes(start, q).reshape(-1, start.size) / 5e-5
        prior = np.concatenate([np.full(22, 1e-3), np.full(12, 10.0)]) ** -2.0
        return float(np.linalg.slogdet(A.T @ A + np.diag(prior))[1])

    random = [told(rng.uniform(-np.pi, np.pi, (15, 6))) for _ in range(10)]
    assert told(chosen) > max(random)


def test_an_arm_that_hangs_has_poses_too(ur10e: Arm) -> None:
    """No pose of it is above the plane of its base."""
    stands, hangs = 'rpy="0 0 3.141592653589793"', 'rpy="3.141592653589793 0 0"'
    arm = read_arm(ur10e.urdf.replace(stands, hangs, 1), "hanging")
    q = roam(arm, 20, np.random.default_rng(0))
    assert free(arm, q, Cell()).all() and not free(arm, q).any()


def test_an_arm_without_a_free_pose_is_told(ur10e: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workspace, "free", lambda arm, q, cell: np.zeros(len(q), dtype=bool))
    with pytest.raises(ArmError, match="ur10e: of 80 poses 0 are free of self-collision"):
        roam(ur10e, 2, np.random.default_rng(0))


@pytest.mark.parametrize("name", FILES)
def test_factory_calibrations_are_recovered(recordings: Path, name: str) -> None:
    arm = load_arm(name.split("_")[0])
    form = drawing_of(arm).form
    table = placed(
        form, read_calibration(recordings / "ur_calibration_yaml" / f"{name}.yaml"), arm.name
    )
    rng = np.random.default_rng(11)
    poses = session(arm, rng, 200, noise=1e-5, own=True, table=table).poses
    start = drawn(arm, drawing_of(arm))
    found = solve(start, poses, everything(start, poses, tool=False), rng)
    elsewhere = rng.uniform(-np.pi, np.pi, (500, 6))
    ours, true = flange(found.placement.table, elsewhere), flange(table, elsewhere)
    assert np.linalg.norm((ours - true)[:, :3, 3], axis=1).max() < 2e-5


@pytest.mark.parametrize("name", ["robot_l1.csv", "robot_data_o1.csv"])
def test_a_hand_guided_robots_own_poses_are_explained(recordings: Path, name: str) -> None:
    arm = load_arm("ur5e")
    poses = read_poses(recordings / "ur5e_freedrive" / name, arm.joint_names)
    found = calibrate(arm, poses)
    e = np.linalg.norm(found.found.residuals[:, :3], axis=1)
    assert e.max() < 5e-5
    np.testing.assert_allclose(found.found.placement.tool[:2, 3], 0.0, atol=2e-4)
    assert 0.18 < found.found.placement.tool[2, 3] < 0.20  # a gripper's length


@pytest.mark.slow
def test_days_that_were_not_seen_are_predicted(recordings: Path) -> None:
    arm = load_arm("ur10")
    poses = read_poses(recordings / "ur10_laser_tracker" / "series_a.csv", arm.joint_names)
    stamp = read_table(
        recordings / "ur10_laser_tracker" / "series_a.csv", channels=["elbow_joint"]
    )[0].channels["timestamp"]
    late = stamp > 2.0200716e13
    found = calibrate(arm, poses.take(np.flatnonzero(~late)))
    score = evaluate(
        arm,
        poses.take(np.flatnonzero(late)),
        Recorded(found.geometric.placement, found.found.placement),
    )
    off = {k: rms(f, score.sound) for k, f in score.fits.items()}
    assert off["geometry and joints"] < 0.5 * off["geometry"] < 0.7 * off["nominal"]
    assert off["geometry and joints"] < 2.0 * np.median(found.space.error)


def test_what_calibrates_may_be_scored_too(ur5e: Arm) -> None:
    one = session(ur5e, np.random.default_rng(12), 40).poses
    recorded = Recorded(drawn(ur5e, drawing_of(ur5e)), None)
    lost = one.place.copy()
    lost[7, 1] = np.nan
    assert len(evaluate(ur5e, replace(one, place=lost), recorded).poses) == 39
    with pytest.raises(InputError, match="the poses are of 5 joints; ur5e has 6"):
        evaluate(ur5e, replace(one, q=one.q[:, :5]), recorded)


def test_a_log_is_no_poses(ur10e: Arm) -> None:
    with pytest.raises(InputError, match=r"poses: takes a Poses, as urdyn.read_poses"):
        calibrate(ur10e, Log(np.zeros(0), {}))  # type: ignore[arg-type]
