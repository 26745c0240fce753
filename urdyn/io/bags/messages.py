"""A bag's messages, decoded; any damage of a foreign file is a LogError."""

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
    """The bag in `path`; MissingExtraError where no bag reader is installed."""
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
    found: dict[tuple[str, str], list[Any]] = {}  # a topic has a connection per publisher
    for one in reader.connections:
        found.setdefault((one.topic, one.msgtype), []).append(one)
    topics = tuple(
        Topic(name, type_, sum(one.msgcount for one in each), each[0].msgdef.data or "")
        for (name, type_), each in found.items()
    )

    def raw(topic: Topic) -> Iterator[tuple[int, bytes]]:
        told = reader.messages(found[topic.name, topic.type])
        return ((stamp, data) for _, stamp, data in told)

    return Bag(path, topics, raw, lambda topic, data: reader.deserialize(data, topic.type))


def _salvaged(torn: Salvage) -> Bag:
    ids: dict[tuple[str, str], list[int]] = {}  # a topic has a channel per publisher
    texts = {}
    for number, channel in torn.channels.items():
        if schema := torn.schemas.get(channel.schema_id):
            ids.setdefault((channel.topic, schema.name), []).append(number)
            texts[schema.name] = schema.data.decode()
    counts = {told: sum(torn.counts.get(number, 0) for number in of) for told, of in ids.items()}
    return Bag(
        torn.path,
        tuple(Topic(name, type_, counts[name, type_], texts[type_]) for name, type_ in ids),
        lambda topic: torn.messages(ids[topic.name, topic.type]),
        lambda topic, data: torn.decode(topic.type, data),
        (Defect("file without an end", 1, 0, "read up to where it breaks off"),),
    )


def header_stamp(message: Any) -> int:
    """Stamp [ns] of a message's header; 0 where it has none."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
