"""The shapes of an arm and its cell as Pinocchio and coal take them."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import pinocchio as pin

from urdyn.errors import ArmError
from urdyn.model.arm import Arm
from urdyn.model.cell import Cell, Solid, Wall

ROOT = 0  # Pinocchio's index of what no joint moves
SAME = 1e-4  # [m] within which a ball sits on the end of a cylinder: files are rounded


def geometry(arm: Arm, cell: Cell) -> Any:
    """Pinocchio's geometry model of the arm's collision shapes, its tool and its cell.

    Raises:
        ArmError: a link that moves has no shape, or one that cannot be read.
    """
    try:
        drawn = pin.buildGeomFromUrdfString(arm._model, arm.urdf, pin.GeometryType.COLLISION)
    except (ValueError, RuntimeError) as error:
        why = " ".join(str(error).rpartition("message: ")[2].split()).rstrip(".")  # in one line
        raise ArmError(
            f"{arm.name}: its collision shapes cannot be read: {why}; "
            "package:// is sought in the folders that ROS_PACKAGE_PATH lists"
        ) from None
    own = _rounded(list(drawn.geometryObjects))
    bare = set(range(1, arm.joints + 1)) - {thing.parentJoint for thing in own}
    if bare:
        raise ArmError(
            f"{arm.name}: link {arm.link_names[min(bare) - 1]!r} has no collision shape; "
            "without one nobody can tell what it hits"
        )
    tool = (_solid(solid, arm.joints) for solid in cell.tool)
    around = (*(_solid(solid, ROOT) for solid in cell.solids), *map(_wall, cell.walls))
    whole = pin.GeometryModel()
    for thing in (*own, *tool, *around):
        whole.addGeometryObject(thing)
    for thing in whole.geometryObjects:
        thing.geometry.computeLocalAABB()
    return whole


def _wall(wall: Wall) -> Any:
    normal = wall.normal / np.linalg.norm(wall.normal)
    shape = coal.Halfspace(normal, float(normal @ wall.point))
    return pin.GeometryObject(wall.name, ROOT, pin.SE3.Identity(), shape)


def _solid(solid: Solid, joint: int) -> Any:
    """A solid that moves with a joint, from 1; ROOT: it stands still."""
    match solid.shape:
        case "box":
            shape = coal.Box(*solid.size)
        case "ball":
            shape = coal.Sphere(*solid.size)
        case "cylinder":
            shape = coal.Cylinder(*solid.size)
    placement = pin.SE3(pin.rpy.rpyToMatrix(*solid.rpy), solid.xyz)
    return pin.GeometryObject(solid.name, joint, placement, shape)


def _rounded(things: list[Any]) -> list[Any]:
    """The same shapes, with a cylinder that has a ball on either end as one capsule.

    Distances of capsules have a closed form, and there are fewer of them.
    """
    capped = [(thing, _caps(thing, things)) for thing in things]
    whole = [(thing, balls) for thing, balls in capped if len(balls) == 2]
    inside = [id(ball) for _, balls in whole for ball in balls]
    kept = [thing for thing, balls in capped if len(balls) < 2 and id(thing) not in inside]
    return [*kept, *(_capsule(thing) for thing, _ in whole)]


def _caps(thing: Any, things: list[Any]) -> list[Any]:
    """The balls on the ends of `thing`, one per end; none where it is no cylinder."""
    if not isinstance(thing.geometry, coal.Cylinder):
        return []
    half = np.array([0.0, 0.0, thing.geometry.halfLength])
    found = []
    for end in (thing.placement.act(half), thing.placement.act(-half)):
        found += [
            ball
            for ball in things
            if isinstance(ball.geometry, coal.Sphere)
            and ball.parentJoint == thing.parentJoint
            and abs(ball.geometry.radius - thing.geometry.radius) < SAME
            and np.linalg.norm(ball.placement.translation - end) < SAME
        ][:1]
    return found


def _capsule(thing: Any) -> Any:
    # A file's digits are rounded: the capsule covers balls that sit a little off.
    radius, length = thing.geometry.radius, 2.0 * thing.geometry.halfLength
    shape = coal.Capsule(radius + SAME, length)
    return pin.GeometryObject(thing.name, thing.parentJoint, thing.placement, shape)
