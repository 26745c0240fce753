"""Words for a terminal whose encoding lacks some of our characters."""

from __future__ import annotations

import codecs
from io import TextIOWrapper
from typing import TextIO

WAY = "urdyn.legible"  # of encoding, by name
SIGNS = str.maketrans(
    {"±": "+/-", "→": "->", "…": "...", "−": "-", "–": "-", "’": "'", "‘": "'", "·": "*", "²": "^2"}
)


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
