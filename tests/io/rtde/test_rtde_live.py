"""Controllers and clients on real sockets, on loopback."""

from __future__ import annotations

import random
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice

import numpy as np
import pytest
from hostile_packages import mutated, sound_packages
from rtde_arm import Start

from urdyn.errors import InputError, RtdeError
from urdyn.io.rtde import Client, Connected, Dropped, Package, connect, parse_address, play, serve
from urdyn.io.rtde.events import Text
from urdyn.io.rtde.wire import controller_wire
from urdyn.types import Log

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once
NAMES = ("timestamp", "actual_q", "output_int_register_12", "output_double_register_24")


def cycles(client: Client, count: int) -> list[int]:
    """The cycle that each of the next samples is of."""
    return [values["output_int_register_12"] for _, values in islice(client, count)]


def is_every(step: int, of: list[int]) -> bool:
    return bool((np.diff(of) == step).all())


@pytest.fixture(scope="module")
def still() -> Iterator[int]:
    """Port of a controller in this process whose arm stands still."""
    with serve(play(Log(np.arange(2) / 500, {}), loop=True), port=0) as server:
        yield server.port


def test_a_client_gets_every_sample_as_it_was_sent(start: Start) -> None:
    arm = start(port=0)
    with connect(arm.host, arm.port, NAMES) as client:
        assert client.agreement.version == 2 and client.agreement.recipe.names == NAMES
        samples = list(islice(client, 500))
    stamps = [values["timestamp"] for _, values in samples]
    np.testing.assert_allclose(np.diff(stamps), 0.002, atol=1e-9)
    for _, values in samples:
        cycle = values["output_int_register_12"]
        assert values["timestamp"] == cycle / 500 and values["actual_q"][0] == cycle / (1 << 16)
    ages = [received - values["output_double_register_24"] for received, values in samples]
    assert 0 < np.median(ages) < 1e-3


@pytest.mark.parametrize(("frequency", "busy"), [(500, True), (125, False)])
def test_who_stays_awake_sleeps_where_packages_are_seldom(
    start: Start, monkeypatch: pytest.MonkeyPatch, frequency: int, busy: bool
) -> None:
    looks: list[float] = []
    monkeypatch.setattr("os.sched_yield", lambda: looks.append(time.monotonic()))
    arm = start(port=0)
    with connect(arm.host, arm.port, NAMES, frequency, awake=0.004) as client:
        list(islice(client, 100))
    assert len(looks) > 100 if busy else not looks


def test_who_stays_awake_is_let_go_of(start: Start) -> None:
    arm = start(port=0)
    with connect(arm.host, arm.port, NAMES, awake=1.0) as client:
        threading.Timer(0.3, client.close).start()
        assert 50 < len(list(client)) < 1000


@pytest.mark.parametrize(("generation", "frequency", "step"), [("e", 125, 4), ("cb3", None, 1)])
def test_a_client_gets_the_frequency_it_asked_for(
    start: Start, generation: str, frequency: float | None, step: int
) -> None:
    arm = start("", 0, generation)
    with connect(arm.host, arm.port, NAMES, frequency) as client:
        assert client.agreement.period == 1 / 125
        assert is_every(step, cycles(client, 50))


