"""Publishes a run's newest state to ROS 2 topics, Prometheus and MQTT."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from threading import Event, Thread

import numpy as np

from urdyn.identify.fit import Fit
from urdyn.io.listener import Listener
from urdyn.io.ros2.talk import Voice
from urdyn.io.seen import Seen, acknowledged, forgetting, seen
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Status
from urdyn.model.body import centre_of_mass
from urdyn.model.friction import WORKING_SPEED
from urdyn.tracking.belief.physical import PAYLOAD
from urdyn.tracking.output.progress import RunProgress
from urdyn.tracking.output.statuses import STALE, limited, stale, statuses
from urdyn.types import Array

LOG = logging.getLogger(__name__)
PULSE = 1.0  # [s] between two diagnoses

Tell = Callable[[Snapshot, Sequence[Status]], None]  # a listener's, or ours


@dataclass(frozen=True, eq=False)
class Audience:
    """The recipients."""

    voice: Voice | None = None  # ROS 2
    plants: Sequence[Listener] = ()
    acknowledgements: Callable[[], Iterator[str]] = lambda: iter(())
    remarks: Callable[[], Iterator[Status]] = lambda: iter(())  # appended to the arm's lines


class Announcer:
    """A watcher of a run, whose own thread publishes once a second, even when no sample comes.

    The last message is the newest state with the final findings: a broker keeps it.
    """

    def __init__(self, fit: Fit, audience: Audience, serial: str) -> None:
        self._fit, self._audience, self._serial = fit, audience, serial
        self._friction = fit.friction(WORKING_SPEED).mean
        self._newest: tuple[float, RunProgress, Snapshot] | None = None  # since [s] monotonic
        # (J,) [N·m/A] of drives, at their estimated health
        self._torque_per_ampere = fit.dynamics.drive.gain
        self._known: dict[str, Seen] = {}  # acknowledged findings, by the lines' names
        self._failed: set[Tell] = set()  # listeners whose failure was already logged
        self._ended = Event()
        self._pulse = Thread(target=self._beat, daemon=True)
        self._pulse.start()

    def watch(self, progress: RunProgress) -> None:
        """Publish what is new: torque with every sample, if wanted; the rest with the history."""
        voice = self._audience.voice
        if voice and not progress.ended:
            voice.quickly(self._torque_per_ampere * progress.reading.modelled)
        if not progress.row:
            return
        snapshot = self._snapshot(progress)
        self._newest = time.monotonic(), progress, snapshot
        if voice:
            voice.steadily(snapshot)

    def close(self) -> None:
        """Stop publishing."""
        self._ended.set()
        self._pulse.join(timeout=5 * PULSE)

    def _snapshot(self, progress: RunProgress) -> Snapshot:
        arm, drive = self._fit.dynamics.arm, self._fit.dynamics.drive
        joints = arm.joint_names
        mean, sd, units = by_part(progress, joints)
        self._torque_per_ampere = drive.gain * _of(mean, joints, "health")
        predicted = self._torque_per_ampere * progress.reading.predicted
        commissioned = {"viscous": drive.viscous, "coulomb": drive.coulomb}
        return Snapshot(
            robot=self._serial or arm.name,
            stamp=round(progress.last * 1e9),
            samples=progress.samples,
            delay=progress.delay,
            joints=joints,
            mean=mean,
            sd=sd,
            units=units,
            predicted=predicted,
            residual=self._torque_per_ampere * progress.reading.current - predicted,
            com=centre_of_mass(np.array([mean["payload"][name] for name in PAYLOAD])),
            scales=np.array([_of(mean, joints, name) / c for name, c in commissioned.items()]),
        )

    def _beat(self) -> None:
        plants = [listener.tell for listener in self._audience.plants]
        listeners = (self._diagnose, *plants) if self._audience.voice else plants
        ended = False
        while not ended:
            ended = self._ended.wait(PULSE)
            if self._newest is None:
                continue
            came, progress, snapshot = self._newest
            found = statuses(snapshot, self._friction, progress.findings, self._serial)
            self._told(self._hear, snapshot, found)
            age = 0.0 if progress.ended else time.monotonic() - came
            lines = self._lines(found, progress, age)
            for tell in listeners:
                self._told(tell, snapshot, lines)

    def _hear(self, _: Snapshot, found: Sequence[Status]) -> None:
        known = forgetting(self._known, found)
        self._known = known | seen(found, self._audience.acknowledgements())

    def _diagnose(self, _: Snapshot, lines: Sequence[Status]) -> None:
        assert self._audience.voice
        self._audience.voice.diagnose(time.time_ns(), tuple(lines))

    def _told(self, tell: Tell, now: Snapshot, lines: Sequence[Status]) -> None:
        """Tell one listener; if that fails, the others still hear, and it is tried again."""
        try:
            tell(now, lines)
        except Exception as error:
            if tell not in self._failed:
                LOG.warning("%s: %r; tried again every second", tell.__module__, error)
            self._failed.add(tell)
        else:
            self._failed.discard(tell)

    def _lines(
        self, found: Sequence[Status], progress: RunProgress, age: float
    ) -> tuple[Status, ...]:
        told = limited(acknowledged(found, self._known), progress.doubt, progress.behind)
        return (*(stale(found, age) if age > STALE else told), *self._audience.remarks())


def _of(mean: Mapping[str, Mapping[str, float]], joints: Sequence[str], name: str) -> Array:
    return np.array([mean[joint][name] for joint in joints])


def by_part(
    progress: RunProgress, joints: Sequence[str]
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, float]], Mapping[str, str]]:
    """Means and sd, part -> quantity -> value, of the joints and the payload; quantity -> unit."""
    mean: dict[str, dict[str, float]] = {part: {} for part in (*joints, "payload")}
    sd: dict[str, dict[str, float]] = {part: {} for part in mean}
    units = {}
    rows = zip(
        progress.names, progress.units, progress.mean.tolist(), progress.sd.tolist(), strict=True
    )
    for name, unit, value, spread in rows:
        part, _, quantity = name.rpartition(".")
        if part in mean:
            mean[part][quantity], sd[part][quantity], units[quantity] = value, spread, unit
    return mean, sd, units
