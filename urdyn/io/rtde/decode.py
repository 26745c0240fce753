"""Packages -> events: what a payload says, by the side that sent it and the protocol agreed."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import TypeVar

from urdyn.errors import RtdeError
from urdyn.io.rtde import events
from urdyn.io.rtde.frames import Packet

Event = TypeVar("Event")


def read_request(packet: Packet, version: int) -> events.Request:
    """What a client says in protocol `version`."""
    return _read(_REQUESTS, packet, version)


def read_answer(packet: Packet, version: int) -> events.Answer:
    """What a controller says in protocol `version`."""
    return _read(_ANSWERS, packet, version)


def _read(
    readers: Mapping[bytes, Callable[[bytes, int], Event]], packet: Packet, version: int
) -> Event:
    try:
        return readers[packet.kind](packet.payload, version)
    except (struct.error, ValueError, IndexError) as error:
        told = f"a package of type {packet.kind.decode()} with {len(packet.payload)} bytes"
        raise RtdeError(f"cannot read {told}: {error}") from error


def _empty(event: Callable[[], Event]) -> Callable[[bytes, int], Event]:
    """Reader of a package that is a header and nothing else."""

    def read(payload: bytes, version: int) -> Event:
        if payload:
            raise ValueError("it has no payload")
        return event()

    return read


def _accepted(event: Callable[[bool], Event]) -> Callable[[bytes, int], Event]:
    """Reader of a package that is one byte, 1 for yes."""
    return lambda payload, version: event(bool(struct.unpack(">B", payload)[0]))


def _words(payload: bytes) -> tuple[str, ...]:
    """Words between commas; a comma at the end, as some clients send, means nothing."""
    words = payload.decode("ascii").split(",")
    return tuple(word.strip() for word in words if word.strip())


def _text(payload: bytes, version: int) -> events.Text:
    """Message, source and level."""
    end = 1 + payload[0]
    stop = end + 1 + payload[end]
    message, source = payload[1:end], payload[end + 1 : stop]
    (level,) = struct.unpack(">B", payload[stop:])
    return events.Text(message.decode(errors="replace"), source.decode(errors="replace"), level)


def _controller_text(payload: bytes, version: int) -> events.Text:
    """A controller that speaks protocol 1 sends level and message."""
    if version > 1:
        return _text(payload, version)
    return events.Text(payload[1:].decode(errors="replace"), level=payload[0])


def _data(payload: bytes, version: int) -> events.Data:
    return events.Data(payload[0], payload[1:])


def _controller_data(payload: bytes, version: int) -> events.Data:
    return _data(payload, version) if version > 1 else events.Data(0, payload)


def _setup_outputs(payload: bytes, version: int) -> events.SetupOutputs:
    if version == 1:
        return events.SetupOutputs(_words(payload))
    (frequency,) = struct.unpack_from(">d", payload)
    return events.SetupOutputs(_words(payload[8:]), frequency)


def _outputs_answer(payload: bytes, version: int) -> events.OutputsAnswer:
    if version == 1:
        return events.OutputsAnswer(_words(payload))
    return events.OutputsAnswer(_words(payload[1:]), payload[0])


def _controller_answer(payload: bytes, version: int) -> events.ControllerAnswer:
    major, minor, bugfix, build = struct.unpack(">4I", payload)
    return events.ControllerAnswer((major, minor, bugfix, build))


_REQUESTS: Mapping[bytes, Callable[[bytes, int], events.Request]] = {
    b"V": lambda payload, version: events.RequestVersion(*struct.unpack(">H", payload)),
    b"v": _empty(events.GetController),
    b"M": _text,
    b"U": _data,
    b"O": _setup_outputs,
    b"I": lambda payload, version: events.SetupInputs(_words(payload)),
    b"S": _empty(events.Start),
    b"P": _empty(events.Pause),
}

_ANSWERS: Mapping[bytes, Callable[[bytes, int], events.Answer]] = {
    b"V": _accepted(events.VersionAnswer),
    b"v": _controller_answer,
    b"M": _controller_text,
    b"U": _controller_data,
    b"O": _outputs_answer,
    b"I": lambda payload, version: events.InputsAnswer(_words(payload[1:]), payload[0]),
    b"S": _accepted(events.StartAnswer),
    b"P": _accepted(events.PauseAnswer),
}
