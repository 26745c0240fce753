"""What `urdyn track` wrote -> MCAP: the history, and every finding at the time of its alarm."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io.bags.forms import is_log
from urdyn.io.bags.outgoing import Message, Outgoing, Told, nanoseconds, told, typestore
from urdyn.io.bags.write import write_mcap
from urdyn.io.files import sha256, writing
from urdyn.io.plain import finite
from urdyn.io.reader import read
from urdyn.io.ros2.compose import Types
from urdyn.io.run_folder import FINDINGS, HISTORY
from urdyn.io.status import Status, of_finding
from urdyn.version import __version__

ARRAY, TEXT = "diagnostic_msgs/msg/DiagnosticArray", "std_msgs/msg/String"


def is_tracked(path: Path) -> bool:
    """Is it a file of findings, or a folder of tracking results?"""
    if path.is_dir():
        return not is_log(path) and any(map(Path.exists, _files(path)))
    return path.suffix == ".json"


def write_tracked(path: Path, out: Path) -> tuple[int, list[str]]:
    """Write a folder's history and findings, or findings alone; how many messages, and of what."""
    if out.suffix.lower() != ".mcap":
        raise InputError(f"{out}: findings are written as .mcap; a {HISTORY} in any form")
    files = [file for file in (_files(path) if path.is_dir() else (path,)) if file.exists()]
    if not files:
        raise InputError(f"{path}: cannot be read: no such file")
    streams = [_history(f) if f.name == HISTORY else _findings(f) for f in files]
    whole, counts = _joined(streams), [0]
    with writing(out) as stream:
        write_mcap(Told(whole.topics, _counted(whole.messages, counts)), stream, _origin(files))
    return counts[0], [file.name for file in files]


def diagnostics(statuses: tuple[Status, ...], stamp: int) -> bytes:
    """A DiagnosticArray as CDR, at `stamp` [ns]."""
    store = typestore()
    message = Types(store.types.__getitem__, int).diagnostics(stamp, statuses)
    return bytes(store.serialize_cdr(message, ARRAY))


def _files(folder: Path) -> tuple[Path, ...]:
    return folder / HISTORY, folder / FINDINGS


def _history(path: Path) -> Told:
    log = read(path)
    return told([{"timestamp": log.t} | dict(log.channels)])


def _findings(path: Path) -> Told:
    """Every finding twice: as a line of diagnostics, and word for word."""
    found = sorted(_loaded(path), key=lambda pair: pair[0])
    topics = Outgoing.standard("/diagnostics", ARRAY), Outgoing.standard("/urdyn/findings", TEXT)
    return Told(topics, _alarms(found))


def _alarms(found: list[tuple[int, dict[str, Any]]]) -> Iterator[Message]:
    store = typestore()
    for stamp, finding in found:
        text = store.types[TEXT](json.dumps(finding))
        yield 0, stamp, diagnostics((of_finding(finding),), stamp)
        yield 1, stamp, bytes(store.serialize_cdr(text, TEXT))


def _loaded(path: Path) -> list[tuple[int, dict[str, Any]]]:
    """Findings with their alarms [ns]; InputError where the file holds something else."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read as findings: {error}") from error
    findings = document.get("findings") if isinstance(document, Mapping) else document
    if not isinstance(findings, list) or not all(isinstance(f, dict) for f in findings):
        raise InputError(f"{path}: has no list of findings, as `urdyn track` writes them")
    return [(_alarm(finding, path), finding) for finding in findings]


def _alarm(finding: dict[str, Any], path: Path) -> int:
    at = finite(finding.get("alarm_s"))
    if at is None:
        raise InputError(f"{path}: a finding has no alarm_s, so no place in time")
    return int(nanoseconds(np.array([at]))[0])


def _joined(streams: list[Told]) -> Told:
    """Several streams in one, by time."""
    topics: tuple[Outgoing, ...] = ()
    shifted: list[Iterator[Message]] = []
    for one in streams:
        shifted.append(_shifted(one.messages, len(topics)))
        topics += one.topics
    return Told(topics, merge(*shifted, key=lambda message: message[1]))


def _shifted(messages: Iterator[Message], by: int) -> Iterator[Message]:
    return ((topic + by, stamp, data) for topic, stamp, data in messages)


def _counted(messages: Iterator[Message], counts: list[int]) -> Iterator[Message]:
    for message in messages:
        counts[0] += 1
        yield message


def _origin(files: list[Path]) -> dict[str, str]:
    return {"urdyn.version": __version__} | {f"sha256 of {f.name}": sha256(f) for f in files}
