"""An MCAP whose writer was killed: no index and no end, but whole chunks up to where it broke."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from urdyn.io.bags.forms import form, require

END = b"\x89MCAP0\r\n"  # last bytes of a file that was finished


def is_torn(path: Path) -> bool:
    """Is this an MCAP without its end?"""
    if form(path) != ".mcap":
        return False
    with path.open("rb") as stream:
        stream.seek(-min(len(END), path.stat().st_size), 2)
        return stream.read() != END


class Salvage:
    """What can be read of it: schemas, channels and counts of messages by id, and the messages."""

    def __init__(self, path: Path) -> None:
        require("mcap", "rosbags")
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.path, self._store = path, get_typestore(Stores.EMPTY)
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        self.counts: dict[int, int] = {}
        for record in self._records():
            name = type(record).__name__
            if name == "Schema":
                self.schemas[record.id] = record
            elif name == "Channel":
                self.channels[record.id] = record
            elif name == "Message":
                self.counts[record.channel_id] = self.counts.get(record.channel_id, 0) + 1
        for schema in self.schemas.values():
            if schema.encoding == "ros2msg":
                self._store.register(get_types_from_msg(schema.data.decode(), schema.name))

    def messages(self, channels: Collection[int]) -> Iterator[tuple[int, bytes]]:
        """When a message of these channels was recorded [ns], and its bytes."""
        for record in self._records():
            if type(record).__name__ == "Message" and record.channel_id in channels:
                yield record.log_time, record.data

    def decode(self, type_: str, data: bytes) -> Any:
        """A message from its bytes."""
        return self._store.deserialize_cdr(data, type_)

    def _records(self) -> Iterator[Any]:
        with self.path.open("rb") as stream:
            yield from _until_it_breaks(stream)


def _until_it_breaks(stream: BinaryIO) -> Iterator[Any]:
    from mcap.stream_reader import StreamReader

    records = iter(StreamReader(stream).records)
    while True:
        try:
            yield next(records)
        except Exception:  # the end of what was written; StopIteration is one too
            return
