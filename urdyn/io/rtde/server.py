"""An RTDE controller on a real socket: plays samples to any number of clients, in real time.

One thread does everything, so there is nothing to lock and nobody to wait for: it looks after the
sockets until the next deadline, then sends a sample. Deadlines are absolute: what one cycle is
late, the next makes good.
"""

from __future__ import annotations

import selectors
import socket
import threading
import time
from collections import deque
from collections.abc import Iterable
from types import TracebackType

from urdyn.errors import RtdeError, UrdynError
from urdyn.io.rtde.connection import Connection
from urdyn.io.rtde.controller import RELEASES, Controller, Generation
from urdyn.io.rtde.recipe import Values

PORT = 30004
CLIENTS = 64  # at once; beyond that an idle one makes room
HOPELESS = 1.0  # [s] behind: the machine slept, and there is no making good
KEPT = 1 << 16  # lateness of so many cycles is remembered


def serve(
    source: Iterable[Values],
    host: str = "127.0.0.1",
    port: int = PORT,
    generation: Generation = "e",
) -> Server:
    """A controller that sends one sample of `source` every control cycle, until it has no more.

    Its samples name outputs as RTDE does, `timestamp` [s] among them; what they leave out is what
    clients set, else 0. Loopback unless `host` says otherwise; port 0 takes a free one.
    """
    return Server(source, host, port, Controller(RELEASES[generation]))


class Server:
    """A controller that serves in a thread of its own, until closed or out of samples."""

    def __init__(
        self, source: Iterable[Values], host: str, port: int, controller: Controller
    ) -> None:
        self.controller = controller
        self.host, self.port = host, port
        self.dropped: deque[str] = deque(maxlen=100)  # who was, and why
        self.lateness: deque[float] = deque(maxlen=KEPT)  # [s] of cycles after their deadline
        self._connections: list[Connection] = []
        self._selector = selectors.SelectSelector()  # of all, the one that waits for microseconds
        self._listener = _listen(host, port)
        self.port = self._listener.getsockname()[1]
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._stop, self._failure = False, None  # type: bool, UrdynError | None
        self._thread = threading.Thread(target=self._run, args=(source,), daemon=True)
        self._thread.start()

    @property
    def clients(self) -> int:
        """Number of connections."""
        return len(self._connections)

    def join(self, timeout: float | None = None) -> bool:
        """Wait until the source has no more samples; has it? RtdeError where it was unsound."""
        self._thread.join(timeout)
        if self._failure:
            raise self._failure
        return not self._thread.is_alive()

    def close(self) -> None:
        """End all connections and free the port."""
        self._stop = True
        self._thread.join()

    def __enter__(self) -> Server:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _run(self, source: Iterable[Values]) -> None:
        try:
            self._play(source)
        except UrdynError as error:  # of the source; a client's mistakes end at its connection
            self._failure = error
        finally:
            for connection in [*self._connections]:
                self._drop(connection, "the server closes")
            self._listener.close()
            self._selector.close()

    def _play(self, source: Iterable[Values]) -> None:
        """One sample a control cycle."""
        period = 1.0 / self.controller.rate
        deadline = time.monotonic()
        for sample in source:
            deadline += period
            self._attend(deadline)
            if self._stop:
                return
            late = time.monotonic() - deadline
            self.lateness.append(late)
            deadline += late if late > HOPELESS else 0.0
            self._publish(self.controller.state(sample))

    def _attend(self, deadline: float) -> None:
        """Look after the sockets until the deadline, and once where it has passed."""
        while True:
            left = max(deadline - time.monotonic(), 0.0)
            for key, mask in self._selector.select(left):
                if key.data is None:
                    self._accept()
                elif mask & selectors.EVENT_READ:
                    key.data.read()
                else:
                    key.data.flush()
                self._settle(key.data)
            if time.monotonic() >= deadline:
                return

    def _publish(self, state: Values) -> None:
        for connection in [*self._connections]:
            connection.publish(state)
            self._settle(connection)

    def _settle(self, connection: Connection | None) -> None:
        """Close a connection that is over; else wait for what it lets us do."""
        if connection is None:
            return
        if connection.over:
            self._drop(connection, connection.over)
            return
        wanted = selectors.EVENT_WRITE if connection.behind else 0
        key = self._selector.get_key(connection.sock)
        if key.events != selectors.EVENT_READ | wanted:
            self._selector.modify(connection.sock, selectors.EVENT_READ | wanted, connection)

    def _accept(self) -> None:
        try:
            sock, (host, port, *_) = self._listener.accept()
        except OSError:  # it went before we came
            return
        if len(self._connections) >= CLIENTS:
            idle = (c for c in self._connections if not c.session.streaming)
            self._drop(next(idle, self._connections[0]), "makes room for another")
        connection = Connection(sock, f"{host}:{port}", self.controller)
        self._connections.append(connection)
        self._selector.register(sock, selectors.EVENT_READ, connection)

    def _drop(self, connection: Connection, reason: str) -> None:
        self.dropped.append(f"{connection.address} {reason}")
        self._selector.unregister(connection.sock)
        self._connections.remove(connection)
        connection.close()


def _listen(host: str, port: int) -> socket.socket:
    """A socket that clients can connect to."""
    try:
        listener = socket.create_server((host, port), backlog=CLIENTS)
    except (OSError, OverflowError) as error:
        told = getattr(error, "strerror", None) or error
        raise RtdeError(f"cannot listen: {told}; is it in use?", f"{host}:{port}") from error
    listener.setblocking(False)
    return listener
