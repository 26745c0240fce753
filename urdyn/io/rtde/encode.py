"""Events -> packages: the counterpart of `decode`."""

from __future__ import annotations

import struct
from collections.abc import Iterable

from urdyn.errors import RtdeError
from urdyn.io.rtde import events
from urdyn.io.rtde.frames import package


def write_request(event: events.Request, version: int) -> bytes:
    """A client's event in protocol `version`."""
    match event:
        case events.RequestVersion(wanted):
            return package(b"V", struct.pack(">H", wanted))
        case events.GetController():
            return package(b"v")
        case events.SetupOutputs(names, frequency):
            rate = b"" if version == 1 else struct.pack(">d", frequency)
            return package(b"O", rate + _words(names))
        case events.SetupInputs(names):
            return package(b"I", _words(names))
        case events.Start():
            return package(b"S")
        case events.Pause():
            return package(b"P")
        case events.Text():
            return package(b"M", _text(event))
        case events.Data(recipe, values):
            return package(b"U", bytes([recipe]) + values)


def write_answer(event: events.Answer, version: int) -> bytes:
    """A controller's event in protocol `version`."""
    match event:
        case events.VersionAnswer(accepted):
            return package(b"V", bytes([accepted]))
        case events.ControllerAnswer(release):
            return package(b"v", struct.pack(">4I", *release))
        case events.OutputsAnswer(types, recipe):
            return package(b"O", (b"" if version == 1 else bytes([recipe])) + _words(types))
        case events.InputsAnswer(types, recipe):
            return package(b"I", bytes([recipe]) + _words(types))
        case events.StartAnswer(accepted):
            return package(b"S", bytes([accepted]))
        case events.PauseAnswer(accepted):
            return package(b"P", bytes([accepted]))
        case events.Text():
            return package(b"M", _plain(event) if version == 1 else _text(event))
        case events.Data(recipe, values):
            return package(b"U", values if version == 1 else bytes([recipe]) + values)


def _words(words: Iterable[str]) -> bytes:
    try:
        return ",".join(words).encode("ascii")
    except UnicodeEncodeError as error:
        raise RtdeError(f"RTDE names are ASCII: {error}") from error


def _text(event: events.Text) -> bytes:
    """Message, source and level; what 255 bytes do not hold is cut."""
    parts = (text.encode()[:255] for text in (event.message, event.source))
    return b"".join(bytes([len(part)]) + part for part in parts) + bytes([event.level])


def _plain(event: events.Text) -> bytes:
    """Level and message, as a controller writes it in protocol 1."""
    return bytes([event.level]) + event.message.encode()
