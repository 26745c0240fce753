"""A diagnosis in a process of its own: python -m urdyn.diagnose.worker, which `Onlooker` begins.

It receives the twin, then the job, then the instants.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from urdyn.diagnose.findings.document import ORIGIN
from urdyn.diagnose.job import job_of
from urdyn.diagnose.session import Session
from urdyn.io.frames import Words, words_of
from urdyn.io.helping import Heard, helping
from urdyn.io.rss import peak_rss
from urdyn.twin import fit_of
from urdyn.types import Array


def _answers(heard: Heard) -> Iterator[Words]:
    """Answers to the incoming frames."""
    fit = fit_of(words_of(next(heard)), "twin")
    session = Session(job_of(fit, words_of(next(heard))))
    first = _so_far(session.write())
    last = first["findings"]
    yield first
    for frame in heard:
        answer = _answer(session, frame)
        if answer.get("findings") == last:  # reading them again would delay a sample
            del answer["findings"]
        last = answer.get("findings", last)
        if answer:
            yield answer


def _answer(session: Session, frame: Words | Array) -> dict[str, Any]:
    """The answer to a frame; {}: none."""
    if not isinstance(frame, Mapping):
        found = session.take(frame)
        return {"told": session.untold(found), **_so_far(session.write())} if found else {}
    if "note" in frame:
        session.note(**frame["note"])
        return _so_far(session.write())
    if "keep" in frame:
        document = session.write()
        session.keep(frame["keep"])
        return {"kept": frame["keep"], **_so_far(document)}
    found = session.finish()
    document = session.write()
    said = {name: of for name, of in document.items() if name not in ORIGIN}
    finished = said | {"diagnosis_rss_mb": peak_rss() / 1e6}
    return {"told": session.untold(found), **_so_far(document), "finished": finished}


def _so_far(document: Mapping[str, Any]) -> dict[str, Any]:
    """The findings, and what makes them all doubtful."""
    return {"findings": document["findings"], "doubt": document.get("doubt", "")}


if __name__ == "__main__":
    helping(_answers)
