"""A controller's side of the protocol, and both sides joined, without a network."""

from __future__ import annotations

import random
import struct

import pytest
from hostile_packages import mutated, sound_packages

from urdyn.errors import RtdeError
from urdyn.io.rtde import events as e
from urdyn.io.rtde.controller import RELEASES, Controller, Generation
from urdyn.io.rtde.fields import IN_USE, NOT_FOUND
from urdyn.io.rtde.frames import Frames, package
from urdyn.io.rtde.handshake import Agreement, handshake
from urdyn.io.rtde.session import INPUT_RECIPES, Session
from urdyn.io.rtde.wire import client_wire

NAMES = ("timestamp", "actual_q")
SAMPLE = {"timestamp": 2.5, "actual_q": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)}


class Caller:
    """A client of a session: events in, events out."""

    def __init__(self, session: Session, version: int = 2) -> None:
        self.session, self.wire = session, client_wire()
        if version == 2:
            assert self.ask(e.RequestVersion(2)) == [e.VersionAnswer(True)]
            self.wire.version = 2

    def ask(self, event: e.Request) -> list[e.Answer]:
        return list(self.wire.feed(self.session.receive(self.wire.write(event))))

    def cycles(self, count: int) -> list[e.Answer]:
        return [
            event
            for _ in range(count)
            for event in self.wire.feed(self.session.publish(self.session.controller.state(SAMPLE)))
        ]


@pytest.fixture
def caller() -> Caller:
    return Caller(Session(Controller()))


def test_protocols_other_than_1_and_2_are_refused(caller: Caller) -> None:
    for version in (0, 3, 255, 65535):
        assert caller.ask(e.RequestVersion(version)) == [e.VersionAnswer(False)]
    assert caller.ask(e.RequestVersion(1)) == [e.VersionAnswer(True)]


@pytest.mark.parametrize(
    ("generation", "major", "rate"), [("cb3", 3, 125), ("e", 5, 500), ("x", 10, 500)]
)
def test_a_generation_has_its_release_and_rate(
    generation: Generation, major: int, rate: float
) -> None:
    controller = Controller(RELEASES[generation])
    (answer,) = Caller(Session(controller)).ask(e.GetController())
    assert isinstance(answer, e.ControllerAnswer) and answer.release[0] == major
    assert controller.rate == rate


def test_outputs_come_as_asked_for(caller: Caller) -> None:
    assert caller.ask(e.SetupOutputs(NAMES, 500.0)) == [
        e.OutputsAnswer(("DOUBLE", "VECTOR6D"), recipe=1)
    ]
    assert caller.cycles(3) == []  # not started
    assert caller.ask(e.Start()) == [e.StartAnswer(True)]
    data = e.Data(1, struct.pack(">7d", 2.5, 1, 2, 3, 4, 5, 6))
    assert caller.cycles(3) == [data] * 3
    assert caller.ask(e.Pause()) == [e.PauseAnswer(True)]
    assert caller.cycles(3) == []


def test_protocol_1_has_neither_frequency_nor_recipe_id() -> None:
    caller = Caller(Session(Controller()), version=1)
    assert caller.ask(e.SetupOutputs(NAMES)) == [e.OutputsAnswer(("DOUBLE", "VECTOR6D"))]
    assert caller.ask(e.Start()) == [e.StartAnswer(True)]
    assert caller.cycles(1) == [e.Data(0, struct.pack(">7d", 2.5, 1, 2, 3, 4, 5, 6))]


@pytest.mark.parametrize(
    ("frequency", "every"),
    [(500.0, 1), (250.0, 2), (125.0, 4), (300.0, 1), (126.0, 3), (1.0, 500), (1e9, 1), (0.1, 500)],
)
def test_a_package_comes_every_floor_of_rate_over_frequency_cycles(
    caller: Caller, frequency: float, every: int
) -> None:
    caller.ask(e.SetupOutputs(NAMES, frequency))
    caller.ask(e.Start())
    assert len(caller.cycles(3 * every)) == 3


