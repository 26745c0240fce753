"""Our own message: one sample of a log, every channel of it, as a type that explains itself.

The definition stands in the file, so that any reader of bags shows every field by its name; ROS
allows small letters only, so a comment gives each field the name of its channel:

    float64 timestamp # timestamp
    float64[6] actual_tcp_pose # actual_TCP_pose

All fields are float64, in CDR without padding: a stretch of samples is one block of numbers.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from urdyn.errors import LogError
from urdyn.types import Array

TYPE = "urdyn_msgs/msg/Sample"
HEAD = b"\x00\x01\x00\x00"  # CDR, little-endian
_FIELD = re.compile(r"float64(?:\[(?P<width>\d+)\])? (?P<field>\w+) # (?P<channel>.+)")

Widths = dict[str, int]  # channel -> width of its vector; 0: a scalar


def widths(channels: Mapping[str, Array]) -> Widths:
    """Shapes of the channels, without time."""
    return {name: values.shape[1] if values.ndim > 1 else 0 for name, values in channels.items()}


def definition(of: Widths) -> str:
    """The message definition of such channels."""
    lines, taken = [], set()
    for name, width in of.items():
        field = _field(name)
        while field in taken:
            field += "x"
        taken.add(field)
        lines.append(f"float64{f'[{width}]' if width else ''} {field} # {name}")
    return "\n".join(lines) + "\n"


def messages(channels: Mapping[str, Array]) -> list[bytes]:
    """One message per row."""
    columns = [values.reshape(len(values), -1) for values in channels.values()]
    block = np.hstack(columns).astype("<f8")
    return [HEAD + row.tobytes() for row in block]


def channels(text: str, rows: Sequence[bytes], path: Path) -> dict[str, Array]:
    """Channels of messages with this definition."""
    of = {
        match["channel"].strip(): int(match["width"] or 0)
        for line in text.splitlines()
        if (match := _FIELD.fullmatch(line.strip()))
    }
    size = len(HEAD) + 8 * sum(max(width, 1) for width in of.values())
    if "timestamp" not in of or any(len(row) != size for row in rows):
        raise LogError("has samples of urdyn that do not fit their own definition", path)
    whole = b"".join(row[len(HEAD) :] for row in rows)
    block = np.frombuffer(whole, "<f8").reshape(len(rows), -1).astype(np.float64)
    made, start = {}, 0
    for name, width in of.items():
        stop = start + max(width, 1)
        made[name] = block[:, start:stop].copy() if width else block[:, start].copy()
        start = stop
    return made


def _field(channel: str) -> str:
    """The channel's name as ROS allows it: small letters, digits, single underscores."""
    name = re.sub(r"[^a-z0-9]+", "_", channel.lower()).strip("_")
    return name if name[:1].isalpha() else f"c_{name}".rstrip("_")
