"""Feature extraction, the fourth stage of section IV.B: what current and velocity say together."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from urdyn.given import given_number, not_negative
from urdyn.signal.stretches import breaks
from urdyn.types import Array, Log, freeze

SLOWEST = 0.01  # [rad/s] below this a ratio by velocity means nothing


@dataclass(frozen=True, eq=False)
class Features:
    """Derived metrics, per row and joint; NaN where what they derive from was not measured."""

    current_velocity_ratio: Array  # (N, J) [A s/rad] an apparent damping; NaN at standstill
    power: Array  # (N, J) [A rad/s] i v; times the drive gain K [N m/A] it is mechanical power in W
    energy: Array  # (N, J) [A rad] ∫ power dt since the first row; times K it is in J
    standstill: Array  # (N, J) [-] 1 where |v| is below the threshold
    reversal: Array  # (N, J) [-] 1 where a joint first moves the other way
    temperature_rise: Array  # (N, J) [°C] since the first measurement

    def __post_init__(self) -> None:
        freeze(self)


def features(log: Log, *, standstill: float = SLOWEST) -> Features:
    """Derived metrics of `log`; `standstill` [rad/s] is the slowest velocity to divide by."""
    takes = "a velocity, 0 or more [rad/s]"
    standstill = given_number(standstill, "standstill", takes, not_negative)
    i, v = log.joint("actual_current"), log.joint("actual_qd")
    moving = np.abs(v) > standstill
    power = i * v
    return Features(
        current_velocity_ratio=i / np.where(moving, v, np.nan),
        power=power,
        energy=_energy(log.t, power),
        standstill=np.where(np.isnan(v), np.nan, ~moving),
        reversal=np.where(np.isnan(v), np.nan, _reversals(np.where(moving, np.sign(v), 0.0))),
        temperature_rise=_since_first(log.joint("joint_temperatures")),
    )


def add_features(log: Log, *, standstill: float = SLOWEST) -> Log:
    """Log with the derived metrics as channels beside its own."""
    derived = features(log, standstill=standstill)
    channels = {item.name: getattr(derived, item.name) for item in fields(derived)}
    return replace(log, channels={**log.channels, **channels})


def _energy(t: Array, power: Array) -> Array:
    """Trapezoidal integral of power; nothing is added across a gap or an unmeasured row."""
    step = np.diff(t)
    step[[row - 1 for row in breaks(t)]] = 0.0
    added = step[:, None] * (power[1:] + power[:-1]) / 2
    total = np.cumsum(np.nan_to_num(added, nan=0.0), axis=0)
    return np.concatenate([np.zeros_like(power[:1]), total])


def _reversals(direction: Array) -> Array:
    """1 where a direction, (N, J) of -1, 0 and 1, is not the last one that was not 0."""
    rows = np.arange(len(direction))[:, None]
    latest = np.maximum.accumulate(np.where(direction != 0, rows, 0), axis=0)
    held = np.take_along_axis(direction, latest, axis=0)
    turned = held[1:] * held[:-1] < 0
    return np.concatenate([np.zeros_like(direction[:1]), turned])


def _since_first(x: Array) -> Array:
    """x less its first measured value, column by column."""
    if not len(x):
        return x
    first = np.isfinite(x).argmax(axis=0)
    return x - np.take_along_axis(x, first[None], axis=0)
