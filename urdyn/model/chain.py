"""The serial chain that a URDF describes, read and checked before any library sees it.

Libraries differ in what they forgive, and some report on standard error only: whatever is wrong
with a description is reported here, in one line.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from urdyn.errors import ArmError

MOVING = ("revolute", "prismatic", "continuous")
TURN = 2.0 * math.pi  # limit of a continuous joint [rad]: an angle stays one number


@dataclass(frozen=True)
class Joint:
    """One joint of the file."""

    name: str
    kind: str  # "fixed" or one of MOVING
    parent: str
    child: str
    lower: float = -math.inf  # [rad] or [m], as all limits here
    upper: float = math.inf
    velocity: float = math.inf  # [rad/s] or [m/s]
    effort: float = math.inf  # [N m] or [N]


@dataclass(frozen=True)
class Chain:
    """Joints that move, base first, and for each the links that it moves as one body."""

    name: str
    joints: tuple[Joint, ...]
    bodies: tuple[tuple[str, ...], ...]  # the joint's own link first, then what is bolted to it
    frames: tuple[str, ...]  # every link of the file


class _Builder(ET.TreeBuilder):
    """Refuses a DOCTYPE: it has no use in a URDF, and its entities can read files or explode."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise ArmError("has a DOCTYPE; remove it, a URDF needs none")


def parse(text: str) -> ET.Element:
    """The <robot> of a URDF's text, comments inside it kept."""
    try:
        root = ET.fromstring(text, ET.XMLParser(target=_Builder(insert_comments=True)))
    except (ET.ParseError, ValueError) as error:
        raise ArmError(f"is not XML: {error}") from None
    if root.tag != "robot":
        raise ArmError(f"is not a URDF: its root is <{root.tag}>, not <robot>")
    if any("xacro}" in str(element.tag) for element in root.iter()):  # in any of its namespaces
        raise ArmError("is a xacro, not yet a URDF; `xacro FILE > arm.urdf` makes one of it")
    return root


