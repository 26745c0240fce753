"""One connection to a controller: dialled, agreed on, and read until it is lost."""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from urdyn.errors import RtdeError
from urdyn.io.address import joined
from urdyn.io.rtde.events import Answer, Data, Request, Text
from urdyn.io.rtde.handshake import Agreement, handshake
from urdyn.io.rtde.wire import client_wire

CHUNK = 1 << 16  # [bytes] read at once
CHECK = "is the robot on, in reach of this computer, and its RTDE service enabled?"


@dataclass(frozen=True)
class Order:
    """What a client wants, and from which controller."""

    host: str
    port: int
    names: tuple[str, ...]  # RTDE names of outputs
    optional: tuple[str, ...] = ()  # left out where the controller does not know them
    frequency: float | None = None  # [Hz]; None: all that the controller has
    timeout: float = 5.0  # [s] without an answer, or without data
    awake: float = 0.0  # [s] of polling for the next package, if that is due by then

    @property
    def address(self) -> str:
        """host:port."""
        return joined(self.host, self.port)


@dataclass(frozen=True)
class Package:
    """One data package, as it came."""

    received: float  # [s] on this computer's monotonic clock
    values: bytes  # as the recipe lays them out


class TornPackageError(RtdeError):
    """A data package that does not have the length of its recipe."""


class Link:
    """A controller that sends; RtdeError, with the address, once it does not."""

    def __init__(self, order: Order) -> None:
        self.order = order
        self._wire = client_wire()
        self._sock = _dial(order)
        self._arriving = select.poll()
        self._arriving.register(self._sock, select.POLLIN)
        self._awake = 0.0
        self._heard = self._listen()
        try:
            self.agreement = self._agree()
        except RtdeError:
            self.close()
            raise
        if self.agreement.period <= order.awake:
            self._awake = order.awake

    def packages(self) -> Iterator[Package | Text]:
        """Data packages and messages; ends in RtdeError."""
        with _of(self.order.address):
            for received, event in self._heard:
                if isinstance(event, Data):
                    yield Package(received, self._whole(event))
                elif isinstance(event, Text):
                    yield event

    @property
    def unread(self) -> bool:
        """Whether anything has come that nobody has read; of a connection that has ended, no."""
        with suppress(OSError, ValueError):
            return bool(select.select([self._sock], [], [], 0.0)[0])
        return False

    def close(self) -> None:
        """End the connection; nothing waits for data any longer."""
        with suppress(OSError):
            self._sock.shutdown(socket.SHUT_RDWR)
        self._sock.close()

    def _agree(self) -> Agreement:
        order = self.order
        talk = handshake(order.names, order.optional, order.frequency)
        with _of(order.address):
            ask, version = next(talk)
            while True:
                self._send(ask, version)
                answer = self._answer()
                try:
                    ask, version = talk.send(answer)
                except StopIteration as end:
                    agreement: Agreement = end.value
                    return agreement

    def _send(self, ask: Request, version: int) -> None:
        self._wire.version = version
        try:
            self._sock.sendall(self._wire.write(ask))
        except OSError as error:
            raise RtdeError(f"the connection is lost: {error.strerror}") from error

    def _answer(self) -> Answer:
        """The next event that is not a message."""
        asked, patience = time.monotonic(), self.order.timeout
        while True:
            received, event = next(self._heard)
            if not isinstance(event, Text):
                return event
            if received - asked > patience:
                raise RtdeError(f"answers nothing but messages for {patience:g} s; {CHECK}")

    def _listen(self) -> Iterator[tuple[float, Answer]]:
        """When each event came, and the event, without end."""
        while data := self._receive():
            now = time.monotonic()
            for event in self._wire.feed(data):
                yield now, event
        raise RtdeError("the controller has closed the connection")

    def _receive(self) -> bytes:
        self._watch()
        try:
            return self._sock.recv(CHUNK)
        except TimeoutError as error:
            raise RtdeError(f"silent for {self.order.timeout:g} s; {CHECK}") from error
        except OSError as error:
            raise RtdeError(f"the connection is lost: {error.strerror}") from error

    def _watch(self) -> None:
        """Poll for a while: a processor that went to sleep is slow to wake."""
        end = time.monotonic() + self._awake
        while time.monotonic() < end and not self._arriving.poll(0):
            os.sched_yield()  # others with work go first

    def _whole(self, data: Data) -> bytes:
        recipe = self.agreement.recipe
        if len(data.values) != recipe.size or data.recipe != recipe.id:
            told = f"{len(data.values)} bytes of recipe {data.recipe}"
            raise TornPackageError(f"{told} where {recipe.size} of {recipe.id} were agreed")
        return data.values


def _dial(order: Order) -> socket.socket:
    try:
        sock = socket.create_connection((order.host, order.port), order.timeout)
    except OSError as error:
        told = error.strerror or str(error)
        raise RtdeError(f"no controller answers ({told}); {CHECK}", order.address) from error
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return sock


@contextmanager
def _of(address: str) -> Iterator[None]:
    """RtdeErrors in this block get the controller's `address`."""
    try:
        yield
    except RtdeError as error:
        raise type(error)(str(error), address) from error
