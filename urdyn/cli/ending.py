"""Processes that run until somebody ends them."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def ended_by(end: Callable[[], None]) -> Iterator[None]:
    """Meanwhile Ctrl-C, and a service manager's way to end a process, call `end`.

    Both are asked for: a process that a script put into the background is deaf to Ctrl-C else.
    Whoever handled them before does so again afterwards.
    """
    both = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: end()) for number in both]
    try:
        yield
    finally:
        for number, handler in zip(both, before, strict=True):
            signal.signal(number, handler)