@pytest.mark.parametrize("frequency", [0.0, -1.0, float("nan"), float("inf")])
def test_a_frequency_that_is_none_is_refused(caller: Caller, frequency: float) -> None:
    (answer,) = caller.ask(e.SetupOutputs(NAMES, frequency))
    assert isinstance(answer, e.OutputsAnswer) and answer.recipe == 0
    assert caller.ask(e.Start()) == [e.StartAnswer(False)]


def test_an_unknown_name_makes_the_recipe_void(caller: Caller) -> None:
    assert caller.ask(e.SetupOutputs(("actual_q", "actual_z"), 500.0)) == [
        e.OutputsAnswer(("VECTOR6D", NOT_FOUND), recipe=0)
    ]
    assert caller.ask(e.Start()) == [e.StartAnswer(False)]


def test_a_new_output_recipe_takes_the_place_of_the_old(caller: Caller) -> None:
    caller.ask(e.SetupOutputs(NAMES, 500.0))
    caller.ask(e.Start())
    caller.ask(e.SetupOutputs(("timestamp",), 500.0))
    assert caller.cycles(1) == [e.Data(1, struct.pack(">d", 2.5))]


def test_a_trailing_comma_names_nothing(caller: Caller) -> None:
    sent = package(b"O", struct.pack(">d", 500.0) + b"timestamp,actual_q,")
    assert caller.session.receive(sent) == package(b"O", b"\x01DOUBLE,VECTOR6D")


def test_what_a_source_leaves_out_is_that_of_an_arm_that_is_well(caller: Caller) -> None:
    caller.ask(e.SetupOutputs(("robot_mode", "safety_mode", "runtime_state", "payload"), 500.0))
    caller.ask(e.Start())
    assert caller.cycles(1) == [e.Data(1, struct.pack(">iiId", 7, 1, 2, 0.0))]


def test_an_input_has_one_owner_at_a_time() -> None:
    controller = Controller()
    first, second = Caller(Session(controller)), Caller(Session(controller))
    setup = e.SetupInputs(("input_int_register_24", "input_double_register_24"))
    assert first.ask(setup) == [e.InputsAnswer(("INT32", "DOUBLE"), 1)]
    assert first.ask(setup) == [e.InputsAnswer(("INT32", "DOUBLE"), 2)]  # its own
    assert second.ask(e.SetupInputs(("input_int_register_24", "nothing"))) == [
        e.InputsAnswer((IN_USE, NOT_FOUND), 0)
    ]
    first.session.close()
    assert second.ask(setup) == [e.InputsAnswer(("INT32", "DOUBLE"), 1)]


def test_inputs_are_taken_and_read_back(caller: Caller) -> None:
    names = ("input_int_register_24", "speed_slider_fraction")
    caller.ask(e.SetupInputs(names))
    caller.ask(e.SetupOutputs(("input_int_register_24",), 500.0))
    caller.ask(e.Start())
    assert caller.ask(e.Data(1, struct.pack(">id", -7, 0.5))) == []
    assert caller.session.controller.values.items() >= {names[0]: -7, names[1]: 0.5}.items()
    assert caller.cycles(1) == [e.Data(1, struct.pack(">i", -7))]


def test_inputs_have_their_effect(caller: Caller) -> None:
    caller.ask(e.SetupInputs(("standard_digital_output_mask", "standard_digital_output")))
    caller.ask(e.SetupInputs(("tool_digital_output_mask", "tool_digital_output")))
    caller.ask(e.SetupInputs(("speed_slider_mask", "speed_slider_fraction")))
    caller.ask(e.SetupOutputs(("actual_digital_output_bits", "target_speed_fraction"), 500.0))
    caller.ask(e.Start())
    caller.ask(e.Data(1, b"\x0c\xff"))  # bits 2 and 3 on
    caller.ask(e.Data(1, b"\x04\x00"))  # bit 2 off
    caller.ask(e.Data(2, b"\x01\x01"))
    caller.ask(e.Data(3, struct.pack(">Id", 1, 0.25)))
    assert caller.cycles(1) == [e.Data(1, struct.pack(">Qd", 0x10008, 0.25))]


