"""A diagnosis in a process of its own: python -m urdyn.diagnose.apart, which `Onlooker` begins.

Frames of `wire` come in and go out. The process ends with the one that began it, however that ends;
how a run is interrupted is that one's business alone.
"""

from __future__ import annotations

import os
import signal
import traceback
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from urdyn.diagnose.desk import Desk
    from urdyn.diagnose.wire import Words
    from urdyn.types import Array

CHUNK = 1 << 16  # [bytes] read at once
TOLD = ("findings", "joints", "recommendation", "observability")  # in a run's summary, too


def main() -> None:
    """Diagnose what comes in, until there is no more."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    out = os.dup(1)
    os.dup2(2, 1)  # what a library prints is no frame
    from threadpoolctl import threadpool_limits

    from urdyn.diagnose.wire import words_frame
    from urdyn.errors import UrdynError

    def say(words: Words) -> None:
        frame = memoryview(words_frame(words))
        while frame:
            frame = frame[os.write(out, frame) :]

    try:
        with threadpool_limits(1):
            for words in _answers():
                say(words)
    except BrokenPipeError:  # nobody is there any more
        return
    except UrdynError as error:
        say({"failed": str(error)})
    except Exception:
        say({"broken": traceback.format_exc()})


def _answers() -> Iterator[Words]:
    """What there is to say to what comes in."""
    from urdyn.diagnose.desk import Desk
    from urdyn.diagnose.task import task_of

    frames, desk = _frames(), None
    for frame in frames:
        if desk is None:
            assert isinstance(frame, Mapping), "first comes the task"
            desk = Desk(task_of(frame))
            yield {"findings": desk.write()["findings"]}
        elif answer := _answer(desk, frame):
            yield answer


def _frames() -> Iterator[Words | Array]:
    """What comes in; what a process that is gone left behind, another run will do again."""
    from urdyn.diagnose.wire import Frames

    frames, parent = Frames(), os.getppid()
    while data := os.read(0, CHUNK):
        for frame in frames.take(data):
            if os.getppid() != parent:
                return
            yield frame


def _answer(desk: Desk, frame: Words | Array) -> dict[str, Any]:
    """What a frame asks for, or what it made known; nothing: {}."""
    from urdyn.io.rss import peak_rss

    if not isinstance(frame, Mapping):
        found = desk.take(frame)
        return {"told": desk.untold(found), "findings": desk.write()["findings"]} if found else {}
    if "keep" in frame:
        document = desk.write()
        desk.keep(frame["keep"])
        return {"kept": frame["keep"], "findings": document["findings"]}
    found = desk.finish()
    document = desk.write()
    summary = {name: document[name] for name in TOLD} | {"diagnosis_rss_mb": peak_rss() / 1e6}
    return {"told": desk.untold(found), "findings": document["findings"], "finished": summary}


if __name__ == "__main__":
    main()
