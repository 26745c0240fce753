"""Processes that run until they are ended from outside."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def ended_by(end: Callable[[], None]) -> Iterator[None]:
    """In this block Ctrl-C, a service manager's signal and a closed terminal call `end`.

    Ctrl-C does even in a process that a script put into the background, which would otherwise
    ignore it; a closed terminal does not under nohup. Former handlers are restored afterwards.
    """

    def ended(number: int, _: object) -> None:
        if number == signal.SIGHUP:
            _speak_to_nobody()
        end()

    nohup = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    numbers = (signal.SIGINT, signal.SIGTERM, *([] if nohup else [signal.SIGHUP]))
    before = [signal.signal(number, ended) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _speak_to_nobody() -> None:
    """Drop further output to a terminal that is gone: it would fail, and with it what is left."""
    for output in (1, 2):
        try:
            os.write(output, b"")
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), output)
