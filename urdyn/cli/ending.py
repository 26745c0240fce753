"""Processes that run until somebody ends them."""

from __future__ import annotations

import signal
from collections.abc import Callable


def on_ending(end: Callable[[], None]) -> None:
    """Ctrl-C, and a service manager's way to end a process, call `end`.

    Both are asked for: a process that a script put into the background is deaf to Ctrl-C else.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: end())
