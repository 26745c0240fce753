"""What a caller gives, as numbers; InputError names what cannot be used, and says what can."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.types import Array


def positive(numbers: Array) -> Any:
    """Whether each is above 0."""
    return numbers > 0.0


def fraction(numbers: Array) -> Any:
    """Whether each is between 0 and 1."""
    return (numbers > 0.0) & (numbers < 1.0)


def given(
    value: object,
    what: str,
    takes: str = "finite numbers",
    fits: Callable[[Array], Any] = np.isfinite,
    streams: int | None = None,
) -> Array:
    """A number or a row of them, finite, that fits: (n,) where there are n `streams`."""
    numbers = np.atleast_1d(_numbers(value))
    if numbers.ndim != 1 or not np.isfinite(numbers).all() or not np.all(fits(numbers)):
        raise InputError(f"{what} {value}: takes {takes}")
    if streams is None:
        return numbers
    if len(numbers) not in (1, streams):
        raise InputError(f"{what}: {len(numbers)} for {streams} streams; give one for all, or each")
    return np.broadcast_to(numbers, (streams,))


def given_side(side: object, streams: int | None = None) -> Array:
    """Side of the changes that matter, (n,): +1 a rise, -1 a fall, 0 both."""
    takes = "+1 where only a rise is a fault, -1 a fall, 0 both"
    return given(side, "side", takes, lambda x: np.isin(x, (-1.0, 0.0, 1.0)), streams)


def given_tolerance(tolerance: object, streams: int | None = None) -> Array:
    """Change that is no fault, 0 or more, (n,)."""
    return given(tolerance, "tolerance", "finite numbers, 0 or more", lambda x: x >= 0.0, streams)


def given_promise(promise: object) -> float:
    """Steps to a false alarm, 1 or more."""
    takes = "the steps to a false alarm, 1 or more"
    return float(given(promise, "promise", takes, lambda x: (x >= 1.0) & (len(x) == 1))[0])


def given_count(count: object, what: str, least: int = 1) -> None:
    """InputError where `count` is no whole number of `least` or more."""
    takes = f"a whole number, {least} or more"
    given(count, what, takes, lambda x: (x >= least) & (x % 1.0 == 0.0))


def given_rows(series: object, what: str) -> Array:
    """A series of steps x streams, (N, n), NaN where nothing was measured; (N,) is one stream."""
    rows = _numbers(series)
    rows = rows[:, None] if rows.ndim == 1 else rows
    if rows.ndim != 2 or not rows.shape[1]:
        raise InputError(f"{what} is steps x streams of numbers; this has the shape {rows.shape}")
    return rows


def _numbers(value: object) -> Array:
    """As an array; of no dimension, and NaN, where it holds anything else than numbers."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        return np.array(np.nan)
    return array.astype(np.float64) if array.dtype.kind in "biuf" else np.array(np.nan)
