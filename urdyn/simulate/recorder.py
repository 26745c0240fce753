"""Recorders: errors in a controller's samples on their way into a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from urdyn.types import Array, Index, Log, Mask


@dataclass(frozen=True)
class Recorder:
    """A recorder's errors. Its log is the file's content, before any repair by reading: stamps may
    repeat.
    """

    jitter: float = 0.0  # [-] sd of the polling time, in rows
    torn: float = 0.0  # [-] share of rows whose last columns are already those of the next sample
    lost: float = 0.0  # [-] share of samples that never arrive
    rates: Mapping[str, float] = field(default_factory=dict)  # [Hz] of channels, with NaN between

    def record(self, log: Log, rng: np.random.Generator) -> Log:
        """The log as this recorder would write it."""
        sparse = {name: _sparse(log, name, self.rates.get(name)) for name in log.channels}
        asked = _asked(len(log), self.jitter, rng)
        asked = asked[rng.random(len(asked)) >= self.lost]
        following = np.minimum(asked + 1, len(log) - 1)
        tear = np.where(rng.random(len(asked)) < self.torn, rng.random(len(asked)), 1.0)
        place = np.linspace(0.0, 1.0, len(sparse), endpoint=False)
        channels = {
            name: values[np.where(tear > at, asked, following)]
            for at, (name, values) in zip(place, sparse.items(), strict=True)
        }
        return replace(log, t=log.t[asked], channels=channels)


# ur_rtde's recorder polls: 8 to 17 % of its rows at 500 Hz repeat or skip a stamp, some are torn.
POLLING = Recorder(jitter=0.27, torn=0.005, lost=0.001)

# Topics and sensors with rates of their own, merged by their stamps.
SEVERAL_RATES = Recorder(
    rates={"joint_temperatures": 10.0, "actual_TCP_force": 100.0, "ft_raw_wrench": 100.0}
)

RECORDERS = {"exact": Recorder(), "polling": POLLING, "several_rates": SEVERAL_RATES}


def fresh(t: Array, rate: float) -> Mask:
    """Rows at t (N,) [s], from 0, with a new value of a channel at `rate` [Hz], (N,)."""
    return np.diff(np.floor(t * rate + 1e-6), prepend=-1.0) > 0.0


def _asked(rows: int, jitter: float, rng: np.random.Generator) -> Index:
    """Index of the newest sample whenever the recorder polls, (N,)."""
    late = np.round(jitter * rng.standard_normal(rows)).astype(np.intp)
    return np.maximum.accumulate(np.clip(np.arange(rows) + late, 0, rows - 1))


def _sparse(log: Log, name: str, rate: float | None) -> Array:
    """A channel with NaN in rows without a new value at its rate."""
    values = log.channels[name]
    if rate is None:
        return values
    new = fresh(log.t, rate)
    return np.where(new if values.ndim == 1 else new[:, None], values, np.nan)
