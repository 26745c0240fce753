"""A robot at work: moments as they come. Nothing is sent to it but the request for data."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from urdyn.errors import UrdynError
from urdyn.estimate.protocol import S
from urdyn.report.track.history import find_history
from urdyn.tracking import Source, Tracker, quantities
from urdyn.tracking.output.checkpoint import whose
from urdyn.tracking.sources.restarts import arrivals
from urdyn.tracking.sources.source import ROS2, SCHEME, now
from urdyn.types import Array, Gaussian
from urdyn.view.film import Moment
from urdyn.view.replay import beliefs, share

RATE = 25.0  # [Hz] of moments, at most
LATE = 0.2  # [s] of a sample's age, above which drawing takes too long
BEHIND = 0.5  # [s] between two moments then, so that the tracker catches up
PAUSE = 2.0  # [s] between two checks for more history


def watched(source: Source) -> Iterator[Moment]:
    """How a robot moves, without estimates."""
    last, began = -np.inf, np.nan
    for arrival in arrivals(source):
        t, q = arrival.sample.t, arrival.sample.q
        if np.isfinite(q).all() and t - last >= 1.0 / RATE:
            last, began = t, t if np.isnan(began) else began
            nothing = np.full(len(q), np.nan)
            yield Moment(t - began, q, np.zeros(len(q)), nothing, nothing, nothing)


def tracked(tracker: Tracker[S], source: Source) -> Iterator[Moment]:
    """How a robot moves, and what a tracker that starts now estimates."""
    state, told = tracker.init(), _told(tracker)
    first = told(tracker.filter.belief(state.belief))
    gain = tracker.fit.dynamics.drive.gain
    last, began = -np.inf, np.nan
    for arrival in arrivals(source):
        state, reading = tracker.step(state, arrival.sample)
        t, q = arrival.sample.t, arrival.sample.q
        began = t if np.isnan(began) else began
        pause = BEHIND if now() - arrival.received > LATE else 1.0 / RATE
        if reading is None or t - last < pause or not np.isfinite(q).all():
            continue
        last = t
        friction, health, zero = told(reading.belief)
        torque = (reading.current - reading.predicted) * gain * health
        yield Moment(t - began, q, zero, share(friction, first[0]), share(health, first[1]), torque)


def followed(folder: Path, source: Source) -> Iterator[Moment]:
    """How a robot moves, and what `urdyn track` beside it has written of it so far.

    Residual torque is not known: what is written is seconds old.
    """
    looked, newest = -np.inf, None
    for moment in watched(source):
        if time.monotonic() - looked > PAUSE:
            looked, newest = time.monotonic(), _newest(folder) or newest
        yield replace(newest, t=moment.t, q=moment.q) if newest else moment


def address(folder: Path) -> str:
    """rtde:// or ros2:// address of the robot that a run tracks; "" where it tracks none."""
    # A robot's may be followed by its kinematic calibration, a log's hash by its rows.
    source = whose(folder).get("source", "").partition(" ")[0]
    if source.startswith(ROS2):
        return source
    return f"{SCHEME}{source}" if ":" in source else ""


def _told(tracker: Tracker[S]) -> Callable[[Gaussian], tuple[Array, Array, Array]]:
    """A function from belief to friction, health and zero of every joint, (J,) each."""
    of = quantities(tracker.fit, tracker.currents)
    joints = tracker.fit.dynamics.arm.joint_names
    friction, health, zero = (
        [of.names.index(f"{joint}.{name}") for joint in joints]
        for name in ("friction", "health", "zero")
    )

    def told(belief: Gaussian) -> tuple[Array, Array, Array]:
        mean = of.of(belief)[0]
        return mean[friction], mean[health], mean[zero]

    return told


def _newest(folder: Path) -> Moment | None:
    """The last row that has been written; None while there is none that can be read."""
    try:
        run = find_history(folder)
        ends = tuple(dict.fromkeys((run.files[0], run.files[-1])))  # a day has thousands between
        film = beliefs(replace(run, files=ends), None)
    except UrdynError:
        return None
    return film.moment(len(film) - 1)
