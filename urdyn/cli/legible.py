"""Words for a terminal: none acts on it, and none needs a sign that its encoding lacks."""

from __future__ import annotations

import codecs
from io import TextIOWrapper
from typing import TextIO

WAY = "urdyn.legible"  # of encoding, by name
SIGNS = str.maketrans(
    {"±": "+/-", "→": "->", "…": "...", "−": "-", "–": "-", "’": "'", "‘": "'", "·": "*", "²": "^2"}
)

# C0 and C1, which names in files may have: escape sequences set a terminal's title or hide lines.
CONTROLS = dict.fromkeys({*range(0x20), *range(0x7F, 0xA0)} - {*b"\t\n"}, "\ufffd")


def printable(text: str) -> str:
    """Text with U+FFFD in place of each control character."""
    return text.translate(CONTROLS)


def legible(*streams: TextIO) -> None:
    """What a stream's encoding lacks comes out in ASCII: no verb fails over a plus or minus."""
    codecs.register_error(WAY, _ascii)
    for stream in streams:
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=WAY)


def _ascii(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end].translate(SIGNS)
    return lacking.encode("ascii", "replace").decode(), error.end
