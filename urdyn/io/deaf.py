"""Processes of ours that leave Ctrl-C to this one."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker


@contextmanager
def deaf_to_interrupts() -> Iterator[None]:
    """Let processes that begin here ignore Ctrl-C, which a terminal sends to all of them."""
    resource_tracker.ensure_running()  # which hears them again, where it begins in here
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
