"""What is drawn stands where the arm is."""

from __future__ import annotations

import re
from io import BytesIO

import numpy as np
import pytest

pytest.importorskip("yourdfpy")
from scipy.spatial.transform import Rotation

from urdyn.model.arm import load_arm, read_arm
from urdyn.model.library import names
from urdyn.view import shapes as drawing
from urdyn.view.scene import STRIDE, Scene, quaternion
from urdyn.view.shapes import PUBLISHED, Shape, shapes

ROUNDING = 1e-9  # [m]; published descriptions write pi / 2 with eleven digits


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def skeleton(arm) -> tuple[Shape, ...]:
    """Links without a body: all that poses are of."""
    corner = np.zeros((1, 3)), np.zeros((0, 3), dtype=np.intp)
    links = ("base_link", *arm.link_names)
    return tuple(Shape(link, j - 1, *corner) for j, link in enumerate(links))


@pytest.mark.parametrize("name", names())
def test_links_stand_where_two_libraries_say_they_do(name, rng):
    """Pinocchio, which the scene asks, and yourdfpy, which the pictures come from."""
    import yourdfpy

    arm = load_arm(name)
    other = yourdfpy.URDF.load(BytesIO(arm.urdf.encode()), load_meshes=False)
    scene = Scene(arm, arm, skeleton(arm))
    for q in rng.uniform(-np.pi, np.pi, (5, 6)):
        other.update_cfg(dict(zip(arm.joint_names, q, strict=True)))
        places = scene.places(q, np.zeros(6))
        for shape, place in zip(scene.shapes, places, strict=True):
            np.testing.assert_allclose(place, arm.pose(q, shape.link), atol=0)
            np.testing.assert_allclose(
                place, other.get_transform(shape.link, "base_link"), atol=ROUNDING
            )


@pytest.mark.parametrize("name", names())
def test_every_link_has_a_body_that_reaches_no_further_than_the_arm(name):
    arm = load_arm(name)
    found = shapes(arm)
    assert [s.joint for s in found] == [-1, 0, 1, 2, 3, 4, 5]
    reach = np.ptp([arm.pose(np.zeros(6), link)[:3, 3] for link in arm.link_names], axis=0).max()
    for shape in found:
        assert np.isfinite(shape.vertices).all() and shape.faces.max() < len(shape.vertices)
        assert np.abs(shape.vertices).max() < reach


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_meshes_move_as_they_do_in_their_own_description(name, rng):
    """In other frames, of which nothing is asked but how they stand at zero."""
    import yourdfpy

    arm = load_arm(name)
    folder = drawing._package()
    assert folder is not None, "example-robot-data is a dependency"
    path = folder / "urdf" / f"{name}_robot.urdf"
    theirs = yourdfpy.URDF.load(BytesIO(path.read_bytes()), load_meshes=False)
    ours = {s.link: s for s in shapes(arm)}
    for q in rng.uniform(-np.pi, np.pi, (3, 6)):
        theirs.update_cfg(dict(zip(arm.joint_names, q, strict=True)))
        for link in arm.link_names:
            (mesh,) = drawing._visuals(theirs.link_map[link], folder)
            there = mesh.apply_transform(theirs.get_transform(link, "base_link")).vertices
            here = moved(arm.pose(q, link), ours[link].vertices)
            np.testing.assert_allclose(here, there, atol=1e-6)


def test_a_prefix_of_its_names_does_not_change_how_an_arm_looks():
    arm = load_arm("ur5")
    prefixed = read_arm(re.sub(r'((?<!robot )name|link)="', r'\1="left_', arm.urdf))
    for bare, other in zip(shapes(arm), shapes(prefixed), strict=True):
        assert (other.link, other.joint) == (f"left_{bare.link}", bare.joint)
        np.testing.assert_array_equal(other.vertices, bare.vertices)


def moved(pose, points):
    return points @ pose[:3, :3].T + pose[:3, 3]


def test_an_arm_without_shapes_is_drawn_as_sticks():
    bare = re.sub(r"<(visual|collision)>.*?</\1>", "", load_arm("ur5e").urdf, flags=re.S)
    found = {s.joint for s in shapes(read_arm(bare))}
    assert {1, 2, 3, 4} <= found


def test_a_mesh_that_is_not_there_is_no_reason_to_fail(ur5e):
    text = re.sub(r"<(cylinder|sphere).*?/>", '<mesh filename="package://a/b.stl"/>', ur5e.urdf)
    assert shapes(read_arm(text))


@pytest.fixture
def scene(ur5e) -> Scene:
    other = ur5e.urdf.replace('xyz="-0.425 0 0"', 'xyz="-0.427 0.001 0"')
    assert other != ur5e.urdf
    return Scene(read_arm(other), ur5e, skeleton(ur5e))


def test_zeros_are_added_to_what_the_encoders_tell(scene, rng):
    q, zero = rng.standard_normal((2, 6))
    np.testing.assert_array_equal(scene.places(q, zero), scene.places(q + zero, np.zeros(6)))


@pytest.mark.parametrize("times", [0.0, 1.0, 30.0])
def test_a_ghost_stands_as_many_times_as_far_off(scene, rng, times):
    q, zero = rng.standard_normal(6), 1e-3 * rng.standard_normal(6)
    solid, ghosts = scene.places(q, zero), scene.ghosts(q, zero, times)
    nominal = np.stack([scene.nominal.pose(q, s.link) for s in scene.shapes])
    way = nominal[:, :3, 3] - solid[:, :3, 3]
    np.testing.assert_allclose(ghosts[:, :3, 3] - solid[:, :3, 3], times * way, atol=1e-12)
    turn = [
        Rotation.from_matrix(a.T @ b).magnitude()
        for a, b in zip(solid[:, :3, :3], ghosts[:, :3, :3], strict=True)
    ]
    once = [
        Rotation.from_matrix(a.T @ b).magnitude()
        for a, b in zip(solid[:, :3, :3], nominal[:, :3, :3], strict=True)
    ]
    np.testing.assert_allclose(turn, times * np.array(once), atol=1e-7)


def test_the_distance_between_tools_is_told(scene):
    metres, radians = scene.apart(np.zeros(6), np.zeros(6))
    assert metres == pytest.approx(np.hypot(2e-3, 1e-3)) and radians == pytest.approx(0.0, abs=1e-7)


def test_arrows_lie_on_the_axes_and_are_as_long_as_the_torque_is_great(scene, rng):
    q = rng.standard_normal(6)
    torque = np.array([1.0, -2.0, 3.0, np.nan, 0.0, -0.5])
    start, end = np.moveaxis(scene.arrows(q, np.zeros(6), torque, 0.1), 1, 0)
    for j, link in enumerate(scene.arm.link_names):
        pose = scene.arm.pose(q, link)
        axis = pose[:3, 2]  # every joint of this arm turns about the z of the link that it moves
        np.testing.assert_allclose(
            end[j] - start[j], 0.1 * np.nan_to_num(torque[j]) * axis, atol=1e-12
        )
        beside = np.linalg.norm(np.cross(start[j] - pose[:3, 3], axis))
        assert beside < 1e-12 and np.linalg.norm(start[j] - pose[:3, 3]) == pytest.approx(STRIDE)


def test_a_quaternion_turns_as_its_pose_does(scene, rng):
    pose = scene.arm.pose(rng.standard_normal(6))
    w, x, y, z = quaternion(pose)
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), pose[:3, :3])
