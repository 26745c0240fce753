"""What two processes of ours send each other through a pipe: numbers, and words.

A frame is a letter, a length and as many bytes; no socket or file is known here.

    N   float64 as this machine has them
    W   one JSON object
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from urdyn.types import Array

HEAD = struct.Struct("=cI")
NUMBERS, WORDS = b"N", b"W"

Words = Mapping[str, Any]


def numbers_frame(numbers: Array) -> bytes:
    """The frame of an array, whose shape the other side knows."""
    return _frame(NUMBERS, np.asarray(numbers, dtype=np.float64).tobytes())


def words_frame(words: Words) -> bytes:
    """The frame of an object; arrays of NumPy become lists."""
    return _frame(WORDS, json.dumps(words, default=_plain).encode())


def words_of(frame: Words | Array) -> dict[str, Any]:
    """A frame that both sides know to be words."""
    assert isinstance(frame, Mapping), "numbers came where words were due"
    return dict(frame)


def numbers_of(frame: Words | Array) -> Array:
    """A frame that both sides know to be numbers."""
    assert not isinstance(frame, Mapping), "words came where numbers were due"
    return frame


class Frames:
    """Bytes as they come, in any pieces -> frames."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def take(self, data: bytes) -> Iterator[Words | Array]:
        """The frames that are whole by now: words, or numbers, one after another."""
        self._bytes += data
        while len(self._bytes) >= HEAD.size:
            kind, length = HEAD.unpack_from(self._bytes)
            end = HEAD.size + length
            if len(self._bytes) < end:
                return
            payload = bytes(self._bytes[HEAD.size : end])
            del self._bytes[:end]
            yield json.loads(payload) if kind == WORDS else np.frombuffer(payload)


def _plain(value: Any) -> Any:
    return value.tolist()


def _frame(kind: bytes, payload: bytes) -> bytes:
    return HEAD.pack(kind, len(payload)) + payload
