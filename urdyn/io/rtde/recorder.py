"""record(): a controller -> a file, every package of it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection
from pathlib import Path
from queue import SimpleQueue

from urdyn.errors import RtdeError, UrdynError
from urdyn.given import given_number, positive
from urdyn.io.rtde.client import Client, Event, connect, parse_address
from urdyn.io.rtde.journal import Journal
from urdyn.io.rtde.recipe import DEFAULT
from urdyn.io.rtde.recipe_file import read_recipe
from urdyn.io.rtde.recording import Recording
from urdyn.io.rtde.tally import Summary

FLUSH = 0.5  # [s] of packages that a killed process loses, at most
Inbox = SimpleQueue[Event | UrdynError]


def record(
    host: str,
    out: str | Path,
    frequency: float | None = None,
    recipe: str | Path | Collection[str] | None = None,
    duration: float | None = None,
    progress: Callable[[Summary], None] | None = None,
    stop: threading.Event | None = None,
) -> Summary:
    """Record a controller, for `duration` [s], until `stop` is set, or interrupted by the keyboard.

    `host` is HOST, HOST:PORT or rtde://HOST:PORT; `frequency` [Hz] by default the controller's own;
    `recipe` a file or the names themselves. One thread does nothing but read and stamp, so that
    writing delays no package; a connection that drops is restored. An interrupt may come between
    counting packages and writing them, and lose those; `stop` loses none.
    """
    for what, number in (("duration", duration), ("frequency", frequency)):
        if number is not None:
            given_number(number, what, "a number above 0", positive)
    target, port = parse_address(host)
    journal, names = Journal(out), _names(recipe)
    with connect(target, port, names, frequency) as client:
        recording = Recording(journal, client.order.address, duration)
        try:
            _follow(client, recording, duration, progress, stop or threading.Event())
        finally:
            summary = recording.finish()
    if not summary.samples:
        raise RtdeError("sent no data; nothing was recorded", client.order.address)
    return summary


def _names(recipe: str | Path | Collection[str] | None) -> tuple[str, ...]:
    """Variables to record; the stamp is always among them, and first."""
    if recipe is None:
        return DEFAULT
    wanted = read_recipe(recipe) if isinstance(recipe, str | Path) else recipe
    return tuple(dict.fromkeys(("timestamp", *wanted)))


def _follow(
    client: Client,
    recording: Recording,
    duration: float | None,
    progress: Callable[[Summary], None] | None,
    stop: threading.Event,
) -> None:
    """Write what comes, a batch at a time."""
    inbox: Inbox = SimpleQueue()
    threading.Thread(target=_pump, args=(client, inbox), daemon=True).start()
    end = time.monotonic() + (float("inf") if duration is None else duration + FLUSH)
    try:
        # Polled, not waited for: a signal's handler that sets it may interrupt this very thread.
        while not (stop.is_set() or recording.over) and time.monotonic() < end:
            time.sleep(FLUSH)
            _empty(inbox, recording)
            if progress:
                progress(recording.summary())
    except KeyboardInterrupt:  # the usual way to end a recording
        _empty(inbox, recording)


def _pump(client: Client, inbox: Inbox) -> None:
    """Put every event into the inbox; last, why the client gave up."""
    try:
        for event in client.events():
            inbox.put(event)
    except UrdynError as error:
        inbox.put(error)


def _empty(inbox: Inbox, recording: Recording) -> None:
    """Write all that has come so far; raises where the client gave up."""
    came = [inbox.get_nowait() for _ in range(inbox.qsize())]
    recording.take(event for event in came if not isinstance(event, UrdynError))
    if came and isinstance(came[-1], UrdynError):
        raise came[-1]
