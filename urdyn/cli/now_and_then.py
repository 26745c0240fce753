"""Progress as an occasional line: for a log, and a terminal on which nothing can be redrawn."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from urdyn.progress import Progress

FIRST = 15.0  # [s] of silence before the first line: most verbs have ended by then
LAST = 300.0  # [s] from line to line in the end, to keep a day's log short


@contextmanager
def lines(say: Callable[[str], None], doing: str) -> Iterator[Progress]:
    """Prints the latest progress; minutes of silence look like work that hangs."""
    begin, now, ended = time.monotonic(), [doing], Event()

    def speak() -> None:
        wait = FIRST
        while not ended.wait(wait):
            say(f"{time.monotonic() - begin:.0f} s: {now[0]}")
            wait = min(2.0 * wait, LAST)

    def progress(doing: str, share: float) -> None:
        now[0] = doing

    speaker = Thread(target=speak, daemon=True)
    speaker.start()
    try:
        yield progress
    finally:
        ended.set()
        speaker.join()
