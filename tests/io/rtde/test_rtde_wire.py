from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from urdyn.errors import RtdeError
from urdyn.io.rtde import events as e
from urdyn.io.rtde.frames import Frames, package
from urdyn.io.rtde.wire import client_wire, controller_wire

NAMES = ("timestamp", "actual_q")
TYPES = ("DOUBLE", "VECTOR6D")
REQUESTS: dict[int, tuple[e.Request, ...]] = {
    version: (
        e.RequestVersion(2),
        e.GetController(),
        e.SetupOutputs(NAMES, 125.0 if version == 2 else None),
        e.SetupInputs(("input_int_register_24",)),
        e.Start(),
        e.Pause(),
        e.Text("stopped", "us", e.Level.ERROR),
        e.Data(3, b"\0\1\2\3"),
    )
    for version in (1, 2)
}
ANSWERS: dict[int, tuple[e.Answer, ...]] = {
    version: (
        e.VersionAnswer(True),
        e.ControllerAnswer((5, 23, 0, 0)),
        e.OutputsAnswer(TYPES, 1 if version == 2 else 0),
        e.InputsAnswer(("INT32",), 255),
        e.StartAnswer(False),
        e.PauseAnswer(True),
        e.Text("careful", "RTDE" if version == 2 else "", e.Level.WARNING),
        e.Data(1 if version == 2 else 0, bytes(56)),
    )
    for version in (1, 2)
}


@pytest.mark.parametrize("version", [1, 2])
def test_what_one_end_says_the_other_hears(version: int) -> None:
    client, controller = client_wire(), controller_wire()
    client.version = controller.version = version
    said = b"".join(client.write(event) for event in REQUESTS[version])
    answered = b"".join(controller.write(event) for event in ANSWERS[version])
    assert tuple(controller.feed(said)) == REQUESTS[version]
    assert tuple(client.feed(answered)) == ANSWERS[version]


@given(st.lists(st.integers(0, 200)), st.sampled_from([1, 2]))
def test_it_does_not_matter_how_the_network_cuts_the_stream(cuts: list[int], version: int) -> None:
    client, controller = client_wire(), controller_wire()
    client.version = controller.version = version
    said = b"".join(client.write(event) for event in REQUESTS[version])
    edges = [0, *sorted(min(cut, len(said)) for cut in cuts), len(said)]
    heard = [event for begin, end in pairwise(edges) for event in controller.feed(said[begin:end])]
    assert tuple(heard) == REQUESTS[version]


def test_bytes_are_those_of_the_guide() -> None:
    client, controller = client_wire(), controller_wire()
    assert client.write(e.RequestVersion(2)) == b"\x00\x05V\x00\x02"
    assert client.write(e.GetController()) == b"\x00\x03v"
    assert client.write(e.SetupOutputs(NAMES)) == b"\x00\x15Otimestamp,actual_q"
    client.version = controller.version = 2
    rate = b"\x40\x7f\x40\0\0\0\0\0"  # 500.0
    assert client.write(e.SetupOutputs(NAMES, 500.0)) == b"\x00\x1dO" + rate + b"timestamp,actual_q"
    assert controller.write(e.OutputsAnswer(TYPES, 1)) == b"\x00\x13O\x01DOUBLE,VECTOR6D"
    assert controller.write(e.Text("hi", "me", 1)) == b"\x00\x0aM\x02hi\x02me\x01"
    controller.version = 1
    assert controller.write(e.OutputsAnswer(TYPES)) == b"\x00\x12ODOUBLE,VECTOR6D"
    assert controller.write(e.Text("hi", "me", 1)) == b"\x00\x06M\x01hi"


def test_an_empty_name_is_no_name() -> None:
    wire = controller_wire()
    (request,) = wire.feed(package(b"O", b"timestamp,actual_q,"))
    assert request == e.SetupOutputs(NAMES)


@pytest.mark.parametrize(
    "data",
    [
        b"\0\0V",  # shorter than its own header
        b"\0\2V",
        b"\0\3x",  # no such type
        b"\0\3V",  # without its version
        b"\0\6V\0\0\2",
        b"\0\4v\0",  # with more than its header
        b"\0\4S\1",
        b"\0\4P\1",
        b"\0\3M",
        b"\0\5M\xffa",  # shorter than its text
        b"\0\7M\1a\1b",  # without a level
        b"\0\3U",
        package(b"O", "tîmestamp".encode()),
        package(b"I", b"\xff\xfe"),
    ],
)
def test_what_no_client_says_is_an_error(data: bytes) -> None:
    with pytest.raises(RtdeError):
        list(controller_wire().feed(data))


def test_a_broken_stream_is_known_from_its_header() -> None:
    with pytest.raises(RtdeError, match="type 0 and 65535 bytes"):
        list(Frames().feed(b"\xff\xff\x00"))


@pytest.mark.parametrize(
    "write",
    [
        lambda wire: wire.write(e.Data(1, bytes(1 << 16))),
        lambda wire: wire.write(e.SetupInputs(("naïve",))),
    ],
)
def test_what_has_no_bytes_is_an_error(write: Callable[[object], bytes]) -> None:
    with pytest.raises(RtdeError):
        write(client_wire())


def test_long_messages_are_cut_to_what_fits() -> None:
    client, controller = client_wire(), controller_wire()
    (heard,) = controller.feed(client.write(e.Text("x" * 300, "y" * 300)))
    assert heard == e.Text("x" * 255, "y" * 255)
