"""A tracked run's page, drawn in a process of its own: python -m urdyn.report.track.apart.

A process that tracks a robot for months need not load what reads and draws its history.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from urdyn.io import write_text
from urdyn.io.frames import Words, words_frame, words_of
from urdyn.io.helper import Helper
from urdyn.io.helping import Heard, helping
from urdyn.io.plain import plain


def draw(history: Path, summary: Mapping[str, Any], page: Path) -> float | None:
    """Write the page of `track_page` to the file `page`; the average surprise that it shows."""
    helper = Helper("urdyn.report.track.apart", "the drawing of the report", "run again")
    with closing(helper):
        told = {"history": str(history.absolute()), "page": str(page.absolute())}
        drawn = words_of(helper.ask(words_frame(told | {"summary": dict(summary)})))
    surprise: float | None = drawn["surprise"]
    return surprise


def _answers(heard: Heard) -> Iterator[Words]:
    """Where the page is written, and the average surprise of its history."""
    from urdyn.report.track.history import History
    from urdyn.report.track.page import track_page

    for words in map(words_of, heard):
        run = History((Path(words["history"]),))
        write_text(words["page"], track_page(run, words["summary"]))
        yield {"written": words["page"], "surprise": plain(run.surprise)}


if __name__ == "__main__":
    helping(_answers)
