"""The other end of a `Helper`: what its process does."""

from __future__ import annotations

import os
import signal
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress

from urdyn.errors import UrdynError
from urdyn.io.frames import Frames, Words, numbers_frame, words_frame
from urdyn.io.helper import CHUNK
from urdyn.types import Array

STAND_BACK = 5  # nice, of 19: a third of the helped process's share, which it needs
BREATH = 2e-4  # [s] of work between yields of the processor

Heard = Iterator[Words | Array]


def helping(answers: Callable[[Heard], Iterator[Words | Array]]) -> None:
    """Write what `answers` makes of incoming frames, until there are no more.

    The process ends with its parent, however that ends; interrupts are the parent's business
    alone.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    stand_back()
    breath = _Breath()
    out = os.dup(1)
    os.dup2(2, 1)  # what a library prints is no frame
    from threadpoolctl import threadpool_limits

    def say(answer: Words | Array) -> None:
        told = words_frame(answer) if isinstance(answer, Mapping) else numbers_frame(answer)
        frame = memoryview(told)
        breath.waits()
        try:
            while frame:
                frame = frame[os.write(out, frame) :]
        except BrokenPipeError:  # the parent is gone
            raise SystemExit from None
        breath.works()

    try:
        say({"ready": True})
        with threadpool_limits(1):
            for answer in answers(_heard(breath)):
                say(answer)
    except UrdynError as error:
        say({"failed": str(error)})
    except Exception:
        say({"broken": traceback.format_exc()})


def stand_back() -> None:
    """Give way to the parent; where the system can, its messages do not make us preempt it."""
    os.nice(STAND_BACK)
    if hasattr(os, "SCHED_BATCH"):
        with suppress(OSError):  # a sandbox may not let us
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


class _Breath:
    """Yields the processor again and again while the helper works; one that waits need not.

    Otherwise a system may let it finish its time slice of some milliseconds, which is several
    samples.
    """

    def __init__(self) -> None:
        self._every = 0.0  # [s]; 0: it waits
        signal.signal(signal.SIGALRM, self._give_way)

    def works(self) -> None:
        """From here on."""
        self._every = BREATH
        signal.setitimer(signal.ITIMER_REAL, self._every)

    def waits(self) -> None:
        """From here on, for input or for a reader of its output."""
        self._every = 0.0
        signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _give_way(self, *_: object) -> None:
        """Yield once; the timer restarts when the processor is ours again, or this never ends."""
        os.sched_yield()
        signal.setitimer(signal.ITIMER_REAL, self._every)


def _heard(breath: _Breath) -> Heard:
    """Incoming frames; after the last, this process ends.

    What a dead parent left behind is not done: another run will do it again.
    """
    frames, parent = Frames(), os.getppid()
    while True:
        breath.waits()
        if not (data := os.read(0, CHUNK)):
            raise SystemExit
        breath.works()
        for frame in frames.take(data):
            if os.getppid() != parent:
                raise SystemExit
            yield frame
