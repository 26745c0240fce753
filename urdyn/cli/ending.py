"""Processes that run until they are ended from outside."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def ended_by(end: Callable[[], None]) -> Iterator[None]:
    """In this block Ctrl-C, and the signal by which a service manager ends a process, call `end`.

    Both are set: a process that a script put into the background would otherwise ignore Ctrl-C.
    Their former handlers are restored afterwards.
    """
    both = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: end()) for number in both]
    try:
        yield
    finally:
        for number, handler in zip(both, before, strict=True):
            signal.signal(number, handler)
