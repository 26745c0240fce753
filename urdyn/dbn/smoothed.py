"""A smoother's belief in a whole history, and the noise that it implies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U, linearised
from urdyn.errors import InputError
from urdyn.given import ROUNDING
from urdyn.types import Array, freeze, shaped


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Beliefs given all observations, including the one before the first slice."""

    mean: Array  # (N + 1, n)
    cov: Array  # (N + 1, n, n)
    cross: Array  # (N, n, n) covariance of each slice's state with the one before

    def __post_init__(self) -> None:
        freeze(self, "mean")
        if self.mean.ndim != 2 or not len(self.mean):
            raise InputError(f"mean has the shape {self.mean.shape}; it has to be (N + 1, n)")
        slices, n = len(self.mean) - 1, self.mean.shape[1]
        for name, count in (("cov", slices + 1), ("cross", slices)):
            object.__setattr__(self, name, shaped(name, getattr(self, name), (count, n, n)))

    @property
    def sd(self) -> Array:
        """Marginal standard deviations, (N + 1, n)."""
        return np.sqrt(np.diagonal(self.cov, axis1=1, axis2=2))

    def increments(self) -> Array:
        """E[(x_t - x_t-1)(x_t - x_t-1)ᵀ], (N, n, n)."""
        moved = np.diff(self.mean, axis=0)
        both = self.cross + np.swapaxes(self.cross, 1, 2)
        return _left(_outer(moved), self.cov[1:] + self.cov[:-1], both)


def process_residuals(model: TwoSlice[U], inputs: Sequence[U], history: Smoothed) -> Array:
    """E[w wᵀ] of every slice's process noise, (N, n, n)."""
    _require_slices(history, inputs=len(inputs))
    found = []
    for t, u in enumerate(inputs):
        F = model.transition_jacobian(history.mean[t], u)
        w = history.mean[t + 1] - model.transition(history.mean[t], u)
        CF = history.cross[t] @ F.T
        spread = history.cov[t + 1] + F @ history.cov[t] @ F.T
        found.append(_left(np.outer(w, w), spread, CF + CF.T))
    return np.array(found)


def observation_residuals(
    model: TwoSlice[U], inputs: Sequence[U], observations: Array, history: Smoothed
) -> Array:
    """E[e eᵀ] of every slice's measurement noise, (N, m, m); NaN where not measured."""
    _require_slices(history, inputs=len(inputs), observations=len(observations))
    found = []
    for t, (u, y) in enumerate(zip(inputs, observations, strict=True), start=1):
        seen, H = linearised(model, history.mean[t], u)
        e = y - seen
        found.append(np.outer(e, e) + H @ history.cov[t] @ H.T)
    return np.array(found)


def _require_slices(history: Smoothed, **counts: int) -> None:
    """InputError where these counts differ from the history's number of slices."""
    slices = len(history.cross)
    for what, count in counts.items():
        if count != slices:
            raise InputError(f"there are {count} {what}, and the history has {slices} slices")


def _left(squares: Array, spread: Array, common: Array) -> Array:
    """squares + spread - common, (..., n, n); none of a state of which only rounding is left."""
    found = squares + spread - common
    moves = np.diagonal(found - ROUNDING * spread, axis1=-2, axis2=-1) > 0.0
    return np.asarray(found * (moves[..., :, None] & moves[..., None, :]))


def _outer(x: Array) -> Array:
    return np.asarray(x[..., :, None] * x[..., None, :])
