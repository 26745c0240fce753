"""A stream of bytes <-> packages, their payloads unread.

A package is `uint16 size, uint8 type, payload`, in network byte order, its size with the header
(UR's RTDE guide, "Protocol").
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

from urdyn.errors import RtdeError

HEADER = struct.Struct(">HB")
KINDS = b"VvMUOISP"  # the types that packages have


class Packet(NamedTuple):
    """One package, its payload unread."""

    kind: bytes  # one letter of KINDS
    payload: bytes


class Frames:
    """Cuts a stream into packages, however the network cut it before."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[Packet]:
        """Packages that `data` completes; RtdeError where no package can begin."""
        self._buffer += data
        return self._packets()

    def _packets(self) -> Iterator[Packet]:
        while len(self._buffer) >= HEADER.size:
            size, number = HEADER.unpack_from(self._buffer)
            if size < HEADER.size or number not in KINDS:
                told = f"no RTDE package has type {number} and {size} bytes"
                raise RtdeError(f"{told}; controllers speak RTDE at port 30004")
            if len(self._buffer) < size:
                return
            payload = bytes(self._buffer[HEADER.size : size])
            del self._buffer[:size]
            yield Packet(bytes([number]), payload)


def package(kind: bytes, payload: bytes = b"") -> bytes:
    """Header and payload; RtdeError where its size has no place in the header."""
    size = HEADER.size + len(payload)
    if size > 0xFFFF:
        raise RtdeError(f"a package of {size} bytes where 65535 fit; ask for fewer variables")
    return HEADER.pack(size, kind[0]) + payload
