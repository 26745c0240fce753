"""Writes the URDF of every arm in arms.toml, beside it: `python urdf/write.py`.

The result is checked in and a test holds it equal to what this script writes. Frames, link names
and joint names are those of the Universal Robots ROS 2 description; in its frames every joint turns
about z, and a Denavit-Hartenberg row becomes one joint origin.
"""

from __future__ import annotations

import math
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

Facts = dict[str, Any]  # one arm's table of arms.toml
Vector = tuple[float, float, float]  # [m], or roll, pitch, yaw [deg]

HERE = Path(__file__).parent
ZERO: Vector = (0.0, 0.0, 0.0)

# joint, and the link that it moves
CHAIN = {
    "shoulder_pan_joint": "shoulder_link",
    "shoulder_lift_joint": "upper_arm_link",
    "elbow_joint": "forearm_link",
    "wrist_1_joint": "wrist_1_link",
    "wrist_2_joint": "wrist_2_link",
    "wrist_3_joint": "wrist_3_link",
}

# joint, parent, frame and its roll, pitch, yaw [deg]: what is bolted on, at the parent's origin.
# base is the controller's, whose x points backwards; ft_frame is where the wrench is reported.
FRAMES: tuple[tuple[str, str, str, Vector], ...] = (
    ("base_link-base_fixed_joint", "base_link", "base", (0, 0, 180)),
    ("wrist_3_link-ft_frame", "wrist_3_link", "ft_frame", (180, 0, 0)),
    ("wrist_3-flange", "wrist_3_link", "flange", (0, -90, -90)),
    ("flange-tool0", "flange", "tool0", (90, 0, 90)),
)
FOOT = ("base_link-base_link_inertia", "base_link", "base_link_inertia", (0, 0, 180))

HEADER = """<?xml version="1.0"?>
<!-- Written by urdf/write.py from urdf/arms.toml; change those, not this.
     Numbers: Universal Robots ROS 2 description, October 2024, BSD-3-Clause. Shapes: ours. -->
"""

# MuJoCo reads this, everyone else skips it: keep the inertias as they are and the pictures too.
MUJOCO = {"balanceinertia": "false", "discardvisual": "false"}


def main() -> None:
    """Write every arm's file."""
    for name, text in texts().items():
        (HERE / f"{name}.urdf").write_text(text, encoding="utf-8", newline="\n")


def texts() -> dict[str, str]:
    """Every arm's URDF by the arm's name."""
    arms = tomllib.loads((HERE / "arms.toml").read_text(encoding="utf-8"))
    return {name: HEADER + document(robot(name, facts)) for name, facts in arms.items()}


def document(root: ET.Element) -> str:
    """`root` as indented text that ends in a newline."""
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def robot(name: str, facts: Facts) -> ET.Element:
    """One arm from base_link to tool0."""
    root = ET.Element("robot", name=name)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", MUJOCO)
    ET.SubElement(root, "link", name="base_link")
    root.extend([base(facts), fixed(*FOOT)])
    for i, (joint, link) in enumerate(CHAIN.items()):
        root.extend([body(link, facts), moving(joint, i, facts)])
    for name, parent, frame, rpy in FRAMES:
        ET.SubElement(root, "link", name=frame)
        root.append(fixed(name, parent, frame, rpy))
    return root


def base(facts: Facts) -> ET.Element:
    """The foot: a solid cylinder that ends just below the shoulder."""
    mass, radius = facts["base_mass"], facts["radius"]["foot"]
    height = 0.9 * (facts["dh"]["d1"] - facts["radius"]["upper_arm"])
    across, along = mass * (3 * radius**2 + height**2) / 12, mass * radius**2 / 2
    link = ET.Element("link", name="base_link_inertia")
    link.append(inertial(mass, (0, 0, height / 2), ZERO, (across, 0, 0, across, 0, along)))
    link.extend(shapes([cylinder(ZERO, (0, 0, height), radius)]))
    return link


def body(name: str, facts: Facts) -> ET.Element:
    """A link that moves: its inertia and its shape."""
    link, given = ET.Element("link", name=name), facts[name]
    axes = given.get("axes", ZERO)
    link.append(inertial(given["mass"], given["com"], axes, given["inertia"]))
    link.extend(shapes(solids(facts)[name]))
    return link


def inertial(
    mass: float, com: Iterable[float], axes: Iterable[float], inertia: Iterable[float]
) -> ET.Element:
    """Mass [kg], its centre [m], and inertia [kg m²] about it in axes turned by `axes` [deg]."""
    element = ET.Element("inertial")
    element.append(origin(com, axes))
    ET.SubElement(element, "mass", value=numbers([mass]))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    values = {name: numbers([value]) for name, value in zip(names, inertia, strict=True)}
    ET.SubElement(element, "inertia", values)
    return element


