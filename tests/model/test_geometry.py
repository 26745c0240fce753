"""Laws of an arm's geometry: coordinates, poses, and the forms of other tools."""

from __future__ import annotations

import numpy as np
import pytest
from deltas import table_of

from urdyn.errors import ArmError
from urdyn.model.arm import Arm, load_arm, read_arm
from urdyn.model.describe import describe
from urdyn.model.geometry.canonical import coordinates
from urdyn.model.geometry.chain_pose import flange, reach
from urdyn.model.geometry.dh import Deltas, deltas_of
from urdyn.model.geometry.drawing import drawing_of, placed, redrawn
from urdyn.model.geometry.transmission import compliance, transmission
from urdyn.model.geometry.turns import places_of, rotation_vector, turn_z
from urdyn.types import Array

NAMES = ("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "ur16e", "ur20", "ur30")
EXACT = 1e-12  # of numbers near one that went through some ten roundings


def deviated(arm: Arm, seed: int, size: float = 2e-3) -> Array:
    form = drawing_of(arm).form
    return form.table(size * np.random.default_rng(seed).standard_normal(int(form.free.sum())))


def angles(count: int) -> Array:
    return np.random.default_rng(5).uniform(-3.0, 3.0, (count, 6))


@pytest.mark.parametrize("name", NAMES)
def test_the_drawing_puts_the_flange_where_pinocchio_does(name: str) -> None:
    arm = load_arm(name)
    drawing, q = drawing_of(arm), angles(20)
    ours = drawing.base @ flange(drawing.form.nominal, q) @ drawing.tool
    np.testing.assert_allclose(ours, arm.pose(q), atol=EXACT)


def test_twenty_two_coordinates_and_eighteen_between_base_and_tool(ur10e: Arm) -> None:
    # Four a joint: 24; the base fixes two of the first axis, which Hayati's two tilts replace two
    # d of. Base and tool take d and theta of the first and the last joint.
    form = drawing_of(ur10e).form
    assert form.free.sum() == 22
    twists = reach(deviated(ur10e, 0), angles(60)).twists[:, :, form.free]
    with_tool = np.concatenate([twists, np.zeros((60, 6, 12))], axis=2)
    pose = flange(deviated(ur10e, 0), angles(60))
    with_tool[:, :3, 22:25] = with_tool[:, 3:, 25:28] = np.eye(3)
    with_tool[:, :3, 25:28] = np.cross(np.eye(3), pose[:, None, :3, 3]).swapaxes(1, 2)
    with_tool[:, :3, 28:31] = with_tool[:, 3:, 31:34] = pose[:, :3, :3]
    assert np.linalg.matrix_rank(twists.reshape(-1, 22), tol=1e-6) == 22
    assert np.linalg.matrix_rank(with_tool.reshape(-1, 34), tol=1e-6) == 18 + 12


def test_twists_are_finite_differences(ur5e: Arm) -> None:
    table, q, step = deviated(ur5e, 1), angles(10), 1e-6
    twists = reach(table, q).twists
    for joint in range(6):
        for kind in range(5):
            ends = [np.array(table), np.array(table)]
            ends[0][joint, kind] += step
            ends[1][joint, kind] -= step
            ahead, behind = (flange(end, q) for end in ends)
            linear = (ahead - behind)[:, :3, 3]
            angular = rotation_vector(ahead[:, :3, :3] @ behind[:, :3, :3].swapaxes(1, 2))
            slope = np.concatenate([linear, angular], axis=1) / (2.0 * step)
            # Central differences: step² / 6 of a third derivative near one, and roundings / step.
            np.testing.assert_allclose(slope, twists[:, :, joint, kind], atol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_frames_of_any_convention_become_the_same_coordinates(name: str) -> None:
    arm = load_arm(name)
    form, table = drawing_of(arm).form, deviated(arm, 2)
    np.testing.assert_allclose(coordinates(form, places_of(table)), table, atol=EXACT)
    # Frames may sit anywhere along and about their axes, but for the last.
    rng, frames = np.random.default_rng(3), places_of(table)
    slides = turn_z(rng.uniform(-3.0, 3.0, 5))
    slides[:, 2, 3] = rng.uniform(-1.0, 1.0, 5)
    frames[:5] = frames[:5] @ slides
    frames[1:] = np.linalg.inv(slides) @ frames[1:]
    q = np.zeros((1, 6))
    moved = coordinates(form, frames)
    np.testing.assert_allclose(flange(moved, q), flange(table, q), atol=EXACT)
    np.testing.assert_allclose(moved[:, :4], table[:, :4], atol=EXACT)


@pytest.mark.parametrize("seed", range(4))
def test_dh_deltas_and_back_is_the_same_arm(ur10e: Arm, seed: int) -> None:
    form, table = drawing_of(ur10e).form, deviated(ur10e, seed)
    deltas = deltas_of(form, table)
    assert np.abs(deltas.d[1:4]).max() > 1.0  # the common normals of parallel axes are far away
    np.testing.assert_allclose(table_of(form, deltas), table, atol=EXACT)
    again = deltas_of(form, table_of(form, deltas))
    for name in ("theta", "d", "a", "alpha"):
        before, after = getattr(deltas, name), getattr(again, name)
        np.testing.assert_allclose(after, before, rtol=EXACT, atol=EXACT)


def test_no_deltas_are_the_drawing(ur5e: Arm) -> None:
    form = drawing_of(ur5e).form
    nothing = Deltas(*np.zeros((4, 6)))
    np.testing.assert_allclose(table_of(form, nothing), form.nominal, atol=EXACT)


def test_urdf_and_back_is_the_same_arm_with_the_same_bodies(ur5e: Arm) -> None:
    table, q = deviated(ur5e, 4), angles(20)
    arm = redrawn(ur5e, table)
    read = read_arm(describe(arm, arm.inertials))
    drawing = drawing_of(read)
    np.testing.assert_allclose(drawing.form.nominal, table, atol=EXACT)
    np.testing.assert_allclose(read.pose(q), drawing.base @ flange(table, q), atol=EXACT)
    np.testing.assert_allclose(read.inertials, ur5e.inertials, atol=EXACT)


def test_a_turned_frame_is_refused_by_its_joint(ur10e: Arm) -> None:
    form = drawing_of(ur10e).form
    frames = places_of(form.nominal)
    frames[2, :3, :3] = frames[2, :3, :3] @ np.diag([-1.0, 1.0, -1.0])  # half a turn about y
    with pytest.raises(ArmError, match=r"elbow_joint is turned by 180\.0 deg"):
        placed(form, frames, "ur10e")


def test_another_arms_frames_are_refused(ur10e: Arm) -> None:
    other = drawing_of(load_arm("ur3")).form.nominal
    with pytest.raises(ArmError, match="no ur10e is built like this"):
        placed(drawing_of(ur10e).form, places_of(other), "ur10e")


def test_effects_shift_the_joint_that_owns_them(ur5e: Arm) -> None:
    q = angles(7)
    effects = transmission(compliance(ur5e, q), 2)
    assert effects.compliant == (1, 2)
    values = np.arange(1.0, len(effects.owners) + 1.0)
    named = dict(zip(effects.names, values, strict=True))
    shift = effects.shift(values, q)
    wave = sum(
        named[f"wrist_1_joint.sin{h}"] * np.sin(h * q[:, 3])
        + named[f"wrist_1_joint.cos{h}"] * np.cos(h * q[:, 3])
        for h in (1, 2)
    )
    np.testing.assert_allclose(shift[:, 3], wave, atol=1e-12 * values[-1])
    still = np.zeros_like(q)
    soft = shift - effects.shift(np.concatenate([[0.0, 0.0], values[2:]]), q)
    np.testing.assert_allclose(soft[:, 1], -values[0] * ur5e.torque(q, still, still)[:, 1])
