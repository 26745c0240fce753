"""The arms that come with the project."""

from __future__ import annotations

import re
from pathlib import Path

from urdyn.errors import ArmError

# Sold today under this name, for a larger payload: lengths, masses, centres of mass and limits are
# those of the older arm in UR's description.
RERATED = {"ur7e": "ur5e", "ur12e": "ur10e"}


def folder() -> Path:
    """Where the URDFs lie: inside the package in a wheel, beside it in a working copy."""
    packaged = Path(__file__).parents[1] / "urdf"
    return packaged if packaged.is_dir() else Path(__file__).parents[2] / "urdf"


def names() -> tuple[str, ...]:
    """Arms that have a URDF here, small ones first."""
    found = (path.stem for path in folder().glob("*.urdf"))
    return tuple(sorted(found, key=lambda name: (int(re.sub(r"\D", "", name) or 0), name)))


def robots() -> tuple[str, ...]:
    """Names that `load_arm` knows: those of `names`, and of RERATED."""
    return (*names(), *RERATED)


def find(robot: str | Path) -> Path:
    """The URDF of one of `names`, in any case ("UR10e"), or the file that `robot` names."""
    if (name := str(robot).lower()) in names():
        return folder() / f"{name}.urdf"
    if (path := Path(str(robot))).is_file():
        return path
    known = ", ".join(robots())
    raise ArmError(f"no arm {str(robot)!r}: name one of {known}, or give the path of a URDF")
