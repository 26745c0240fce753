"""What a run and the process that diagnoses it say to each other: numbers, and words.

A frame is a letter, a length and as many bytes; no socket or file is known here.

    R   rows of float64 as this machine has them, one an instant:
        t, q, v, a, jerk, current, temperature, s, travelled              (N, 1 + 8 J)
    W   one JSON object
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from urdyn.types import Array

if TYPE_CHECKING:
    from urdyn.tracking import Reading

HEAD = struct.Struct("=cI")
ROWS, WORDS = b"R", b"W"
SERIES = 8  # of J numbers each, after the time

Words = Mapping[str, Any]


def row(reading: Reading) -> Array:
    """What a diagnosis is to know of an instant, (1 + 8 J,)."""
    i = reading.instant
    seen = i.q, i.v, i.a, i.jerk, i.current, i.temperature
    return np.concatenate([[i.t], *seen, reading.inputs.s, reading.travelled])


def rows_frame(rows: Sequence[Array]) -> bytes:
    """The frame of some instants."""
    return _frame(ROWS, np.asarray(rows, dtype=np.float64).tobytes())


def words_frame(words: Words) -> bytes:
    """The frame of an object; arrays of NumPy become lists."""
    return _frame(WORDS, json.dumps(words, default=_plain).encode())


class Frames:
    """Bytes as they come, in any pieces -> frames."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def take(self, data: bytes) -> Iterator[Words | Array]:
        """The frames that are whole by now: words, or numbers, row after row."""
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
