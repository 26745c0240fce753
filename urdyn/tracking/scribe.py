"""Who puts a run on disk, in a process of its own: python -m urdyn.tracking.scribe.

`Keeper` begins it. First comes what the history is; then rows, one a frame, and words:

    cut     the rows so far, as the part of this number
    keep    a checkpoint, whose numbers come next
    join    so many parts as one file

That file grows beside the parts, so that the end of a long run waits for the last of them alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from urdyn.io.frames import Words, numbers_of, words_of
from urdyn.io.helping import Heard, helping
from urdyn.tracking.checkpoint import write
from urdyn.tracking.history import History, Whole
from urdyn.tracking.parts import writing_parts
from urdyn.types import Array


def _answers(heard: Heard) -> Iterator[Words]:
    """What has been written."""
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
