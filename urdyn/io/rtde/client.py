"""An RTDE client: every package of a controller, and what became of the connection."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from threading import Event as Flag
from typing import Any

from urdyn.errors import InputError, RtdeError
from urdyn.io.address import host_and_port
from urdyn.io.rtde.events import Text
from urdyn.io.rtde.handshake import Agreement
from urdyn.io.rtde.link import Link, Order, Package, TornPackageError
from urdyn.io.rtde.recipe import DEFAULT, OPTIONAL
from urdyn.io.rtde.server import PORT

BACK_OFF = (0.05, 2.0)  # [s] before the first attempt to reconnect, and at most


@dataclass(frozen=True)
class Connected:
    """The controller sends from here on: the first event, and the first after each drop."""

    agreement: Agreement


@dataclass(frozen=True)
class Dropped:
    """The connection is lost; the next event is `Connected`."""

    received: float  # [s] on this computer's monotonic clock, when that was noticed
    reason: str
    torn: bool = False  # a package did not have the length that was agreed


Event = Connected | Package | Text | Dropped


def connect(
    host: str,
    port: int = PORT,
    names: Collection[str] = DEFAULT,
    frequency: float | None = None,
    *,
    optional: Collection[str] = OPTIONAL,
    timeout: float = 5.0,
    awake: float = 0.0,
    patience: float = float("inf"),
) -> Client:
    """A client whose controller sends `names` at `frequency` [Hz]; RtdeError if that fails.

    None is the controller's full rate. `optional` names are left out where it does not know them.
    For packages without delay, the client polls up to `awake` [s] for the next, if they come that
    often, and keeps a processor busy. After a drop it reconnects, for up to `patience` [s].
    """
    order = Order(host, port, tuple(names), tuple(optional), frequency, timeout, awake)
    return Client(order, patience)


def parse_address(text: str) -> tuple[str, int]:
    """Host and port of HOST, HOST:PORT or rtde://HOST:PORT; an IPv6 host stands in brackets."""
    host, port = host_and_port(text.removeprefix("rtde://").rstrip("/")) or ("", 0)
    if not host or port == 0:
        raise InputError(f"{text!r} is no address; write HOST, HOST:PORT or rtde://HOST:PORT")
    return host, PORT if port is None else port


class Client:
    """A controller that sends to us; close() ends it, from any thread."""

    def __init__(self, order: Order, patience: float) -> None:
        self.order, self.patience = order, patience
        self._closed = Flag()
        self._link = Link(order)

    @property
    def agreement(self) -> Agreement:
        """Recipe, protocol and release, as agreed last."""
        return self._link.agreement

    @property
    def unread(self) -> bool:
        """Whether anything has come that nobody has read."""
        return self._link.unread

    def __iter__(self) -> Iterator[tuple[float, dict[str, Any]]]:
        """When each package came [s, monotonic], and RTDE name -> value of it."""
        for event in self.events():
            if isinstance(event, Package):
                yield event.received, self.agreement.recipe.unpack(event.values)

    def events(self) -> Iterator[Event]:
        """All that happens, until closed; RtdeError once a drop has lasted beyond `patience`."""
        while not self._closed.is_set():
            yield Connected(self.agreement)
            try:
                yield from self._link.packages()
            except RtdeError as error:
                self._link.close()
                if self._closed.is_set():
                    return
                torn = isinstance(error, TornPackageError)
                yield Dropped(time.monotonic(), str(error), torn)
                self._reconnect(error)

    def close(self) -> None:
        """End the connection, and the iterators over it."""
        self._closed.set()
        self._link.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def _reconnect(self, lost: RtdeError) -> None:
        """Try again, after ever longer pauses."""
        pause, longest = BACK_OFF
        end = time.monotonic() + self.patience
        while not self._closed.wait(pause):
            try:
                self._link = Link(self.order)
            except RtdeError as error:
                if time.monotonic() > end:
                    raise error from lost
                pause = min(2 * pause, longest)
            else:
                break
        if self._closed.is_set():  # while we connected
            self._link.close()
