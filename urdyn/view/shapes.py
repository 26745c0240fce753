"""What an arm looks like: triangles in the frames of its links.

Arms with meshes in example-robot-data get those and nothing else of it: some of its descriptions
are of other arms. All others are the cylinders and spheres of our own URDFs; a link without any
shape is a stick to the next joint.
"""

from __future__ import annotations

import logging
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import ArmError
from urdyn.model.arm import Arm
from urdyn.model.chain import parse, read_chain
from urdyn.types import Array, Index

PUBLISHED = ("ur3", "ur5", "ur10")  # arms that have meshes there
MESHES = "cmeel.prefix/share/example-robot-data/robots/ur_description"
PACKAGE = "package://example-robot-data/robots/ur_description"
SLENDER = 0.06  # [-] radius of a stick, of its length


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles of one link."""

    link: str
    joint: int  # that moves it; -1: none does
    vertices: Array  # (V, 3) [m] in the link's frame
    faces: Index  # (F, 3)


def shapes(arm: Arm) -> tuple[Shape, ...]:
    """All that can be drawn of an arm, one shape per link, base first."""
    movers = _movers(arm)
    found = published(arm) if arm.name in PUBLISHED and _package() else described(arm)
    pieces = {link: _joined(meshes) for link, meshes in found.items() if meshes}
    for joint in range(arm.joints):
        body = [name for name, mover in movers.items() if mover == joint]
        if not any(name in pieces for name in body):
            pieces |= _stick(arm, joint)
    if not pieces:
        raise ArmError(f"{arm.name}: nothing of it can be drawn")
    return tuple(Shape(link, movers[link], *pieces[link]) for link in movers if link in pieces)


def described(arm: Arm) -> dict[str, list[Any]]:
    """Trimeshes of the primitives, and of the meshes that lie where the URDF says, by link."""
    urdf = _urdf(arm.urdf)
    return {name: list(_visuals(link, Path())) for name, link in urdf.link_map.items()}


def published(arm: Arm) -> dict[str, list[Any]]:
    """The meshes of example-robot-data, moved into the frames of our links.

    Both descriptions mean the same arm by the same angles, so every mesh is placed where it is
    there at zero, whatever its link's frame is called or how it is turned.
    """
    folder = _package()
    assert folder is not None, "looked for before"
    path = folder / "urdf" / f"{arm.name}_robot.urdf"
    theirs = _urdf(path.read_text(encoding="utf-8"), graph=True)
    placed: dict[str, list[Any]] = {}
    for name in (f"{arm.prefix}base_link", *arm.link_names):
        their = name.removeprefix(arm.prefix)
        there = np.asarray(theirs.get_transform(their, "base_link"))
        here = arm.pose(np.zeros(arm.joints), name)
        meshes = list(_visuals(theirs.link_map[their], folder))
        for mesh in meshes:
            mesh.apply_transform(np.linalg.inv(here) @ there)
        placed[name] = meshes
    return placed


def _urdf(text: str, graph: bool = False) -> Any:
    """A URDF as yourdfpy reads it; one with a DOCTYPE never reaches it."""
    import yourdfpy

    root = parse(text)
    logging.getLogger("yourdfpy").setLevel(logging.CRITICAL)  # what matters is reported here
    file = BytesIO(ET.tostring(root))
    return yourdfpy.URDF.load(file, build_scene_graph=graph, load_meshes=False)


def _visuals(link: Any, folder: Path) -> Iterator[Any]:
    """Trimeshes of a link's visuals, in its frame; a mesh that is not there is left out."""
    import trimesh

    for visual in link.visuals:
        shape = visual.geometry
        if shape.cylinder is not None:
            mesh = trimesh.creation.cylinder(shape.cylinder.radius, shape.cylinder.length)
        elif shape.sphere is not None:
            mesh = trimesh.creation.icosphere(subdivisions=3, radius=shape.sphere.radius)
        elif shape.box is not None:
            mesh = trimesh.creation.box(shape.box.size)
        else:
            path = folder / shape.mesh.filename.removeprefix(f"{PACKAGE}/").split("://")[-1]
            if not path.is_file():
                continue
            mesh = trimesh.load_mesh(path)
            mesh.vertices *= 1.0 if shape.mesh.scale is None else shape.mesh.scale
        yield mesh.apply_transform(np.eye(4) if visual.origin is None else visual.origin)


def _joined(meshes: list[Any]) -> tuple[Array, Index]:
    import trimesh

    whole: Any = trimesh.util.concatenate(meshes)
    return np.asarray(whole.vertices, np.float64), np.asarray(whole.faces, np.intp)


def _stick(arm: Arm, joint: int) -> dict[str, tuple[Array, Index]]:
    """A cylinder from a joint to the next one, or to the tool, where they are apart."""
    import trimesh

    rest = np.zeros(arm.joints)
    ahead = arm.link_names[joint + 1] if joint + 1 < arm.joints else arm.tool
    way = np.linalg.inv(arm.pose(rest, arm.link_names[joint])) @ arm.pose(rest, ahead)
    end = way[:3, 3]
    length = float(np.linalg.norm(end))
    if length == 0.0:
        return {}
    mesh = trimesh.creation.cylinder(SLENDER * length, segment=[np.zeros(3), end])
    return {arm.link_names[joint]: _joined([mesh])}


def _movers(arm: Arm) -> dict[str, int]:
    """The joint that moves each link of the file, -1 for what stands still; base first."""
    chain = read_chain(parse(arm.urdf))
    moved = {link: j for j, body in enumerate(chain.bodies) for link in body}
    fixed = {link: -1 for link in chain.frames if link not in moved}
    return fixed | moved


def _package() -> Path | None:
    """Where example-robot-data keeps its arms; its wheel is data, and nothing of it is imported."""
    spec = find_spec("cmeel") or find_spec("pinocchio")
    for parent in Path(spec.origin).parents if spec and spec.origin else ():
        if (parent / MESHES).is_dir():
            return parent / MESHES
    return None
