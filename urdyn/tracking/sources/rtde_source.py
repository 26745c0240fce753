"""A live robot, by its controller's RTDE server."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from itertools import islice
from threading import TIMEOUT_MAX, Event, Thread
from typing import Any

import numpy as np

from urdyn.errors import LogError
from urdyn.io.address import joined
from urdyn.io.clock import DRIFT, credible
from urdyn.io.rtde.client import Client, Connected, Dropped, connect, parse_address
from urdyn.io.rtde.link import Package
from urdyn.signal import BESIDE, POSE, SETTING, UNSET, Sample, Touch
from urdyn.signal.channels import STATUS, undriven
from urdyn.signal.stretches import GAP
from urdyn.tracking.sources.source import CHANNELS, LATEST, LOOK, Arrival, Source, Tell

PAUSE = 0.1  # [s] without a package, after which their delay is estimated anew
# [s] between packages up to which their reader does not sleep. On two processors of a busy host,
# samples took half as long again if it slept, and 1 in 100 three times as long.
AWAKE = 4e-3
JUDGED = 3.0  # [s] at first, over which a robot's rate is measured
RTDE_JOINTS = 6
SELDOM = (
    "sends {:.2g} samples a second where {:g} were agreed; so far apart they tell nothing: "
    "ask for fewer by --rate"
)


def robot(
    name: str,
    rate: float | None,
    duration: float | None,
    beside: Collection[str],
    tell: Tell,
    contact: Touch | None,
) -> Source:
    """The controller that `name` names; arguments as for `open_source`."""
    host, port = parse_address(name)
    # Its own poses tell which arm it is, whether or not they are used as a stream.
    asked = [*STATUS, *SETTING, *(BESIDE[stream] for stream in (POSE, *beside))]
    needed = ("timestamp", *CHANNELS, *([contact.channel] if contact else []))
    optional = {CHANNELS[1], CHANNELS[3], *asked} - {contact and contact.channel}
    client = connect(host, port, (*needed, *asked), rate, optional=optional, awake=AWAKE)
    if contact:
        try:
            contact.require_lone(client.agreement.recipe.dtype[contact.channel].shape, name)
        except LogError:
            client.close()
            raise
    period = client.agreement.period
    count = None if duration is None else max(1, round(duration / period))

    def start(_: int) -> Iterator[Arrival]:
        with _closed_after(duration, client):
            yield from islice(_heard(client, tell, contact), count)

    sent = frozenset(s for s in beside if BESIDE[s] not in client.agreement.left_out)
    return Source(
        name=name,
        identity=f"{joined(host, port)} {contact}" if contact else joined(host, port),
        sha256="",
        period=period,
        joints=RTDE_JOINTS,
        live=True,
        length=count or 0,
        start=start,
        close=client.close,
        velocities=CHANNELS[1] not in client.agreement.left_out,
        beside=sent,
        tell=tell,
    )


@contextmanager
def _closed_after(duration: float | None, client: Client) -> Iterator[None]:
    """Wait little longer than `duration` [s] for a robot that is slow or gone.

    What it has sent by then is read, however late.
    """
    if duration is None:
        yield
        return
    patience, ended = min(duration + LATEST, TIMEOUT_MAX), Event()

    def close() -> None:
        ended.wait(patience)
        while client.unread and not ended.wait(LOOK):
            pass
        client.close()

    Thread(target=close, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


def _heard(client: Client, tell: Tell, contact: Touch | None) -> Iterator[Arrival]:
    """A controller's samples, read between steps: a thread would only compete with these.

    A package's arrival time is its stamp plus the smallest recent delay, so that the time it
    waited to be read counts.
    """
    behind, before = np.inf, np.nan  # [s] our clock minus the controller's, and its last stamp
    for package in _paced(_packages(client, tell), client.agreement.period, tell):
        values, read = client.agreement.recipe.unpack(package.values), package.received
        sample = _sample(values, contact)
        if not credible(sample.t):
            continue  # counts as lost
        passed = sample.t - before
        known = behind + DRIFT * passed if 0.0 < passed < PAUSE else np.inf
        behind, before = min(known, read - sample.t), sample.t
        yield Arrival(sample, sample.t + behind)


def _paced(packages: Iterator[Package], period: float, tell: Tell) -> Iterator[Package]:
    """The packages; `tell` is told if those of the first seconds are too sparse to learn from."""
    first, count = np.nan, 0
    for package in packages:
        yield package
        first, count = (first if count else package.received), count + 1
        passed = package.received - first
        if passed > JUDGED:
            if passed > GAP * period * (count - 1):
                tell(SELDOM.format((count - 1) / passed, 1.0 / period))
            break
    yield from packages


def _packages(client: Client, tell: Tell) -> Iterator[Package]:
    """A controller's packages; `tell` is told when it is lost, and when it is back."""
    lost = False
    for event in client.events():
        match event:
            case Package():
                yield event
            case Dropped():
                lost = True
                tell(f"{event.reason}; waiting for it")
            case Connected() if lost:
                lost = False
                tell("is back")


def _sample(values: dict[str, Any], contact: Touch | None) -> Sample:
    nothing = np.full(RTDE_JOINTS, np.nan)
    t = float(values["timestamp"])
    q, v, current, temperature = (values.get(name, nothing) for name in CHANNELS)
    told = ((stream, values.get(name)) for stream, name in BESIDE.items())
    whole = values.keys() >= SETTING.keys()  # controllers report both or neither
    beside = {
        stream: np.concatenate([[t], six, *([q] if stream == POSE else [])])[None]
        for stream, six in told
        if six is not None
    }
    setting = np.array([values["payload"], *values["payload_cog"]]) if whole else UNSET
    passive = undriven(*(values.get(name, np.nan) for name in STATUS))
    touching = bool(contact and contact.felt(values[contact.channel]))
    current = nothing if passive or touching else current
    return Sample(t, q, v, current, temperature, beside, setting, passive, touching)
