"""Normalisation, the fifth stage of section IV.B, as a value that can be undone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from urdyn.errors import InputError
from urdyn.signal.channels import is_state, named
from urdyn.types import Array, Log, frozen, remade

Limits = Mapping[str, tuple[ArrayLike, ArrayLike]]


@dataclass(frozen=True, eq=False)
class Scaling:
    """x -> (x - centre) / scale, channel by channel; channels that it does not name pass."""

    centre: Mapping[str, Array]  # name -> () or (width,), in the channel's unit
    scale: Mapping[str, Array]  # name -> () or (width,), in the channel's unit, not 0

    def __post_init__(self) -> None:
        for name in ("centre", "scale"):
            values = {key: frozen(value) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, MappingProxyType(values))
        if self.centre.keys() != self.scale.keys():
            raise InputError("centre and scale name different channels; each takes both")
        for name, scale in self.scale.items():
            if not (np.isfinite(scale) & (scale != 0.0) & np.isfinite(self.centre[name])).all():
                told = f"{name}: centre {self.centre[name]}, scale {scale}"
                raise InputError(f"{told}: takes finite numbers, and no scale of 0")

    __reduce__ = remade

    @classmethod
    def standard(cls, log: Log) -> Scaling:
        """To zero mean and unit standard deviation, for every channel of `log` but the states."""
        names = [name for name in log.channels if not is_state(name)]
        moments = {name: _moments(log.channels[name]) for name in names}
        return cls({n: m for n, (m, _) in moments.items()}, {n: s for n, (_, s) in moments.items()})

    @classmethod
    def ranges(cls, limits: Limits) -> Scaling:
        """From (low, high), in each channel's unit, to (-1, 1)."""
        bounds = {n: (np.asarray(lo), np.asarray(hi)) for n, (lo, hi) in limits.items()}
        for name, (lo, hi) in bounds.items():
            if not (lo < hi).all():
                raise InputError(f"limits of {name} {lo}, {hi}: takes a lower and an upper one")
        return cls(
            {name: (hi + lo) / 2 for name, (lo, hi) in bounds.items()},
            {name: (hi - lo) / 2 for name, (lo, hi) in bounds.items()},
        )

    def apply(self, log: Log) -> Log:
        """The log in scaled, unitless channels."""
        known = [n for n in log.channels if n in self.scale]
        scaled = {n: (log.channels[n] - self.centre[n]) / self.scale[n] for n in known}
        return replace(log, channels={**log.channels, **scaled})

    def invert(self, log: Log) -> Log:
        """The log in its channels' own units again."""
        known = [n for n in log.channels if n in self.scale]
        plain = {n: log.channels[n] * self.scale[n] + self.centre[n] for n in known}
        return replace(log, channels={**log.channels, **plain})


def normalise(log: Log, *, limits: Limits | None = None) -> Log:
    """Log scaled to zero mean and unit standard deviation, or from `limits` to (-1, 1).

    The scaling is a function of its input: `Scaling.standard(log)` gives it, to undo it.
    """
    if limits is None:
        return Scaling.standard(log).apply(log)
    named(log, limits)
    return Scaling.ranges(limits).apply(log)


def _moments(x: Array) -> tuple[Array, Array]:
    """Mean and standard deviation of what was measured; 0 and 1 where nothing was or it rests."""
    known = np.isfinite(x)
    count = np.maximum(known.sum(0), 1)
    mean = np.where(known, x, 0.0).sum(0) / count
    variance = (np.where(known, x - mean, 0.0) ** 2).sum(0) / count
    resting = variance <= (1e-12 * np.abs(mean)) ** 2  # a constant's rounding is not its spread
    return mean, np.where(resting, 1.0, np.sqrt(variance))