def read_text(path: Path) -> str:
    """A file's text."""
    try:
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise ArmError(f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ArmError("is not a URDF: it is not UTF-8 text") from None


def read_chain(root: ET.Element) -> Chain:
    """The chain that `root` describes; ArmError where it is no serial chain of known joints."""
    frames = _names(root.findall("link"), "link")
    _names(root.findall("joint"), "joint")
    joints = [_joint(element) for element in root.findall("joint")]
    for link in root.findall("link"):
        _check_inertial(link)
    moving, bodies = _walk(_root(frames, joints), joints)
    reached = sum(map(len, bodies))
    if reached != len(frames):
        raise ArmError(f"only {reached} of {len(frames)} links hang together; look for a loop")
    if not moving:
        raise ArmError("has no joint that moves")
    return Chain(root.get("name", ""), tuple(moving), tuple(bodies[1:]), frames)


def _names(elements: Iterable[ET.Element], what: str) -> tuple[str, ...]:
    """The elements' names, present and unique."""
    names = tuple(element.get("name", "") for element in elements)
    for name in names:
        if not name or names.count(name) > 1:
            raise ArmError(f"{what} name {name!r} must be given, and only once")
    return names


def _joint(element: ET.Element) -> Joint:
    """One joint, its type and its limits checked."""
    name, kind = element.get("name", ""), element.get("type", "")
    what = f"joint {name!r}"
    if kind not in ("fixed", *MOVING):
        raise ArmError(f"{what} is of type {kind!r}; known are fixed, {', '.join(MOVING)}")
    if element.find("mimic") is not None:
        raise ArmError(f"{what} mimics another; an arm's joints are driven one by one")
    ends = [_require(element, end, what).get("link", "") for end in ("parent", "child")]
    for key in ("xyz", "rpy"):
        _check_vector(element, "origin", key, what)
    if kind == "fixed":  # exporters leave it an axis of zeros, and limits
        return Joint(name, kind, ends[0], ends[1])
    _check_vector(element, "axis", "xyz", what)
    return Joint(name, kind, ends[0], ends[1], *_limits(element, kind, what))


def _limits(element: ET.Element, kind: str, what: str) -> tuple[float, float, float, float]:
    """Lower, upper, velocity, effort; exporters write 0 for a missing one of the last two."""
    if kind == "continuous" and element.find("limit") is None:
        return *_within(element, -TURN, TURN, what), math.inf, math.inf
    limit = _require(element, "limit", what)
    velocity, effort = (_number(limit, k, what) or math.inf for k in ("velocity", "effort"))
    if velocity < 0.0 or effort < 0.0:
        raise ArmError(f"{what} has a negative limit of velocity or effort; write 0 for none")
    if kind == "continuous":
        return *_within(element, -TURN, TURN, what), velocity, effort
    lower, upper = (_number(limit, key, what, "0") for key in ("lower", "upper"))
    return *_within(element, lower, upper, what), velocity, effort


def _within(element: ET.Element, lower: float, upper: float, what: str) -> tuple[float, float]:
    """Limits of angle, and the soft ones within them where those are given."""
    soft = element.find("safety_controller")
    if soft is not None:  # beyond soft limits a controller pushes back
        lower = max(lower, _number(soft, "soft_lower_limit", what, str(lower)))
        upper = min(upper, _number(soft, "soft_upper_limit", what, str(upper)))
    if lower >= upper:
        raise ArmError(f"{what} has no room to move: its limits are {lower:g} and {upper:g}")
    return lower, upper


def _check_inertial(link: ET.Element) -> None:
    """Finite numbers, where the link has inertia; bodies are checked later, put together."""
    inertial, what = link.find("inertial"), f"link {link.get('name')!r}"
    if inertial is None:
        return
    for key in ("xyz", "rpy"):
        _check_vector(inertial, "origin", key, what)
    inertia = _require(inertial, "inertia", what)
    for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        _number(inertia, key, what)
    if _number(_require(inertial, "mass", what), "value", what) < 0.0:
        raise ArmError(f"{what} has a negative mass")


def _check_vector(element: ET.Element, tag: str, key: str, what: str) -> None:
    """Three finite numbers, where the vector is given; an axis must point somewhere."""
    found = element.find(tag)
    text = None if found is None else found.get(key)
    if text is None:
        return
    values = [_finite(word, f"{what}: {tag} {key}") for word in text.split()]
    if len(values) != 3 or (tag == "axis" and not any(values)):
        raise ArmError(f"{what}: {tag} {key}={text!r} is not a vector in space")


def _require(element: ET.Element, tag: str, what: str) -> ET.Element:
    """The child `tag`."""
    found = element.find(tag)
    if found is None:
        raise ArmError(f"{what} has no <{tag}>")
    return found


def _number(element: ET.Element, key: str, what: str, default: str = "") -> float:
    """The attribute `key` as a finite number."""
    return _finite(element.get(key, default), f"{what}: {element.tag} {key}")


def _finite(text: str, what: str) -> float:
    """`text` as a finite number."""
    try:
        value = float(text)
    except ValueError:
        raise ArmError(f"{what}={text!r} is not a number") from None
    if not math.isfinite(value):
        raise ArmError(f"{what}={text!r} is not finite")
    return value


def _root(links: tuple[str, ...], joints: list[Joint]) -> str:
    """The one link that has no parent."""
    if not links:
        raise ArmError("has no links; of several xacro files, take the one that calls the others")
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise ArmError(f"joint {joint.name!r} speaks of link {link!r}, which is not there")
    children = [joint.child for joint in joints]
    for link in children:
        if children.count(link) > 1:
            raise ArmError(f"link {link!r} hangs on more than one joint")
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        found = ", ".join(roots[:5]) or "none"
        raise ArmError(f"has no single root link ({found}); an arm grows from one")
    return roots[0]


def _walk(root: str, joints: list[Joint]) -> tuple[list[Joint], list[tuple[str, ...]]]:
    """The moving joints from the root outwards, and the rigid bodies between them."""
    leaving: dict[str, list[Joint]] = defaultdict(list)
    for joint in joints:
        leaving[joint.parent].append(joint)
    chain, bodies = [], [_bolted(root, leaving)]
    while moving := [j for link in bodies[-1] for j in leaving[link] if j.kind != "fixed"]:
        if len(moving) > 1:
            names = ", ".join(joint.name for joint in moving)
            raise ArmError(f"branches at {names}; an arm is one chain of joints, fix the others")
        chain.append(moving[0])
        bodies.append(_bolted(moving[0].child, leaving))
    return chain, bodies


def _bolted(link: str, leaving: dict[str, list[Joint]]) -> tuple[str, ...]:
    """`link` and all that fixed joints hold to it."""
    body = [link]
    for member in body:  # grows as it is walked
        body.extend(joint.child for joint in leaving[member] if joint.kind == "fixed")
    return tuple(body)
