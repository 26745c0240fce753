"""read_bag(): a bag -> the table of its joint states, with everything else on their clock."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.errors import LogError
from urdyn.io.bags import sample
from urdyn.io.bags.joint_states import JointStates, joint_states
from urdyn.io.bags.messages import Bag, Topic, opened
from urdyn.io.bags.streams import BASE, streams
from urdyn.io.effort import EFFORT
from urdyn.io.names import CLOCKS
from urdyn.io.table import SKIPPED, Table, merge
from urdyn.types import Array, Defect

TURNED = np.array([-1.0, -1.0, 1.0])  # REP-103's `base_link` to UR's `base`: half a turn about z


def read_bag(path: Path, channels: Collection[str] | None) -> Table:
    """All rows of a bag; LogError, naming its topics, where it holds no log."""
    with opened(path) as bag:
        own = [topic for topic in bag.topics if topic.type == sample.TYPE]
        table = _own(bag, own) if own else _robots(bag)
        table = replace(table, defects=merge((*bag.defects, *table.defects)))
    if channels is None:
        return table
    keep = {*channels, *CLOCKS} | ({EFFORT} if "actual_current" in channels else set())
    return _table({k: v for k, v in table.channels.items() if k in keep}, table.defects)


def _own(bag: Bag, found: list[Topic]) -> Table:
    """A bag that we wrote, bit for bit."""
    if len(found) > 1:
        raise LogError("has more than one log in it; convert them one by one", bag.path)
    rows = [data for _, data in bag.raw(found[0])]
    return _table(sample.channels(found[0].definition, rows, bag.path), ())


def _robots(bag: Bag) -> Table:
    """What a robot's driver published."""
    states = joint_states(bag)
    others = streams(bag, states.offset)
    told = {name: stream.at(states.stamp) for name, stream in others.items()}
    defects = [
        Defect("message of other joints", states.foreign, 0, SKIPPED),
        Defect("message without a stamp", states.unstamped, 0, "stamped by the recorder's clock"),
    ]
    if "actual_TCP_force" in told:
        frame = others["actual_TCP_force"].frame
        told["actual_TCP_force"], amiss = _in_base(told["actual_TCP_force"], frame, told)
        defects += amiss
    if "speed_scaling" in told:
        told["speed_scaling"] = told["speed_scaling"][:, 0]
    return _table(_joints(states) | told, merge(defects))


def _joints(states: JointStates) -> dict[str, Array]:
    q, v, effort = (states.values[:, k] for k in range(3))
    named = {"actual_q": q, "actual_qd": v, EFFORT: effort}
    spoken = {name: values for name, values in named.items() if np.isfinite(values).any()}
    return {"timestamp": states.stamp / 1e9} | spoken


def _in_base(wrench: Array, frame: str, told: dict[str, Array]) -> tuple[Array, tuple[Defect, ...]]:
    """The wrench in the axes of RTDE's `actual_TCP_force`, as far as the bag gives them."""
    name = frame.rpartition("/")[2]
    if name.endswith("base_link"):
        return wrench * np.tile(TURNED, 2), ()
    if name.endswith(BASE) or not name:
        return wrench, ()
    pose = told.get("actual_TCP_pose")
    if pose is None:
        told_so = f"kept in the axes of {frame}: no TCP pose tells how they lie"
        return wrench, (Defect("wrench in axes of its own", len(wrench), 0, told_so),)
    known = np.asarray(np.isfinite(pose).all(axis=1))
    turn = Rotation.from_rotvec(np.where(known[:, None], pose[:, 3:], 0.0))
    turned = np.hstack([turn.apply(half) for half in np.hsplit(wrench, 2)])
    return np.where(known[:, None], turned, np.nan), ()


def _table(channels: dict[str, Array], defects: tuple[Defect, ...]) -> Table:
    count = len(channels["timestamp"])
    line = np.zeros(count, dtype=np.intp)
    return Table(channels, line, np.arange(count), defects, count)