def test_four_arms_at_once(start: Start) -> None:
    arms = [start(f"127.0.0.{k}") for k in (1, 2, 3, 4)]
    clients = [connect(arm.host, names=NAMES) for arm in arms]
    got: dict[str, list[int]] = {}
    threads = [
        threading.Thread(target=lambda c=c: got.update({c.order.host: cycles(c, 500)}))
        for c in clients
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    for client in clients:
        client.close()
    assert len(got) == 4 and all(is_every(1, each) for each in got.values())


def test_a_client_reconnects_and_says_so(start: Start) -> None:
    arm = start(port=0)
    with connect(arm.host, arm.port, NAMES) as client:
        events = client.events()
        assert isinstance(next(events), Connected)
        assert isinstance(next(events), Package)
        arm.kill()
        drop = next(event for event in events if not isinstance(event, Package))
        assert isinstance(drop, Dropped) and arm.host in drop.reason
        start(arm.host, arm.port)
        assert isinstance(next(events), Connected)
        assert isinstance(next(events), Package)


def test_patience_ends(start: Start) -> None:
    arm = start(port=0)
    with connect(arm.host, arm.port, NAMES, patience=0.2) as client:
        arm.kill()
        with pytest.raises(RtdeError, match="no controller answers"):
            list(client)


def test_nobody_there_is_one_clear_error() -> None:
    with pytest.raises(RtdeError, match=r"^127\.0\.0\.9:1: no controller answers") as error:
        connect("127.0.0.9", 1)
    assert error.value.address == "127.0.0.9:1"
    with pytest.raises(RtdeError, match="no controller answers"):
        connect("no.such.robot.invalid")


def test_somebody_silent_is_one_clear_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as mute:
        port = mute.getsockname()[1]
        with pytest.raises(RtdeError, match=rf"^127\.0\.0\.1:{port}: silent for 0\.2 s"):
            connect("127.0.0.1", port, timeout=0.2)


def test_somebody_else_is_one_clear_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:

        def talk() -> None:
            with other.accept()[0] as client:
                client.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
                client.recv(100)

        threading.Thread(target=talk).start()
        with pytest.raises(RtdeError, match=r"no RTDE package has .* speak RTDE at port 30004$"):
            connect("127.0.0.1", other.getsockname()[1])


def test_somebody_who_answers_nothing_but_messages_is_one_clear_error() -> None:
    hello = controller_wire().write(Text("booting"))
    with socket.create_server(("127.0.0.1", 0)) as other:

        def talk() -> None:
            with other.accept()[0] as client, suppress(OSError):
                while True:
                    client.sendall(hello)
                    time.sleep(0.05)

        threading.Thread(target=talk).start()
        with pytest.raises(RtdeError, match=r"answers nothing but messages for 0\.2 s"):
            connect("127.0.0.1", other.getsockname()[1], timeout=0.2)


def test_unknown_names_are_listed(still: int) -> None:
    with pytest.raises(RtdeError, match="does not know actual_z, torque;"):
        connect("127.0.0.1", still, ("timestamp", "actual_z", "torque"))


def test_close_ends_a_client_that_waits(still: int) -> None:
    client = connect("127.0.0.1", still)
    waiting = threading.Thread(target=list, args=(client,))
    waiting.start()
    time.sleep(0.1)
    client.close()
    waiting.join(timeout=60)
    assert not waiting.is_alive()


def test_a_client_that_does_not_read_is_dropped_and_others_miss_nothing() -> None:
    log = Log(np.arange(2000) / 500, {"output_int_register_12": np.arange(2000.0)})
    every = tuple(f"output_double_register_{k}" for k in range(48))
    with (
        serve(play(log, loop=True), port=0) as server,
        connect("127.0.0.1", server.port, NAMES) as client,
        socket.create_connection(("127.0.0.1", server.port)) as glutton,
    ):
        glutton.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        names = ",".join(every).encode()
        glutton.sendall(struct.pack(">HBH", 5, 86, 2))
        glutton.sendall(struct.pack(">HBd", 11 + len(names), 79, 500.0) + names + b"\0\3S")
        glutton.sendall(b"\0\3v" * 100_000)  # each is answered with 19 bytes
        got, deadline = cycles(client, 1500), time.monotonic() + 60
        while len(server.clients) > 1 and time.monotonic() < deadline:
            got += cycles(client, 100)
        assert is_every(1, got)
        assert any("does not read" in reason for reason in server.clients.dropped)
        assert len(server.clients) == 1


def test_five_hundred_hostile_packages_harm_nobody_else(start: Start) -> None:
    rng, sound = random.Random(2), sound_packages()
    arm = start(port=0)
    with connect(arm.host, arm.port, NAMES) as client:
        got: list[int] = []
        reader = threading.Thread(target=lambda: got.extend(cycles(client, 1500)))
        reader.start()
        for _ in range(500):
            with socket.create_connection((arm.host, arm.port), timeout=60) as hostile:
                hostile.sendall(mutated(rng, sound) + rng.randbytes(rng.randrange(4)))
        reader.join(timeout=60)
    assert len(got) == 1500 and is_every(1, got)


def test_a_crowd_of_idle_clients_makes_room(still: int) -> None:
    with connect("127.0.0.1", still) as client:
        crowd = [socket.create_connection(("127.0.0.1", still)) for _ in range(100)]
        with connect("127.0.0.1", still) as late:
            assert len(list(islice(late, 5))) == len(list(islice(client, 5))) == 5
        for idle in crowd:
            idle.close()


def test_a_played_log_comes_back_as_it_was_and_ends() -> None:
    n = 200
    rng = np.random.default_rng(3)
    mode = np.where(np.arange(n) < 100, 7.0, np.nan)  # not measured later
    channels = {"actual_q": rng.normal(size=(n, 6)), "robot_mode": mode, "Unknown": np.zeros(n)}
    log = Log(10 + np.arange(n) / 500, channels)

    def later() -> Iterator[object]:
        while not ready.is_set():
            yield {"timestamp": 0.0}
        yield from play(log)

    ready = threading.Event()
    with (
        serve(later(), port=0) as server,  # type: ignore[arg-type]
        connect("127.0.0.1", server.port, ("timestamp", "actual_q", "robot_mode"), patience=0) as c,
    ):
        ready.set()
        with pytest.raises(RtdeError):
            for _, values in c:
                if values["timestamp"]:
                    row = round((values["timestamp"] - 10) * 500)
                    np.testing.assert_array_equal(values["actual_q"], channels["actual_q"][row])
                    assert values["robot_mode"] == 7  # in place of NaN, that of an arm that is well
        assert row == n - 1 and server.join(60)


def test_a_loop_goes_on_in_time() -> None:
    log = Log(np.array([1.0, 1.002, 1.004]), {})
    stamps = [sample["timestamp"] for sample in islice(play(log, loop=True), 9)]
    np.testing.assert_allclose(np.diff(stamps), 0.002, atol=1e-12)


def test_an_unsound_source_is_the_servers_error() -> None:
    with (
        serve(iter([{"timestamp": 0.0, "robot_mode": "on"}] * 1000), port=0) as server,
        pytest.raises(RtdeError),
        connect("127.0.0.1", server.port, ("robot_mode",), patience=0),
    ):
        server.join(60)


def test_a_port_in_use_says_so(still: int) -> None:
    with pytest.raises(RtdeError, match=rf"127\.0\.0\.1:{still}: cannot listen"):
        serve(iter(()), port=still)


def test_addresses_are_read() -> None:
    assert parse_address("rtde://10.0.0.7:30014") == ("10.0.0.7", 30014)
    assert parse_address("robot.local") == ("robot.local", 30004)
    assert parse_address("rtde://[fe80::7]/") == ("fe80::7", 30004)
    for wrong in ("", "rtde://", "robot:", "robot:0", "robot:99999", "robot:rtde"):
        with pytest.raises(InputError):
            parse_address(wrong)
