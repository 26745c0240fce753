"""One client of a server: its socket, its session, and the bytes that it has not taken yet."""

from __future__ import annotations

import socket
from contextlib import suppress

from urdyn.io.rtde.controller import Controller
from urdyn.io.rtde.recipe import Values
from urdyn.io.rtde.session import Session

CHUNK = 1024  # [bytes] read at once: a client that floods the server takes turns with others
KERNEL = 1 << 18  # [bytes] that the kernel holds for a client
BACKLOG = 1 << 20  # [bytes] that we hold besides; 2 s of every variable at 500 Hz


class Connection:
    """A client; `over` says why it is to be closed, "" while it is not."""

    def __init__(self, sock: socket.socket, address: str, controller: Controller) -> None:
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL)
        self.sock, self.address = sock, address
        self.session = Session(controller)
        self.over = ""
        self._waiting = bytearray()

    @property
    def behind(self) -> bool:
        """Has the client still to read what we sent?"""
        return bool(self._waiting)

    def read(self) -> None:
        """Take what the client sent, and answer."""
        try:
            data = self.sock.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            self.over = f"lost: {error.strerror}"
            return
        self._send(self.session.receive(data))
        if self.session.broken:
            self.over = f"broke the protocol: {self.session.broken}"
        elif not data:
            self.over = "has gone"

    def publish(self, state: Values) -> None:
        """Send the data that are due in this control cycle."""
        self._send(self.session.publish(state))

    def flush(self) -> None:
        """Hand over what the client had no room for."""
        try:
            del self._waiting[: self.sock.send(self._waiting)]
        except BlockingIOError:
            return
        except OSError as error:
            self.over = self.over or f"lost: {error.strerror}"

    def close(self) -> None:
        """End the connection; the inputs that it set are free again."""
        self.session.close()
        with suppress(OSError):
            self.sock.close()

    def _send(self, data: bytes) -> None:
        self._waiting += data
        if self._waiting:
            self.flush()
        if len(self._waiting) > BACKLOG:
            self.over = self.over or "does not read"
