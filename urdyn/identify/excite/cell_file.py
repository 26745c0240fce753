"""The file that describes an arm's surroundings; metres and radians, in the frame of base_link.

floor = 0.0                                          # height [m], or false: there is none
[[wall]]                                             # name, point, normal (towards the arm)
[[box]]                                              # name, size = [x, y, z], xyz, rpy
[[ball]]                                             # name, size = [radius], xyz
[[cylinder]]                                         # name, size = [radius, length], xyz, rpy
[[tool]]                                             # shape, and as above, in the flange's frame
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from urdyn.errors import InputError
from urdyn.model.cell import SIZES, Cell, Solid, Wall, floor
from urdyn.types import Array

T = TypeVar("T")

WALL = ("name", "point", "normal")
SOLID = ("name", "size", "xyz", "rpy")
FAR = 100.0  # [m] beyond which a number is not a place in a cell


def read_cell(path: Path) -> Cell:
    """The cell in a file; InputError names the key that is wrong."""
    from urdyn.io import load_toml

    try:
        return cell_of(load_toml(path))
    except InputError as error:
        where = "" if str(error).startswith(str(path)) else f"{path}: "
        raise InputError(f"{where}{error}") from error


def cell_of(document: dict[str, Any]) -> Cell:
    """The cell that a document describes."""
    _known(document, ("floor", "wall", "tool", *SIZES))
    height = document.get("floor", 0.0)
    ground = () if height is False else (floor(float(_numbers([height], 1, "floor")[0])),)
    walls = tuple(_each(document, "wall", _wall))
    solids = tuple(
        solid for shape in SIZES for solid in _each(document, shape, partial(_solid, shape))
    )
    tool = tuple(_each(document, "tool", _tool))
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


def _each(document: dict[str, Any], key: str, made: Callable[[dict[str, Any]], T]) -> Iterator[T]:
    """What the tables of a kind describe; InputError names the table that is wrong."""
    tables = document.get(key, [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise InputError(f"{key}: is to be [[{key}]] tables")
    for count, table in enumerate(tables, start=1):
        try:
            yield made(table)
        except InputError as error:
            raise InputError(f"[[{key}]] {count}: {error}") from error


def _wall(table: dict[str, Any]) -> Wall:
    _known(table, WALL)
    point, normal = (_numbers(table.get(key), 3, key) for key in ("point", "normal"))
    return Wall(_name(table), point, normal)


def _solid(shape: Any, table: dict[str, Any]) -> Solid:
    _known(table, SOLID)
    size = _numbers(table.get("size"), SIZES[shape], "size")
    xyz, rpy = (_numbers(table.get(key, [0.0] * 3), 3, key) for key in ("xyz", "rpy"))
    return Solid(_name(table), shape, size, xyz, rpy)


def _tool(table: dict[str, Any]) -> Solid:
    rest = {key: value for key, value in table.items() if key != "shape"}
    if table.get("shape") not in tuple(SIZES):
        raise InputError(f"shape: is to be {', '.join(SIZES)}")
    return _solid(table["shape"], rest)


def _name(table: dict[str, Any]) -> str:
    name = table.get("name")
    if not isinstance(name, str) or not name:
        raise InputError("no name; it is needed to say what is in the way")
    return name


def _numbers(values: Any, count: int, what: str) -> Array:
    """`count` finite numbers."""
    good = isinstance(values, list) and len(values) == count
    if not good or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in values):
        raise InputError(f"{what}: {values!r} is to be {count} numbers")
    found = np.array(values, dtype=np.float64)
    if not (np.abs(found) <= FAR).all():
        raise InputError(f"{what}: {values!r}: metres and radians, {FAR:g} at most")
    return found


def _known(table: dict[str, Any], keys: tuple[str, ...]) -> None:
    for key in table:
        if key not in keys:
            raise InputError(f"unknown key {key!r}; known are {', '.join(keys)}")
