"""Synchronisation, the second stage of section IV.B: streams of several rates on one time base."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from urdyn.errors import LogError
from urdyn.given import given_number, positive
from urdyn.signal.channels import by_column, columns, is_pose, is_state
from urdyn.signal.stretches import EVEN, GAP, median_step, stretches
from urdyn.types import Array, Defect, Index, Log, Mask


def synchronise(*logs: Log, rate: float = 100.0) -> Log:
    """The channels of all `logs` on one uniform time base of `rate` [Hz], as one log.

    A channel may have a rate of its own, in a log of its own or as rows between which it is NaN:
    joint states at 125 Hz, force/torque at 100 Hz, temperatures at 10 Hz. Between its samples it
    is interpolated linearly (a state is held, a pose turns about one axis); across a gap, and
    outside what was measured, it is NaN. Where no channel has values the base has no rows, lest a
    night be a million of them. What was filled in, and the gaps, are counted in the defects,
    channel by channel.
    """
    rate = given_number(rate, "rate", "a rate above 0 [Hz]", positive)
    grid = _grid(logs, rate)
    channels: dict[str, Array] = {}
    defects = [defect for log in logs for defect in log.defects]
    for log in logs:
        for name, values in log.channels.items():
            if name in channels:
                raise LogError(f"two logs have {name}; drop one", log.source.path, column=name)
            channels[name] = _onto(grid, log.t, name, values, near=EVEN / rate)
            defects += _defects(name, grid, _spoken(log, name), channels[name], rate)
    return Log(grid, channels, replace(logs[0].source, rows=None), tuple(defects))


def _spoken(log: Log, name: str) -> Array:
    """Stamps at which a channel has a value, (n,) [s]."""
    return log.t[np.isfinite(columns(log.channels[name])).any(1)]


def _grid(logs: tuple[Log, ...], rate: float) -> Array:
    """Multiples of 1 / rate after the first stamp that lie between two samples of a channel."""
    stamps = [t for log in logs for name in log.channels if len(t := _spoken(log, name))]
    if not stamps:
        raise LogError("nothing to synchronise", logs[0].source.path if logs else "")
    origin = min(float(t[0]) for t in stamps)
    spans = {
        (int(np.ceil(begin - EVEN)), int(np.floor(end + EVEN)) + 1)
        for t in stamps
        for rows in stretches(t)
        for begin, end in [(t[rows][[0, -1]] - origin) * rate]
    }
    ticks = np.unique(np.concatenate([np.arange(*span) for span in spans]))
    return np.asarray(origin + ticks / rate)


def _onto(grid: Array, t: Array, name: str, values: Array, near: float) -> Array:
    """A channel on the grid; `near` [s] counts as on a stamp."""

    def read(x: Array, between: Callable[[Array, Array, Array], Array]) -> Array:
        known = np.isfinite(columns(x)).all(1)
        if not known.any():
            return np.full((len(grid), *x.shape[1:]), np.nan)
        stamps, y = t[known], x[known]
        before = np.clip(np.searchsorted(stamps, grid + near, "right") - 1, 0, len(stamps) - 1)
        out = y[before] if is_state(name) else between(grid, stamps, y)
        out[~_bracketed(grid, stamps, before, near)] = np.nan
        return out

    out = by_column(values, lambda x: read(x, np.interp))
    if is_pose(name, values):
        out[:, 3:] = read(values[:, 3:], _turned)
    return out


def _turned(grid: Array, stamps: Array, y: Array) -> Array:
    """Rotation vectors (N, 3) [rad] between those of samples (n, 3): about one axis, evenly.

    Number by number they would pass through any orientation where a turn of pi changes its sign.
    """
    from scipy.spatial.transform import Rotation  # heavy, and seldom needed

    at = np.interp(grid, stamps, np.arange(len(stamps)))
    before = at.astype(np.intp)
    after = np.minimum(before + 1, len(stamps) - 1)
    start = Rotation.from_rotvec(y[before])
    way = (start.inv() * Rotation.from_rotvec(y[after])).as_rotvec()
    return np.asarray((start * Rotation.from_rotvec((at - before)[:, None] * way)).as_rotvec())


def _bracketed(grid: Array, stamps: Array, before: Index, near: float) -> Mask:
    """Whether a grid time is on a stamp or between two that no gap parts, (N,)."""
    after = np.minimum(before + 1, len(stamps) - 1)
    on = np.abs(grid - stamps[before]) <= near
    inside = (stamps[before] <= grid) & (grid <= stamps[after])
    whole = stamps[after] - stamps[before] <= GAP * median_step(stamps)
    return np.asarray(on | (inside & whole))


def _defects(name: str, grid: Array, stamps: Array, values: Array, rate: float) -> list[Defect]:
    """What was filled in between samples, and where a gap was left."""
    if not len(stamps):
        return []
    after = np.clip(np.searchsorted(stamps, grid), 1, max(1, len(stamps) - 1))
    after = np.minimum(after, len(stamps) - 1)
    nearest = np.minimum(np.abs(grid - stamps[after]), np.abs(grid - stamps[after - 1]))
    known = np.isfinite(columns(values)).any(1)
    filled = int((known & (nearest > (0.5 + EVEN) / rate)).sum())
    gaps = len(list(stretches(stamps))) - 1
    found = [
        Defect(f"{name} not measured within half a period", filled, 0, "interpolated"),
        Defect(f"gap in {name}", gaps, 0, "kept as NaN"),
    ]
    return [defect for defect in found if defect.count]
