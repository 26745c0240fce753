"""A bag's messages, decoded; every way in which a foreign file can be broken is a LogError."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from urdyn.errors import LogError, UrdynError
from urdyn.io.bags.forms import named, require
from urdyn.io.bags.torn import Salvage, is_torn
from urdyn.types import Defect


@dataclass(frozen=True)
class Topic:
    """What a bag holds under one name."""

    name: str
    type: str  # "sensor_msgs/msg/JointState"
    count: int  # messages
    definition: str  # text of the type's definition; "" where the bag has none

    def __str__(self) -> str:
        return f"{self.name} ({self.type}, {self.count})"


@dataclass(frozen=True)
class Bag:
    """A bag that is open."""

    path: Path
    topics: tuple[Topic, ...]
    raw: Callable[[Topic], Iterator[tuple[int, bytes]]]  # [ns] when it was recorded, and the bytes
    decode: Callable[[Topic, bytes], Any]
    defects: tuple[Defect, ...] = ()

    def messages(self, topic: Topic) -> Iterator[tuple[int, Any]]:
        """When a message was recorded [ns], and the message."""
        return ((stamp, self.decode(topic, data)) for stamp, data in self.raw(topic))


@contextmanager
def opened(path: Path) -> Iterator[Bag]:
    """The bag in `path`; MissingExtraError where nothing here reads bags."""
    require("rosbags")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    try:
        if is_torn(path):
            yield _salvaged(Salvage(path))
            return
        # Bags of older releases carry no definitions; the common types have not changed since.
        store = get_typestore(Stores.ROS2_HUMBLE)
        with named(path) as name, AnyReader([name], default_typestore=store) as reader:
            yield _bag(path, reader)
    except UrdynError:
        raise
    except Exception as error:  # a broken file breaks the reader anywhere, in any way
        told = " ".join(str(error).split()) or type(error).__name__
        raise LogError(f"cannot be read as a bag: {told}", path) from error


def _bag(path: Path, reader: Any) -> Bag:
    topics = tuple(
        Topic(c.topic, c.msgtype, c.msgcount, c.msgdef.data or "") for c in reader.connections
    )

    def raw(topic: Topic) -> Iterator[tuple[int, bytes]]:
        wanted = [c for c in reader.connections if (c.topic, c.msgtype) == (topic.name, topic.type)]
        return ((stamp, data) for _, stamp, data in reader.messages(wanted))

    return Bag(path, topics, raw, lambda topic, data: reader.deserialize(data, topic.type))


def _salvaged(torn: Salvage) -> Bag:
    ids = {}
    for number, channel in torn.channels.items():
        if schema := torn.schemas.get(channel.schema_id):
            text = schema.data.decode()
            topic = Topic(channel.topic, schema.name, torn.counts.get(number, 0), text)
            ids[topic] = number
    return Bag(
        torn.path,
        tuple(ids),
        lambda topic: torn.messages(ids[topic]),
        lambda topic, data: torn.decode(topic.type, data),
        (Defect("file without an end", 1, 0, "read up to where it breaks off"),),
    )


def header_stamp(message: Any) -> int:
    """[ns] of a message's header; 0: it says nothing."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
