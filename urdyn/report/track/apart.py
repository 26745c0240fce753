"""A tracked run's page, drawn in a process of its own: python -m urdyn.report.track.apart.

Who tracks a robot for months need not hold what reads and draws its history.
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


def draw(history: Path, summary: Mapping[str, Any], page: Path) -> None:
    """Write the page of `track_page` to the file `page`."""
    helper = Helper("urdyn.report.track.apart", "the drawing of the report", "run again")
    with closing(helper):
        told = {"history": str(history.absolute()), "page": str(page.absolute())}
        helper.ask(words_frame(told | {"summary": dict(summary)}))


def _answers(heard: Heard) -> Iterator[Words]:
    """That the page is written."""
    from urdyn.report.track.page import track_page

    for words in map(words_of, heard):
        write_text(words["page"], track_page(Path(words["history"]), words["summary"]))
        yield {"written": words["page"]}


if __name__ == "__main__":
    helping(_answers)
