"""Where joints' frames are by a description, read and rewritten."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from urdyn.model.arm import Arm, read_arm, with_inertials
from urdyn.model.chain import parse
from urdyn.types import Array

Origin = tuple[Array, Array]  # xyz (3,) [m] and rpy (3,) [rad] in the link before, as in a URDF


def origins_of(arm: Arm) -> list[Origin]:
    """The origin of each joint's frame."""
    joints = {joint.get("name"): joint for joint in parse(arm.urdf).iter("joint")}
    return [_origin(joints[name]) for name in arm.joint_names]


def with_origins(arm: Arm, origins: Iterable[Origin]) -> Arm:
    """The arm with its joints' frames there, and the same bodies on them."""
    root = parse(arm.urdf)
    joints = {joint.get("name"): joint for joint in root.iter("joint")}
    for name, origin in zip(arm.joint_names, origins, strict=True):
        for old in joints[name].findall("origin"):
            joints[name].remove(old)
        words = (" ".join(map(repr, x.tolist())) for x in origin)
        ET.SubElement(joints[name], "origin", dict(zip(("xyz", "rpy"), words, strict=True)))
    built = read_arm(ET.tostring(root, encoding="unicode"), arm.name)
    return with_inertials(built, arm.inertials)


def _origin(joint: ET.Element) -> Origin:
    origin = joint.find("origin")
    told = {} if origin is None else origin.attrib
    place, turn = (np.array(told.get(k, "0 0 0").split(), float) for k in ("xyz", "rpy"))
    return place, turn
