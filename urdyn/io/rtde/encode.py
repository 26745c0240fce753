"""Events -> packages: the counterpart of `decode`."""

from __future__ import annotations

import struct
from collections.abc import Iterable

from urdyn.errors import RtdeError
from urdyn.io.rtde.events import (
    Answer,
    ControllerAnswer,
    Data,
    GetController,
    InputsAnswer,
    OutputsAnswer,
    Pause,
    PauseAnswer,
    Request,
    RequestVersion,
    SetupInputs,
    SetupOutputs,
    Start,
    StartAnswer,
    Text,
    VersionAnswer,
)
from urdyn.io.rtde.frames import package


def write_request(event: Request, version: int) -> bytes:
    """A client's event in protocol `version`."""
    match event:
        case RequestVersion(wanted):
            return package(b"V", struct.pack(">H", wanted))
        case GetController():
            return package(b"v")
        case SetupOutputs(names, frequency):
            rate = b"" if version == 1 else struct.pack(">d", frequency)
            return package(b"O", rate + _words(names))
        case SetupInputs(names):
            return package(b"I", _words(names))
        case Start():
            return package(b"S")
        case Pause():
            return package(b"P")
        case Text():
            return package(b"M", _text(event))
        case Data(recipe, values):
            return package(b"U", bytes([recipe]) + values)


def write_answer(event: Answer, version: int) -> bytes:
    """A controller's event in protocol `version`."""
    match event:
        case VersionAnswer(accepted):
            return package(b"V", bytes([accepted]))
        case ControllerAnswer(release):
            return package(b"v", struct.pack(">4I", *release))
        case OutputsAnswer(types, recipe):
            return package(b"O", (b"" if version == 1 else bytes([recipe])) + _words(types))
        case InputsAnswer(types, recipe):
            return package(b"I", bytes([recipe]) + _words(types))
        case StartAnswer(accepted):
            return package(b"S", bytes([accepted]))
        case PauseAnswer(accepted):
            return package(b"P", bytes([accepted]))
        case Text():
            return package(b"M", _plain(event) if version == 1 else _text(event))
        case Data(recipe, values):
            return package(b"U", values if version == 1 else bytes([recipe]) + values)


def _words(words: Iterable[str]) -> bytes:
    try:
        return ",".join(words).encode("ascii")
    except UnicodeEncodeError as error:
        raise RtdeError(f"RTDE names are ASCII: {error}") from error


def _text(event: Text) -> bytes:
    """Message, source and level; what 255 bytes do not hold is cut."""
    parts = (text.encode()[:255] for text in (event.message, event.source))
    return b"".join(bytes([len(part)]) + part for part in parts) + bytes([event.level])


def _plain(event: Text) -> bytes:
    """Level and message, as a controller writes it in protocol 1."""
    return bytes([event.level]) + event.message.encode()