@pytest.mark.parametrize("data", [e.Data(2, bytes(4)), e.Data(0, b""), e.Data(1, bytes(5))])
def test_input_packages_of_no_recipe_end_the_session(caller: Caller, data: e.Data) -> None:
    caller.ask(e.SetupInputs(("input_int_register_24",)))
    (answer,) = caller.ask(data)
    assert isinstance(answer, e.Text) and answer.level == e.Level.EXCEPTION
    assert isinstance(caller.session.broken, RtdeError)


def test_there_are_255_input_recipes(caller: Caller) -> None:
    setup = e.SetupInputs(("input_bit_register_64",))
    ids = [answer.recipe for _ in range(INPUT_RECIPES + 1) for answer in caller.ask(setup)]  # type: ignore[union-attr]
    assert ids == [*range(1, INPUT_RECIPES + 1), 0]


def test_messages_are_heard(caller: Caller) -> None:
    text = e.Text("gripper lost", "cell 4", e.Level.ERROR)
    assert caller.ask(text) == []
    assert caller.session.controller.messages == [text]


def test_answers_to_what_came_before_a_mistake_are_given(caller: Caller) -> None:
    answers = list(caller.wire.feed(caller.session.receive(b"\0\3v" + b"\0\3!" + b"\0\3v")))
    assert [type(answer) for answer in answers] == [e.ControllerAnswer, e.Text]


def joined(session: Session, *names: str, optional: tuple[str, ...] = ()) -> Agreement:
    """Both sides of a set-up, one byte at a time each way."""
    wire, talk = client_wire(), handshake(names, optional, 125.0)
    ask, version = next(talk)
    while True:
        wire.version = version
        answers = b"".join(session.receive(bytes([byte])) for byte in wire.write(ask))
        (answer,) = [event for byte in answers for event in wire.feed(bytes([byte]))]
        try:
            ask, version = talk.send(answer)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]


@pytest.mark.parametrize("generation", ["cb3", "e", "x"])
def test_two_wires_agree_one_byte_at_a_time(generation: Generation) -> None:
    session = Session(Controller(RELEASES[generation]))
    agreement = joined(session, *NAMES, "payload")
    assert agreement.version == 2 and agreement.release == RELEASES[generation]
    assert agreement.period == 1 / 125 and agreement.recipe == session.output
    assert agreement.left_out == ()


def test_optional_names_are_left_out_and_others_are_listed() -> None:
    session = Session(Controller((5, 3, 0, 0)))
    agreement = joined(
        session, *NAMES, "payload", "payload_cog", optional=("payload", "payload_cog")
    )
    assert agreement.left_out == ("payload", "payload_cog") and agreement.recipe.names == NAMES
    with pytest.raises(RtdeError, match="does not know actual_z, actual_y;"):
        joined(session, *NAMES, "actual_z", "actual_y")


def test_a_client_takes_protocol_1_where_2_is_refused() -> None:
    talk = handshake(NAMES, (), 125.0)
    assert next(talk) == (e.RequestVersion(2), 1)
    assert talk.send(e.VersionAnswer(False)) == (e.RequestVersion(1), 1)
    assert talk.send(e.VersionAnswer(True)) == (e.GetController(), 1)
    assert talk.send(e.ControllerAnswer((3, 4, 0, 0))) == (e.SetupOutputs(NAMES), 1)
    assert talk.send(e.OutputsAnswer(("DOUBLE", "VECTOR6D"))) == (e.Start(), 1)
    with pytest.raises(StopIteration) as end:
        talk.send(e.StartAnswer(True))
    assert end.value.value.period == 1 / 125


