"""An RTDE controller on a real socket: plays samples to any number of clients, in real time.

One thread does everything, so there is nothing to lock and nothing to wait for: it serves the
clients until the next deadline, then sends a sample. Deadlines are absolute: a late cycle shortens
the next.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterable

from urdyn.io.rtde.clients import Clients
from urdyn.io.rtde.controller import RELEASES, Controller, Generation
from urdyn.io.rtde.recipe import Values

PORT = 30004
HOPELESS = 1.0  # [s] behind: the machine slept, and there is no catching up
KEPT = 1 << 16  # lateness of so many cycles is remembered


def serve(
    source: Iterable[Values],
    host: str = "127.0.0.1",
    port: int = PORT,
    generation: Generation = "e",
) -> Server:
    """A controller that sends one sample of `source` every control cycle, until it has no more.

    A sample names outputs as RTDE does, `timestamp` [s] among them; what it leaves out is what
    clients set, else 0. Loopback unless `host` says otherwise; port 0 takes a free one.
    """
    controller = Controller(RELEASES[generation])
    return Server(source, controller, Clients(controller, host, port))


class Server:
    """A controller that serves in a thread of its own, until closed or out of samples."""

    def __init__(self, source: Iterable[Values], controller: Controller, clients: Clients) -> None:
        self.controller, self.clients = controller, clients
        self.port = clients.port
        self.lateness: deque[float] = deque(maxlen=KEPT)  # [s] of cycles after their deadline
        self._stop = False
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, args=(source,), daemon=True)
        self._thread.start()

    def join(self, timeout: float | None = None) -> bool:
        """Wait until the source has no more samples; has it? Raises what the source raised."""
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

    def __exit__(self, *raised: object) -> None:
        self.close()

    def _run(self, source: Iterable[Values]) -> None:
        try:
            self._play(source)
        except Exception as error:  # the source's; what clients do wrong ends at their connection
            self._failure = error
        finally:
            self.clients.close()

    def _play(self, source: Iterable[Values]) -> None:
        """One sample per control cycle, asked for when it is due: what is sent is fresh."""
        period = 1.0 / self.controller.rate
        samples, deadline = iter(source), time.monotonic()
        while not self._stop:
            deadline += period
            self.clients.attend(deadline)
            sample = next(samples, None)
            if sample is None:
                return
            late = time.monotonic() - deadline
            self.lateness.append(late)
            deadline += late if late > HOPELESS else 0.0
            self.clients.publish(self.controller.state(sample))
