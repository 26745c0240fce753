"""Laws of clearance: distances are those of geometry and change no faster than is told."""

from __future__ import annotations

import itertools
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest

from urdyn.errors import ArmError, InputError
from urdyn.model.arm import load_arm, read_arm
from urdyn.model.cell import STANDING, Cell, Solid, Wall, floor
from urdyn.model.collision import collider, free
from urdyn.model.solids import geometry

ARMS = ("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "ur16e", "ur20", "ur30")
UPRIGHT = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
GJK = 1e-5  # [m] to which coal's iterations, ended at 1e-6, tell a cylinder's distance


def poses(arm, n: int, seed: int = 0):
    return np.random.default_rng(seed).uniform(arm.lower, arm.upper, (n, arm.joints))


@pytest.mark.parametrize("robot", ARMS)
def test_every_arm_is_free_upright_and_not_when_it_reaches_into_the_floor(robot):
    arm = load_arm(robot)
    down = np.array([0.0, np.pi / 4, 0.0, 0.0, 0.0, 0.0])
    assert free(arm, np.array([UPRIGHT, down])).tolist() == [True, False]


def test_distance_to_a_wall_is_that_of_the_capsules_farthest_point(ur10e):
    wall = Wall("wall", np.array([0.0, 0.0, 3.0]), np.array([0.0, 0.0, -2.0]))
    found = collider(ur10e, Cell(walls=(wall,)))
    k = next(k for k, pair in enumerate(found.pairs) if pair == ("wall", "forearm_link_3"))
    # The forearm upright: its upper ball is centred on the fourth joint's height.
    top = 0.1807 + 0.6127 + 0.57155
    near = found.distances(UPRIGHT)[k]
    np.testing.assert_allclose(near, 3.0 - top - 0.058, rtol=0, atol=2e-4)


@pytest.mark.parametrize("robot", ["ur3e", "ur10e"])
def test_no_distance_changes_faster_than_the_reach(robot):
    arm = load_arm(robot)
    touch, q = collider(arm), poses(arm, 300)
    for step in (1e-3, 0.1):
        dq = step * np.random.default_rng(1).standard_normal(q.shape)
        change = touch.distances(q + dq) - touch.distances(q)
        # Depths of overlap are not distances: they may jump.
        apart = np.minimum(touch.distances(q + dq), touch.distances(q)) > 0.0
        assert (apart * np.abs(change) <= np.abs(dq) @ touch.reach.T + GJK).all()


def test_slopes_are_the_derivatives_of_distance(ur10e):
    touch, q, h = collider(ur10e), poses(ur10e, 150), 1e-4
    near, slope = touch.slopes(q, np.inf)
    assert slope.shape == (*near.shape, 6)
    for j, step in enumerate(h * np.eye(6)):
        difference = (touch.distances(q + step) - touch.distances(q - step)) / (2.0 * h)
        error = np.abs(difference - slope[:, :, j])[near > 0.01]
        # Nearest points jump between the rims of cylinders: there, and only there, slopes do too.
        assert np.quantile(error, 0.99) < 2.0 * GJK / h
        assert np.median(error) < 1e-5


def test_far_pairs_have_no_slope(ur10e):
    near, slope = collider(ur10e).slopes(poses(ur10e, 20), 0.1)
    assert not slope[near >= 0.1].any()
    assert slope[near < 0.1].any()


def test_a_box_and_a_tool_are_seen(ur10e):
    tool = ur10e.pose(UPRIGHT)
    box = Solid("fixture", "box", np.full(3, 0.1), xyz=tool[:3, 3] + 0.35 * tool[:3, 2])
    long = Solid("gripper", "cylinder", np.array([0.03, 0.4]), xyz=np.array([0.0, 0.0, 0.2]))
    assert free(ur10e, UPRIGHT, Cell(solids=(box,)))
    with_tool = Cell(solids=(box,), tool=(long,))
    assert ("fixture", "gripper") in collider(ur10e, with_tool).pairs
    assert not free(ur10e, UPRIGHT, with_tool)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: Solid("b", "ball", -0.3 * np.ones(1)), r"size\[0\] is -0.3: .* above zero"),
        (lambda: Solid("b", "box", np.array([0.3, 0.0, 0.3])), r"size\[1\] is 0.0"),
        (lambda: Solid("b", "ball", np.array([np.inf])), r"size\[0\] is inf"),
        (lambda: Solid("b", "box", np.ones(2)), r"size .* \(2,\); .* \(3,\)"),
        (lambda: Solid("b", "cone", np.ones(1)), "no shape cone; there are box, ball, cylinder"),
        (lambda: Solid("b", "ball", np.ones(1), np.full(3, np.nan)), r"xyz\[0\] is nan"),
        (lambda: Wall("w", np.zeros(3), np.zeros(3)), "normal: points nowhere"),
        (lambda: floor(np.nan), r"point\[2\] is nan"),
    ],
)
def test_what_cannot_stand_in_a_cell_is_refused(made, said):
    with pytest.raises(InputError, match=said):
        made()