@pytest.mark.parametrize(
    "answers",
    [
        [e.StartAnswer(True)],
        [e.VersionAnswer(False), e.VersionAnswer(False)],
        [e.VersionAnswer(True), e.ControllerAnswer((5, 0, 0, 0)), e.OutputsAnswer(("DOUBLE",), 1)],
        [e.VersionAnswer(True), e.ControllerAnswer((5, 0, 0, 0)), e.OutputsAnswer(("X", "Y"), 1)],
        [
            e.VersionAnswer(True),
            e.ControllerAnswer((5, 0, 0, 0)),
            e.OutputsAnswer(("DOUBLE", "VECTOR6D"), 1),
            e.StartAnswer(False),
        ],
    ],
)
def test_a_controller_that_does_not_agree_is_an_error(answers: list[e.Answer]) -> None:
    talk = handshake(NAMES, (), 125.0)
    next(talk)
    with pytest.raises(RtdeError):
        for answer in answers:
            talk.send(answer)


def test_twenty_thousand_hostile_packages_end_their_own_session_only() -> None:
    rng, sound, controller = random.Random(1), sound_packages(), Controller()
    bystander = Caller(Session(controller))
    bystander.ask(e.SetupOutputs(NAMES, 500.0))
    bystander.ask(e.Start())
    data = e.Data(1, struct.pack(">7d", 2.5, 1, 2, 3, 4, 5, 6))
    session, broken = Session(controller), 0
    for _ in range(20_000):
        answers = session.receive(mutated(rng, sound))
        answers += session.publish(controller.state(SAMPLE))
        assert len(list(Frames().feed(answers))) < 100  # whole packages, all of them
        assert bystander.cycles(1) == [data]
        if session.broken or rng.random() < 0.01:
            broken += session.broken is not None
            session.close()
            session = Session(controller)
    assert broken > 1000


def test_a_list_too_long_to_answer_ends_the_session(caller: Caller) -> None:
    caller.session.receive(package(b"I", b"a," * 32000))
    assert caller.session.broken is not None


def test_the_flow_of_urs_own_python_client(caller: Caller) -> None:
    """Bytes as its `rtde` module packs them: connect, version, set-ups, start, receive, send."""
    session = Session(Controller())
    assert session.receive(struct.pack(">HBH", 5, 86, 2)) == struct.pack(">HBB", 4, 86, 1)
    release = struct.unpack(">IIII", session.receive(struct.pack(">HB", 3, 118))[3:])
    assert release == RELEASES["e"]
    names = b"timestamp,target_q,actual_q,actual_digital_input_bits,joint_mode,runtime_state"
    asked = struct.pack(">HBd", 11 + len(names), 79, 125.0) + names
    answer = session.receive(asked)
    size, kind, recipe = struct.unpack_from(">HBB", answer)
    assert (size, kind, recipe) == (len(answer), 79, 1)
    assert answer[4:] == b"DOUBLE,VECTOR6D,VECTOR6D,UINT64,VECTOR6INT32,UINT32"
    inputs = b"input_int_register_0,input_double_register_0"
    answer = session.receive(struct.pack(">HB", 3 + len(inputs), 73) + inputs)
    assert answer == struct.pack(">HBB", 16, 73, 1) + b"INT32,DOUBLE"
    assert session.receive(struct.pack(">HB", 3, 83)) == struct.pack(">HBB", 4, 83, 1)
    assert session.receive(struct.pack(">HBBid", 16, 85, 1, 42, 0.5)) == b""
    sent = session.publish(session.controller.state(SAMPLE))
    values = struct.unpack(">HBB" + "d" * 13 + "Q" + "i" * 6 + "I", sent)
    assert values[:3] == (len(sent), 85, 1) and values[3] == 2.5 and values[-2] == 253
    message = struct.pack(">B5sB13sB", 5, b"hello", 13, b"Python Client", 3)
    assert session.receive(struct.pack(">HB", 3 + len(message), 77) + message) == b""
    assert session.receive(struct.pack(">HB", 3, 80)) == struct.pack(">HBB", 4, 80, 1)
    assert session.broken is None and session.controller.values["input_int_register_0"] == 42
