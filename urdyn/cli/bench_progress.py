"""What a bench says while it is at work: a bar on a terminal, elsewhere a line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread

from urdyn.cli.voice import Told, Voice

EVERY = 5.0  # [s] from line to line, for a log that somebody waits beside


@contextmanager
def progress(voice: Voice, doing: str) -> Iterator[Told]:
    """Minutes without a word look like a bench that hangs, whoever reads its standard error."""
    with voice.progress(doing) as told:
        if voice.quiet or sys.stderr.isatty():
            yield told
            return
        begin, now, ended = time.monotonic(), [doing], Event()

        def note(doing: str, share: float) -> None:
            now[:] = [doing]

        def speak() -> None:
            while not ended.wait(EVERY):
                voice.note(f"{time.monotonic() - begin:.0f} s: {now[0]}")

        speaker = Thread(target=speak, daemon=True)
        speaker.start()
        try:
            yield note
        finally:
            ended.set()
            speaker.join()