def placements(dh: dict[str, float]) -> list[tuple[Vector, Vector]]:
    """Where each joint sits on the link before it: xyz [m] and roll, pitch, yaw [deg]."""
    return [
        ((0, 0, dh["d1"]), ZERO),
        (ZERO, (90, 0, 0)),
        ((dh["a2"], 0, 0), ZERO),
        ((dh["a3"], 0, dh["d4"]), ZERO),
        ((0, -dh["d5"], 0), (90, 0, 0)),
        ((0, dh["d6"], 0), (-90, 0, 0)),
    ]


def moving(name: str, i: int, facts: Facts) -> ET.Element:
    """Joint `i`: it turns about z of its own frame, a full turn each way, the elbow half of it."""
    joint = ET.Element("joint", name=name, type="revolute")
    if name == "wrist_3_joint" and facts["endless"]:
        joint.append(
            ET.Comment(" endless on the real arm; limited here so that q has six numbers ")
        )
    parent = ["base_link_inertia", *CHAIN.values()][i]
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=CHAIN[name])
    joint.append(origin(*placements(facts["dh"])[i]))
    ET.SubElement(joint, "axis", xyz="0 0 1")
    turn = math.pi if name == "elbow_joint" else 2 * math.pi
    bounds = {"lower": -turn, "upper": turn, "effort": facts["effort"][i]}
    bounds["velocity"] = math.radians(facts["speed"][i])
    ET.SubElement(joint, "limit", {key: numbers([value]) for key, value in bounds.items()})
    return joint


def fixed(name: str, parent: str, child: str, rpy: Vector) -> ET.Element:
    """A joint that does not move: `child` turned by `rpy` [deg] about the parent's origin."""
    joint = ET.Element("joint", name=name, type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    joint.append(origin(ZERO, rpy))
    return joint


def solids(facts: Facts) -> dict[str, list[ET.Element]]:
    """The shape of every moving link: tubes along the kinematics, at the height of their mass."""
    dh, radius = facts["dh"], facts["radius"]
    upper, fore = facts["upper_arm_link"]["com"][2], facts["forearm_link"]["com"][2]
    a2, a3, wrist = dh["a2"], dh["a3"], radius["wrist"]
    return {
        "shoulder_link": tube([ZERO, (0, -upper / 2, 0)], radius["upper_arm"]),
        "upper_arm_link": tube([(0, 0, upper), (a2, 0, upper), (a2, 0, fore)], radius["upper_arm"]),
        "forearm_link": tube(
            [(0, 0, fore), (a3, 0, fore), (a3, 0, (fore + dh["d4"]) / 2)], radius["forearm"]
        ),
        "wrist_1_link": tube([ZERO, (0, -dh["d5"] / 2, 0)], wrist),
        "wrist_2_link": tube([ZERO, (0, dh["d6"] / 2, 0)], wrist),
        "wrist_3_link": [cylinder((0, 0, -dh["d6"] / 3), ZERO, wrist)],
    }


def tube(points: list[Vector], radius: float) -> list[ET.Element]:
    """A bent tube through `points` [m], rounded at its corners and ends."""
    balls = [sphere(point, radius) for point in points]
    return balls + [cylinder(start, stop, radius) for start, stop in pairwise(points)]


def sphere(centre: Vector, radius: float) -> ET.Element:
    """A placed ball [m]."""
    return solid("sphere", centre, ZERO, radius=radius)


def cylinder(start: Vector, stop: Vector, radius: float) -> ET.Element:
    """A placed cylinder [m] between two points that lie along one axis of the link's frame."""
    span = [b - a for a, b in zip(start, stop, strict=True)]
    axis = max(range(3), key=lambda i: abs(span[i]))
    turn: Vector = ((0, 90, 0), (90, 0, 0), ZERO)[axis]  # from z, along which a cylinder stands
    x, y, z = ((a + b) / 2 for a, b in zip(start, stop, strict=True))
    return solid("cylinder", (x, y, z), turn, radius=radius, length=abs(span[axis]))


def solid(kind: str, centre: Vector, rpy: Vector, **size: float) -> ET.Element:
    """A placed shape; the caller names what it is for."""
    element = ET.Element("solid")
    element.append(origin([round(value, 6) for value in centre], rpy))
    rounded = {key: numbers([round(value, 6)]) for key, value in size.items()}
    ET.SubElement(ET.SubElement(element, "geometry"), kind, rounded)
    return element


def shapes(placed: list[ET.Element]) -> list[ET.Element]:
    """Every placed shape twice: to be seen and to collide."""
    return [as_role(shape, role) for role in ("visual", "collision") for shape in placed]


def as_role(shape: ET.Element, role: str) -> ET.Element:
    """`shape` under the tag that says what it is for."""
    element = ET.Element(role)
    element.extend(shape)
    return element


def origin(xyz: Iterable[float], rpy: Iterable[float]) -> ET.Element:
    """A pose from metres and degrees; right angles keep all their digits."""
    return ET.Element("origin", xyz=numbers(xyz), rpy=numbers(map(math.radians, rpy)))


def numbers(values: Iterable[float]) -> str:
    """Shortest text that reads back as the same doubles; no trailing .0, no negative zero."""
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in values)


if __name__ == "__main__":
    main()
