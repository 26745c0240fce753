"""An arm's description as coordinates of its geometry, and back into a description."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.errors import ArmError
from urdyn.model.arm import Arm
from urdyn.model.chain import parse
from urdyn.model.geometry.canonical import coordinates
from urdyn.model.geometry.chain_pose import flange
from urdyn.model.geometry.hayati import Form, form_of, require_drawn
from urdyn.model.geometry.origins import origins_of, with_origins
from urdyn.model.geometry.turns import inverse, places_of, pose_of
from urdyn.types import Array

ABSURD = 0.05  # [m] no real arm has its flange so far from where it is drawn
SAMPLES = 400  # joint configurations at which this is judged


@dataclass(frozen=True, eq=False)
class Drawing:
    """An arm's geometry by its description."""

    form: Form
    base: Array  # (4, 4) transform_base_to_root: the link that the first joint turns in
    tool: Array  # (4, 4) transform_tool_to_flange: of the description's tool in the last link


def drawing_of(arm: Arm) -> Drawing:
    """The geometry that `arm`'s URDF draws; ArmError where it is not that of such an arm."""
    joints = _joints(arm)
    for name, link in zip(arm.joint_names[1:], arm.link_names, strict=False):
        if _parent(joints[name]) != link:
            raise ArmError(f"{arm.name}: {name!r} hangs on a fixed joint; calibrate wants none")
    places, turns = map(np.array, zip(*origins_of(arm), strict=True))
    origins = pose_of(places, Rotation.from_euler("xyz", turns).as_matrix())
    require_drawn(origins, arm.name)
    rest = np.zeros(arm.joints)
    base = arm.pose(rest, _parent(joints[arm.joint_names[0]]))
    tool = inverse(arm.pose(rest, arm.link_names[-1])) @ arm.pose(rest)
    return Drawing(form_of(arm.joint_names, origins), base, tool)


def redrawn(arm: Arm, table: Array) -> Arm:
    """The arm with the geometry a ... theta `table` (J, 5), and the same bodies on its joints."""
    return with_origins(arm, ((pose[:3, 3], angles(pose)) for pose in places_of(table)))


def angles(pose: Array) -> Array:
    """Roll, pitch, yaw (3,) [rad] of a pose, about fixed axes as in a URDF."""
    return np.asarray(Rotation.from_matrix(pose[:3, :3]).as_euler("xyz"))


def placed(form: Form, origins: Array, robot: str) -> Array:
    """(J, 5) a ... theta of frames (J, 4, 4) from a file; ArmError where no such arm was built."""
    with np.errstate(all="ignore"):
        table = coordinates(form, origins)
    known = bool(np.isfinite(table).all())
    off = _off(form, table) if known else 0.0
    if known and off <= ABSURD:
        return table
    joint, what = _worst(form, origins)
    raise ArmError(
        f"no {robot} is built like this: {form.joint_names[joint]} is {what} the drawing, and the "
        f"tool as much as {1e3 * off:.0f} mm from where it is drawn; look at that joint's Euler "
        "angles, and whether the file is of this type of arm"
    )


def _off(form: Form, table: Array) -> float:
    """How far an arm's flange is from where it is drawn, in the worst of SAMPLES poses [m]."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (SAMPLES, len(table)))
    moved = flange(table, q) - flange(form.nominal, q)
    return float(np.linalg.norm(moved[:, :3, 3], axis=1).max())


def _worst(form: Form, origins: Array) -> tuple[int, str]:
    """The joint whose frame is farthest from the drawing, and how far."""
    drawn = places_of(form.nominal)
    turn = Rotation.from_matrix(
        np.swapaxes(drawn[:, :3, :3], 1, 2) @ origins[:, :3, :3]
    ).magnitude()
    shift = np.linalg.norm(origins[:, :3, 3] - drawn[:, :3, 3], axis=1)
    joint = int(np.argmax(turn + shift))
    if turn[joint] > shift[joint]:
        return joint, f"turned by {np.degrees(turn[joint]):.1f} deg from"
    return joint, f"{1e3 * shift[joint]:.0f} mm from"


def _joints(arm: Arm) -> dict[str, ET.Element]:
    """The moving joints by name, each about its own z."""
    joints = {joint.get("name", ""): joint for joint in parse(arm.urdf).iter("joint")}
    for name in arm.joint_names:
        axis = joints[name].find("axis")
        words = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
        if [float(word) for word in words.split()] != [0.0, 0.0, 1.0]:
            raise ArmError(f"{arm.name}: {name!r} turns about {words}; calibrate wants axes 0 0 1")
        if joints[name].get("type") == "prismatic":
            raise ArmError(f"{arm.name}: {name!r} slides; calibrate knows joints that turn")
    return joints


def _parent(joint: ET.Element) -> str:
    parent = joint.find("parent")
    return "" if parent is None else parent.get("link", "")
