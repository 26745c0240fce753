"""A diagnosis in a process of its own: python -m urdyn.diagnose.apart, which `Onlooker` begins.

First comes the twin, then the task, then what is seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from urdyn.diagnose.desk import Desk
from urdyn.diagnose.task import task_of
from urdyn.io.frames import Words, words_of
from urdyn.io.helping import Heard, helping
from urdyn.io.rss import peak_rss
from urdyn.twin import fit_of
from urdyn.types import Array

TOLD = ("findings", "arm", "joints", "recommendation", "observability")  # in a run's summary, too


def _answers(heard: Heard) -> Iterator[Words]:
    """What there is to say to what comes in."""
    fit = fit_of(words_of(next(heard)), "twin")
    desk = Desk(task_of(fit, words_of(next(heard))))
    yield {"findings": desk.write()["findings"]}
    for frame in heard:
        if answer := _answer(desk, frame):
            yield answer


def _answer(desk: Desk, frame: Words | Array) -> dict[str, Any]:
    """What a frame asks for, or what it made known; nothing: {}."""
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
    helping(_answers)
