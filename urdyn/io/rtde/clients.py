"""All clients of a server: the socket that accepts them, and what becomes of each."""

from __future__ import annotations

import selectors
import socket
import time
from collections import deque

from urdyn.errors import RtdeError
from urdyn.io.address import door, joined
from urdyn.io.rtde.connection import Connection
from urdyn.io.rtde.controller import Controller
from urdyn.io.rtde.recipe import Values

MOST = 64  # clients at once; beyond that an idle one makes room
KEPT = 100  # reasons why clients were dropped


class Clients:
    """Sockets, looked after in turns by the one thread that calls."""

    def __init__(self, controller: Controller, host: str, port: int) -> None:
        self.controller = controller
        self.dropped: deque[str] = deque(maxlen=KEPT)  # address and reason
        self._connections: list[Connection] = []
        self._selector = selectors.SelectSelector()  # the only one that waits for microseconds
        self._door = _listen(host, port)
        self._selector.register(self._door, selectors.EVENT_READ)

    def __len__(self) -> int:
        return len(self._connections)

    @property
    def port(self) -> int:
        """Where we listen."""
        return int(self._door.getsockname()[1])

    def attend(self, deadline: float) -> None:
        """Answer clients until the deadline, and once where it has passed."""
        while True:
            left = max(deadline - time.monotonic(), 0.0)
            for key, mask in self._selector.select(left):
                if key.data is None:
                    self._admit()
                elif key.data in self._connections:  # or it made room in this very turn
                    self._turn(key.data, mask)
            if time.monotonic() >= deadline:
                return

    def publish(self, state: Values) -> None:
        """Send every client what is due to it in this control cycle."""
        for connection in [*self._connections]:
            connection.publish(state)
            self._settle(connection)

    def close(self) -> None:
        """End all connections and free the port."""
        for connection in [*self._connections]:
            self._drop(connection, "the server closes")
        self._door.close()
        self._selector.close()

    def _turn(self, connection: Connection, mask: int) -> None:
        if mask & selectors.EVENT_READ:
            connection.read()
        else:
            connection.flush()
        self._settle(connection)

    def _settle(self, connection: Connection) -> None:
        """Close a connection that is over; else wait for what it lets us do."""
        if connection.over:
            self._drop(connection, connection.over)
            return
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if connection.behind else 0)
        if self._selector.get_key(connection.sock).events != events:
            self._selector.modify(connection.sock, events, connection)

    def _admit(self) -> None:
        try:
            sock, (host, port, *_) = self._door.accept()
        except OSError:  # the client left before it was accepted
            return
        if len(self) >= MOST and not self._make_room():
            sock.close()
            return
        connection = Connection(sock, joined(host, port), self.controller)
        self._connections.append(connection)
        self._selector.register(sock, selectors.EVENT_READ, connection)

    def _make_room(self) -> bool:
        """Drop the client that has been idle for longest; is there one?"""
        for connection in self._connections:
            if not connection.session.streaming:
                self._drop(connection, "makes room for another")
                return True
        return False

    def _drop(self, connection: Connection, reason: str) -> None:
        self.dropped.append(f"{connection.address} {reason}")
        self._selector.unregister(connection.sock)
        self._connections.remove(connection)
        connection.close()


def _listen(host: str, port: int) -> socket.socket:
    """A socket that clients can connect to."""
    try:
        opened = door(host, port, MOST)
    except (OSError, OverflowError, UnicodeError) as error:
        told = getattr(error, "strerror", None) or error
        raise RtdeError(f"cannot listen: {told}; is it in use?", joined(host, port)) from error
    opened.setblocking(False)
    return opened
