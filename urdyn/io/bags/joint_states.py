"""The joint states of a bag: they are the rows of the log, and their stamps its clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.errors import LogError
from urdyn.io.bags.joints import JOINTS, Places, arms, listed
from urdyn.io.bags.messages import Bag, Topic, header_stamp
from urdyn.types import Array, Index

TYPE = "sensor_msgs/msg/JointState"
NAMED = "joint_states"  # where robots publish their joints


@dataclass(frozen=True, eq=False)
class JointStates:
    """Messages of one arm, in the order in which they were recorded."""

    stamp: Index  # (N,) [ns] of the robot; of the recorder, on its clock, where it gave none
    offset: int  # [ns] by which the robot's clock is ahead of the recorder's
    values: Array  # (N, 3, J) [rad], [rad/s], and effort in its publisher's unit
    unstamped: int  # messages without a stamp of the robot
    foreign: int  # messages of other joints, such as a gripper's


@dataclass(frozen=True)
class _Heard:
    """One topic, all arms in it."""

    topic: Topic
    rows: list[tuple[int, int, Any]]  # recorded, stamped [ns], message
    places: dict[tuple[str, ...], dict[str, Places]]  # names -> arms


def joint_states(bag: Bag) -> JointStates:
    """The one arm of the bag; LogError where there is none, or more than one."""
    topics = [topic for topic in bag.topics if topic.type == TYPE and topic.count]
    heard = [_hear(bag, topic) for topic in topics]
    found = {(h.topic.name, prefix): h for h in heard for prefix in _prefixes(h)}
    usual = {key: h for key, h in found.items() if key[0].rpartition("/")[2] == NAMED}
    found = usual or found
    if not found:
        names = sorted({name for h in heard for names in h.places for name in names})
        tell = f"joint states of {listed(names)} only" if heard else "no joint states"
        there = "; ".join((listed(map(str, bag.topics)), *map(str, bag.defects)))
        raise LogError(
            f"has {tell}, an arm's {', '.join(JOINTS)} are needed; it has {there}", bag.path
        )
    if len(found) > 1:
        several = ", ".join(f"{topic} {prefix}*".strip() for topic, prefix in sorted(found))
        raise LogError(f"has more than one arm ({several}); keep one of them in the bag", bag.path)
    ((_, prefix), only), *_ = found.items()
    return _of_arm(only, prefix)


def _hear(bag: Bag, topic: Topic) -> _Heard:
    rows = [(stamp, header_stamp(message), message) for stamp, message in bag.messages(topic)]
    names = {tuple(message.name) for _, _, message in rows}
    return _Heard(topic, rows, {known: arms(known) for known in names})


def _prefixes(heard: _Heard) -> set[str]:
    return {prefix for found in heard.places.values() for prefix in found}


def _of_arm(heard: _Heard, prefix: str) -> JointStates:
    mine = [row for row in heard.rows if prefix in heard.places[tuple(row[2].name)]]
    recorded = np.array([row[0] for row in mine])
    stamped = np.array([row[1] for row in mine])
    told = stamped > 0
    offset = int(np.median((stamped - recorded)[told])) if told.any() else 0
    stamp = np.where(told, stamped, recorded + offset)
    values = np.array([_values(m, heard.places[tuple(m.name)][prefix]) for _, _, m in mine])
    unstamped, foreign = int(np.sum(~told)), len(heard.rows) - len(mine)
    return JointStates(stamp, offset, values, unstamped, foreign)


def _values(message: Any, places: Places) -> list[Array]:
    """Position, velocity and effort, (J,) each, base first; NaN where the message has none."""
    said = (message.position, message.velocity, message.effort)
    return [
        np.asarray(series, dtype=np.float64)[list(places)]
        if len(series) == len(message.name)
        else np.full(len(places), np.nan)
        for series in said
    ]
