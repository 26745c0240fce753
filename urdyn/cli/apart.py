"""Logs that another process simulates, so that whoever plays them meanwhile keeps time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import TypeVar

import urdyn as ud
from urdyn.errors import UrdynError
from urdyn.io.deaf import deaf_to_interrupts
from urdyn.io.helping import stand_back

PIECE = 500  # rows handed over at once, which takes a fraction of a millisecond

T = TypeVar("T")


def apart(make: Callable[[], Iterator[ud.Log]]) -> Iterator[ud.Log]:
    """The endless logs of `make`, a value that can be pickled, in pieces.

    The process ends with this one, whose threads would have to wait for a simulation for tenths of
    a second.
    """
    context = get_context("spawn")
    heard, said = context.Pipe(duplex=False)
    with deaf_to_interrupts():
        context.Process(target=_say, args=(said, make), daemon=True).start()
    said.close()
    return _heard(heard)


def ahead(values: Iterator[T]) -> Iterator[T]:
    """Endless values, each made in a thread beside while the last is in use."""
    coming = _begun(values)
    while True:
        value, coming = coming.result(), _begun(values)
        yield value


def _heard(pipe: Connection) -> Iterator[ud.Log]:
    while True:
        try:
            said = pipe.recv()
        except EOFError:
            raise UrdynError("the simulation's process was killed; start it again") from None
        if isinstance(said, Exception):
            raise said
        yield said


def _say(pipe: Connection, make: Callable[[], Iterator[ud.Log]]) -> None:
    """Send all pieces of all logs; what is not taken waits, while the next log is made."""
    stand_back()
    try:
        for log in ahead(make()):
            for first in range(0, len(log), PIECE):
                pipe.send(log.slice(first, first + PIECE))
    except BrokenPipeError:  # nobody listens any more
        return
    except Exception as error:
        pipe.send(error)


def _begun(values: Iterator[T]) -> Future[T]:
    coming: Future[T] = Future()

    def make() -> None:
        try:
            coming.set_result(next(values))
        except Exception as error:  # raised where the value is waited for
            coming.set_exception(error)

    Thread(target=make, daemon=True).start()
    return coming
