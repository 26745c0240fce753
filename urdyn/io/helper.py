"""A process that works for this one, at the other end of two pipes, and ends with it."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import weakref
from pathlib import Path
from typing import Any

from urdyn.errors import InputError, UrdynError
from urdyn.io.frames import Frames, Words
from urdyn.types import Array

CHUNK = 1 << 16  # [bytes] read at once
ROOM = 1 << 20  # [bytes] of a pipe, where the system allows it: more than a task takes
GRACE = 2.0  # [s] for a process whose pipes are closed to end by itself


class Helper:
    """A module of ours as a process; nothing is handed over by shared memory or as code.

    Its failures are raised by `listen`, so that the caller chooses the moment.
    """

    def __init__(self, module: str, name: str, advice: str) -> None:
        """Start `python -m module`, which calls `helping`.

        Args:
            name: of what it does, for the user.
            advice: to the user, if it ends early.
        """
        # In a process group of its own, Ctrl-C does not reach it: the run ends it in good order.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module],  # -P: no module from the current folder
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            pipesize=ROOM,
            env=_environment(),
            process_group=0,
        )
        assert self._process.stdin and self._process.stdout, "both are piped"
        self._in, self._out = self._process.stdin.fileno(), self._process.stdout.fileno()
        os.set_blocking(self._in, False)
        os.set_blocking(self._out, False)
        self._outbox, self._frames = bytearray(), Frames()
        self._name, self._advice = name, advice
        self.failed: Exception | None = None
        self._there = False  # has loaded all that it needs
        self._end = weakref.finalize(self, _end, self._process)

    @property
    def waiting(self) -> int:
        """Bytes that it has not taken yet."""
        return len(self._outbox)

    def await_ready(self) -> None:
        """Wait until it listens: starting takes a processor for a second, which others may need."""
        while not self._there:
            self.listen()

    def send(self, *frames: bytes) -> None:
        """Write what the pipe has room for; `exchange` writes the rest. Nothing once ended."""
        if self._end.alive:
            for frame in frames:
                self._outbox += frame
            self._write()

    def close(self) -> None:
        """End it and wait for that; what it has not taken yet is not done."""
        self._end()

    def listen(self, patience: float | None = None) -> list[Words | Array]:
        """The next frames, within `patience` [s]; raises where no more will come."""
        if self.failed:
            raise self.failed
        if not self._end.alive:
            raise UrdynError(f"{self._name} was let go of; {self._advice}")
        return self.exchange(patience)

    def ask(self, *frames: bytes) -> Words | Array:
        """Send, and wait for the answer, of a helper that answers every message once."""
        self.send(*frames)
        while not (said := self.listen()):
            pass
        return said[0]

    def exchange(self, patience: float | None = 0.0) -> list[Words | Array]:
        """Write and read what the pipes allow; the frames read, within `patience` [s]."""
        if not self._end.alive:  # its file descriptors may be reused by now
            return []
        watched = select.poll()
        watched.register(self._out, select.POLLIN)
        if self._outbox:
            watched.register(self._in, select.POLLOUT)
        if not watched.poll(None if patience is None else 1e3 * patience):
            return []
        self._write()
        return self._read()

    def _write(self) -> None:
        try:
            while self._outbox:
                del self._outbox[: os.write(self._in, self._outbox)]
        except BlockingIOError:
            return
        except BrokenPipeError:  # it may have said why; `_read` finds that
            self._outbox.clear()

    def _read(self) -> list[Words | Array]:
        heard: list[Words | Array] = []
        try:
            while data := os.read(self._out, CHUNK):
                heard += self._frames.take(data)
        except BlockingIOError:
            return [frame for frame in heard if self._told(frame)]
        heard = [frame for frame in heard if self._told(frame)]
        self.failed = self.failed or UrdynError(f"{self._name} {self._end()}; {self._advice}")
        return heard

    def _told(self, frame: Words | Array) -> bool:
        """Whether a frame is an answer; one that reports readiness or failure is noted instead."""
        match frame:
            case {"ready": _}:
                self._there = True
                return False
            case {"failed": reason}:
                self.failed = InputError(reason)
            case {"broken": trace}:
                self.failed = RuntimeError(trace.strip().splitlines()[-1])
                self.failed.add_note(trace)
        return self.failed is None


def _environment() -> dict[str, str]:
    """Our own, with this very urdyn on its path."""
    home, known = str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH")
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, (home, known)))}


def _end(process: subprocess.Popen[Any]) -> str:
    """Close its pipes and wait for it; how it ended, in words."""
    for pipe in (process.stdin, process.stdout):
        if pipe:
            pipe.close()
    try:
        status = process.wait(GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        status = process.wait()
    if status < 0:
        return f"was ended by {signal.Signals(-status).name}"
    return f"ended with status {status}"
