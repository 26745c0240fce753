"""Which columns of a session of poses are joint angles, and which the tracker's measurements."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from urdyn.errors import LogError
from urdyn.io.names import some

PLANNED = re.compile(r"(?i)goal|target|command|cmd|nominal|desired|planned|setpoint|reference")
PREFERRED = ("meas", "tracker", "laser", "leica", "actual", "tcp", "pose", "pos")
UNIT = r"[ _]*[\[(]?(?P<unit>mm|m|deg|degrees?|rad|°)?[\])]?"
AXIS = re.compile(rf"(?i)(?P<owner>(?:.*[ _.\-])?(?:pos(?:ition)?[ _.]?)?)(?P<axis>[xyz]){UNIT}")
ANGLE = re.compile(
    rf"(?i)(?P<owner>(?:.*[ _.\-])?(?:rot(?:ation)?[ _.]?)?)"
    rf"(?P<axis>r[xyz]|roll|pitch|yaw){UNIT}"
)
JOINT_UNIT = re.compile(r"(?i)[ _\[(](deg|degrees?|rad|°)[\])]?$")
STEMS = ("actualq", "q", "joint", "j", "jointposition", "jointangle", "axis", "a")  # + number
NAMES = {"roll": "rx", "pitch": "ry", "yaw": "rz"}


@dataclass(frozen=True)
class Columns:
    """Names of the columns, and the units in their titles; "" where the title is silent."""

    joints: tuple[str, ...]
    place: tuple[str, ...]  # x, y, z
    turn: tuple[str, ...]  # rx, ry, rz; () where only positions were measured
    joint_unit: str = ""
    place_unit: str = ""
    turn_unit: str = ""


def pose_columns(names: Collection[str], joint_names: Sequence[str], path: str) -> Columns:
    """The columns of a session among `names`; LogError where they cannot be found.

    With no `joint_names`, the joints' angles come from elsewhere.
    """
    joints = _joints(names, joint_names, path) if joint_names else ()
    rest = [name for name in names if name not in joints and not PLANNED.search(name)]
    places = _triples(rest, AXIS, "xyz")
    if not places:
        own = (
            ", and no actual_TCP_pose beside actual_q"
            if joint_names
            else "; a controller's own pose is --poses own"
        )
        told = f"has no measured x, y, z (measurement_x ...){own}; it has {some(names)}"
        raise LogError(told, path)
    owner = min(places, key=_rank)
    turns = _triples(rest, ANGLE, ("rx", "ry", "rz"))
    close = next((turns[o] for o in turns if _stem(o) == _stem(owner)), None)
    if close is None and len(turns) == 1:
        close = next(iter(turns.values()))
    columns, unit = places[owner]
    angles, angle_unit = close or ((), "")
    of_joint = JOINT_UNIT.search(joints[0].strip()) if joints else None
    joint_unit = of_joint[1].lower() if of_joint else ""
    return Columns(joints, columns, angles, joint_unit, unit, angle_unit)


def _joints(names: Collection[str], joint_names: Sequence[str], path: str) -> tuple[str, ...]:
    """The joints' columns, base first."""
    known = {_plain(name): name for name in names if not PLANNED.search(name)}
    wanted = [_plain(name) for name in joint_names]
    for spelling in (wanted, *_numbered(len(joint_names))):
        if all(word in known for word in spelling):
            return tuple(known[word] for word in spelling)
    longer = [[n for plain, n in known.items() if word in plain] for word in wanted]
    if all(len(found) == 1 for found in longer):  # "actual_shoulder_pan_joint"
        return tuple(found[0] for found in longer)
    missing = [name for name, word in zip(joint_names, wanted, strict=True) if word not in known]
    raise LogError(
        f"has no column of {missing[0]}; name the joints as in the URDF, or q1 ...", path
    )


def _numbered(joints: int) -> Iterator[list[str]]:
    """Plain names of joints that are numbered, from 0 or from 1."""
    for first in (0, 1):
        yield from ([f"{stem}{k}" for k in range(first, first + joints)] for stem in STEMS)


def _plain(name: str) -> str:
    """A column's name without what writers differ in."""
    bare = re.sub(r"[\[(].*?[\])]", "", name.lower())
    bare = re.sub(r"[ _]*(rad|deg)$", "", bare.strip())
    bare = re.sub(r"[^a-z0-9]", "", bare)
    return bare.removesuffix("joint") if not bare.startswith("joint") else bare


def _triples(
    names: Sequence[str], pattern: re.Pattern[str], axes: Sequence[str]
) -> dict[str, tuple[tuple[str, ...], str]]:
    """Complete triples by their owner, with their unit."""
    found: defaultdict[str, dict[str, tuple[str, str]]] = defaultdict(dict)
    for name in names:
        if match := pattern.fullmatch(name.strip()):
            axis = NAMES.get(match["axis"].lower(), match["axis"].lower())
            found[match["owner"].lower()][axis] = (name, (match["unit"] or "").lower())
    return {
        owner: (tuple(told[a][0] for a in axes), told[axes[0]][1])
        for owner, told in found.items()
        if all(a in told for a in axes)
    }


def _rank(owner: str) -> tuple[int, int]:
    """Rank of a triple as the measured one: the lowest is likeliest."""
    places = [k for k, word in enumerate(PREFERRED) if word in owner]
    return (min(places, default=len(PREFERRED)), len(owner))


def _stem(owner: str) -> str:
    """A triple's owner without the words for position and rotation."""
    return re.sub(r"(pos(ition)?|rot(ation)?)[ _.]?$", "", owner).strip(" _.-")
