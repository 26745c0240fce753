"""What stands around an arm, as a file says it; metres and radians, in the frame of base_link.

floor = 0.0                                          # height [m], or false: there is none
[[wall]]                                             # name, point, normal (towards the arm)
[[box]]                                              # name, size = [x, y, z], xyz, rpy
[[ball]]                                             # name, size = [radius], xyz
[[cylinder]]                                         # name, size = [radius, length], xyz, rpy
[[tool]]                                             # shape, and as above, in the flange's frame
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from urdyn.errors import InputError

if TYPE_CHECKING:
    from urdyn.model.cell import Cell, Solid, Wall
    from urdyn.types import Array

SIZES = {"box": 3, "ball": 1, "cylinder": 2}
WALL = ("name", "point", "normal")
SOLID = ("name", "size", "xyz", "rpy")
FAR = 100.0  # [m] beyond which a number is no place in a cell


def read_cell(path: Path) -> Cell:
    """The cell in a file; InputError with the key that is to blame."""
    from urdyn.io import load_toml

    try:
        return cell_of(load_toml(path))
    except InputError as error:
        where = "" if str(error).startswith(str(path)) else f"{path}: "
        raise InputError(f"{where}{error}") from error


def cell_of(document: dict[str, Any]) -> Cell:
    """The cell that a document describes."""
    from urdyn.model.cell import Cell, floor

    _known(document, ("floor", "wall", "tool", *SIZES), "")
    height = document.get("floor", 0.0)
    ground = () if height is False else (floor(float(_numbers([height], 1, "floor: ")[0])),)
    walls = tuple(_wall(table, where) for table, where in _tables(document, "wall"))
    solids = tuple(
        _solid(shape, table, where) for shape in SIZES for table, where in _tables(document, shape)
    )
    tool = tuple(_tool(table, where) for table, where in _tables(document, "tool"))
    found = Cell((*ground, *walls), solids, tool)
    names = [wall.name for wall in found.walls]
    names += [solid.name for solid in (*found.solids, *found.tool)]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"two things are called {twice!r}; give each its own name")
    return found


def document_of(cell: Cell) -> dict[str, Any]:
    """The document that `cell_of` reads."""
    lists: dict[str, list[dict[str, Any]]] = {shape: [] for shape in SIZES}
    for solid in cell.solids:
        lists[solid.shape].append(_table(solid))
    walls = [{"name": w.name, "point": w.point, "normal": w.normal} for w in cell.walls]
    tool = [{"shape": solid.shape} | _table(solid) for solid in cell.tool]
    filled = {key: rows for key, rows in (("wall", walls), *lists.items(), ("tool", tool)) if rows}
    return {"floor": False} | filled


def _table(solid: Solid) -> dict[str, Any]:
    return {"name": solid.name, "size": solid.size, "xyz": solid.xyz, "rpy": solid.rpy}


def _tables(document: dict[str, Any], key: str) -> list[tuple[dict[str, Any], str]]:
    """The tables of a kind, and how each is called in messages."""
    found = document.get(key, [])
    if not isinstance(found, list) or not all(isinstance(table, dict) for table in found):
        raise InputError(f"{key}: is to be [[{key}]] tables")
    return [(table, f"[[{key}]] {count}: ") for count, table in enumerate(found, start=1)]


def _wall(table: dict[str, Any], where: str) -> Wall:
    from urdyn.model.cell import Wall

    _known(table, WALL, where)
    normal = _numbers(table.get("normal"), 3, f"{where}normal: ")
    if not normal.any():
        raise InputError(f"{where}normal: points nowhere")
    return Wall(_name(table, where), _numbers(table.get("point"), 3, f"{where}point: "), normal)


def _solid(shape: Any, table: dict[str, Any], where: str) -> Solid:
    from urdyn.model.cell import Solid

    _known(table, SOLID, where)
    size = _numbers(table.get("size"), SIZES[shape], f"{where}size: ")
    if not (size > 0.0).all():
        raise InputError(f"{where}size: is to be above zero")
    xyz = _numbers(table.get("xyz", [0.0] * 3), 3, f"{where}xyz: ")
    rpy = _numbers(table.get("rpy", [0.0] * 3), 3, f"{where}rpy: ")
    return Solid(_name(table, where), shape, size, xyz, rpy)


def _tool(table: dict[str, Any], where: str) -> Solid:
    rest = {key: value for key, value in table.items() if key != "shape"}
    if table.get("shape") not in SIZES:
        raise InputError(f"{where}shape: is to be {', '.join(SIZES)}")
    return _solid(table["shape"], rest, where)


def _name(table: dict[str, Any], where: str) -> str:
    name = table.get("name")
    if not isinstance(name, str) or not name:
        raise InputError(f"{where}no name; it is needed to say what is in the way")
    return name


def _numbers(values: Any, count: int, where: str) -> Array:
    """So many finite numbers."""
    good = isinstance(values, list) and len(values) == count
    if not good or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in values):
        raise InputError(f"{where}{values!r} is to be {count} numbers")
    found = np.array(values, dtype=np.float64)
    if not (np.abs(found) <= FAR).all():
        raise InputError(f"{where}{values!r}: metres and radians, {FAR:g} at most")
    return found


def _known(table: dict[str, Any], keys: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in keys:
            raise InputError(f"{where}unknown key {key!r}; known are {', '.join(keys)}")
