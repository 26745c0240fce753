"""Who puts a run on disk, in a process of its own: python -m urdyn.tracking.scribe.

`Keeper` begins it. First comes what the history is; then rows, one a frame, and words:

    cut     the rows so far, as the part of this number
    keep    a checkpoint, whose numbers come next
    join    all parts as one file
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from urdyn.io.frames import Words, numbers_of, words_of
from urdyn.io.helping import Heard, helping
from urdyn.tracking.checkpoint import write
from urdyn.tracking.history import History
from urdyn.tracking.parts import writing_parts
from urdyn.types import Array


def _answers(heard: Heard) -> Iterator[Words]:
    """What has been written."""
    task = words_of(next(heard))
    folder = Path(task["folder"])
    history = History(folder, tuple(task["names"]), tuple(task["units"]), task["joints"])
    rows: list[Array] = []
    with writing_parts(folder):
        for frame in heard:
            match frame:
                case {"cut": number}:
                    history.write(number, rows)
                    rows = []
                case {"keep": index, "layout": layout}:
                    write(layout, numbers_of(next(heard)), task["identity"], folder)
                    yield {"kept": index}
                case {"join": origin, "parts": parts}:
                    history.join(parts, origin)
                    yield {"changes": history.changes()}
                case _:
                    rows.append(numbers_of(frame))


if __name__ == "__main__":
    helping(_answers)