def test_leading_axes_are_kept(ur10e):
    q = poses(ur10e, 6).reshape(2, 3, 6)
    assert free(ur10e, q).shape == (2, 3)
    assert collider(ur10e).distances(q).shape[:2] == (2, 3)


def test_a_lower_floor_frees_more_poses(ur10e):
    q = poses(ur10e, 300)
    high, low = (free(ur10e, q, Cell(walls=(floor(z),))) for z in (0.0, -2.0))
    assert (high <= low).all()
    assert high.sum() < low.sum()
    assert (high == free(ur10e, q, STANDING)).all()


BALL = '<sphere radius="0.058" />'  # of a UR10e's forearm
FACETS = "".join(
    "facet normal 0 0 0\n outer loop\n" + "".join(f"  vertex {v}\n" for v in corners) + " endloop\n"
    "endfacet\n"
    for corners in itertools.combinations(("0 0 0", "0.1 0 0", "0 0.1 0", "0 0 0.1"), 3)
)


@pytest.mark.parametrize("name", ["meshes/pyramid.stl", "../a & 'b'/meshes/pyramid.stl"])
def test_meshes_lie_beside_the_urdf_that_names_them(ur10e, tmp_path, monkeypatch, name):
    folder = tmp_path / "a & 'b'"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "pyramid.stl").write_text(f"solid pyramid\n{FACETS}endsolid pyramid\n")
    text = ur10e.urdf.replace(BALL, f"<mesh filename={quoteattr(name)}/>")
    (folder / "arm.urdf").write_text(text)
    monkeypatch.chdir(tmp_path)
    found = load_arm(Path(folder.name, "arm.urdf"))
    monkeypatch.chdir("/")
    # Also out of a file that is elsewhere, such as a twin's.
    whole = geometry(read_arm(found.urdf), STANDING)
    assert any("pyramid" in thing.meshPath for thing in whole.geometryObjects)


def test_an_arm_whose_shape_nobody_knows_is_refused(ur10e):
    meshes = ur10e.urdf.replace(BALL, '<mesh filename="package://a/b.stl"/>')
    with pytest.raises(
        ArmError, match=r"b\.stl could not be found; .* that ROS_PACKAGE_PATH lists"
    ):
        collider(read_arm(meshes))
    lost = ur10e.urdf.replace(BALL, '<mesh filename="/nowhere/b.stl"/>')
    with pytest.raises(ArmError, match=r"^[^\n]*cannot be read: Could not load [^\n]*$"):
        collider(read_arm(lost))
    bare = ur10e.urdf.replace("collision>", "skipped>")
    with pytest.raises(ArmError, match="'shoulder_link' has no collision shape"):
        collider(read_arm(bare))
