"""Writes a run to disk in a process of its own: python -m urdyn.tracking.output.scribe.

`Keeper` starts it. The first frame describes the history; then come rows, one per frame, and words:

    cut     write the rows so far as the part of this number
    keep    write a checkpoint, whose numbers come next
    join    join this many parts into one file

That file grows along with the parts, so that the end of a long run waits only for the last of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from urdyn.io.frames import Words, numbers_of, words_of
from urdyn.io.helping import Heard, helping
from urdyn.tracking.output.checkpoint import write
from urdyn.tracking.output.history import History, Whole
from urdyn.tracking.output.history_parts import writing_parts
from urdyn.types import Array


def _answers(heard: Heard) -> Iterator[Words]:
    """Reports of what has been written."""
    task = words_of(next(heard))
    folder = Path(task["folder"])
    history = History(folder, tuple(task["names"]), tuple(task["units"]), task["joints"])
    rows: list[Array] = []
    with writing_parts(folder), closing(Whole(history, task["origin"])) as whole:
        for frame in heard:
            match frame:
                case {"cut": number}:
                    history.write(number, rows)
                    rows = []
                    whole.approach(number + 1)
                case {"keep": index, "layout": layout}:
                    write(layout, numbers_of(next(heard)), task["identity"], folder)
                    yield {"kept": index}
                case {"join": parts}:
                    whole.finish(parts)
                    yield {"changes": history.changes()}
                case _:
                    rows.append(numbers_of(frame))


if __name__ == "__main__":
    helping(_answers)
