"""A virtual arm as a controller on the network."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from itertools import chain
from typing import TYPE_CHECKING, Any

import urdyn as ud
from urdyn.cli.apart import ahead
from urdyn.cli.ending import ended_by
from urdyn.cli.voice import Voice
from urdyn.io.address import joined

if TYPE_CHECKING:
    from urdyn.model.arm import Arm

LOOK = 0.2  # [s] between looks for Ctrl-C
CB3 = ("ur3", "ur5", "ur10")  # arms whose controllers send every 8 ms; the others every 2 ms


def cycle(arm: Arm) -> float:
    """Time between two packages of an arm's controller [s]."""
    return 0.008 if _is_cb3(arm) else 0.002


def _is_cb3(arm: Arm) -> bool:
    from urdyn.model.ur_type import ur_type

    return ur_type(arm) in CB3


def serve_logs(
    logs: Iterator[ud.Log], arm: Arm, host: str, port: int, voice: Voice, about: Mapping[str, Any]
) -> None:
    """Play logs, one after the other, to all clients, until Ctrl-C or a service manager ends it.

    The JSON result holds where it listens, beside what is known `about` the first.
    """
    from urdyn.io.rtde import play, serve

    samples = chain.from_iterable(map(play, ahead(logs)))
    server = serve(samples, host, port, "cb3" if _is_cb3(arm) else "e")
    ended, rate = threading.Event(), 1.0 / cycle(arm)
    with server, ended_by(ended.set):
        voice.note(
            f"a virtual {arm.name} serves RTDE on {joined(host, server.port)}, "
            f"{rate:g} Hz; Ctrl-C ends it"
        )
        where = {"robot": arm.name, "host": host, "port": server.port, "rate_hz": rate}
        voice.result({**about, **where})
        while not ended.is_set() and not server.join(LOOK):
            pass
        voice.note("ended")
