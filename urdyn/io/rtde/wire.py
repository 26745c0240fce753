"""Bytes <-> events, for either side of a connection; no sockets here.

client.write(request) -> bytes -> controller.feed(bytes) -> requests
client.feed(bytes) -> answers <- bytes <- controller.write(answer)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from urdyn.io.rtde.decode import read_answer, read_request
from urdyn.io.rtde.encode import write_answer, write_request
from urdyn.io.rtde.events import Answer, Request
from urdyn.io.rtde.frames import Frames, Packet

Heard = TypeVar("Heard")
Said = TypeVar("Said")


class Wire(Generic[Heard, Said]):
    """One end of a connection: what it hears and says, in the protocol version agreed so far."""

    def __init__(
        self, read: Callable[[Packet, int], Heard], write: Callable[[Said, int], bytes]
    ) -> None:
        self.version = 1  # until another is agreed
        self._read, self._write = read, write
        self._frames = Frames()

    def feed(self, data: bytes) -> Iterator[Heard]:
        """Events that `data` completes, however the network cut it; RtdeError where there is none.

        Each is read when it is asked for: an answer to one may change the version of the next.
        """
        return (self._read(packet, self.version) for packet in self._frames.feed(data))

    def write(self, event: Said) -> bytes:
        """An event as a package."""
        return self._write(event, self.version)


def client_wire() -> Wire[Answer, Request]:
    """The end that asks."""
    return Wire(read_answer, write_request)


def controller_wire() -> Wire[Request, Answer]:
    """The end that answers."""
    return Wire(read_request, write_answer)
