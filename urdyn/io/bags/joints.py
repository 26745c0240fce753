"""Joint states by name: whatever their order and prefix, base first as RTDE counts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
_NAME = re.compile(
    r"(?P<prefix>.*?)(?P<joint>shoulder_pan|shoulder_lift|elbow|wrist_[123])(_joint)?"
)

Places = tuple[int, ...]  # where each joint stands in a message, base first


def number(name: str) -> int | None:
    """Which joint a name such as `left_elbow_joint` is, from 0; None: none of the arm's."""
    match = _NAME.fullmatch(name)
    return JOINTS.index(f"{match['joint']}_joint") if match else None


def arms(names: Sequence[str]) -> dict[str, Places]:
    """Prefix -> places of the joints, of every whole arm among the names."""
    found: dict[str, dict[int, int]] = {}
    for place, name in enumerate(names):
        if match := _NAME.fullmatch(name):
            joints = found.setdefault(match["prefix"], {})
            joints.setdefault(JOINTS.index(f"{match['joint']}_joint"), place)
    return {
        prefix: tuple(joints[k] for k in range(len(JOINTS)))
        for prefix, joints in found.items()
        if len(joints) == len(JOINTS)
    }


def listed(names: Iterable[str]) -> str:
    """Names for a sentence; "nothing" where there are none."""
    return ", ".join(names) or "nothing"
