"""Checks of a caller's arguments; InputError names what cannot be used, and what can."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import PurePath
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from urdyn.errors import InputError
from urdyn.types import Array, Gaussian, Index, Log, Mask, Motion, frozen, shaped, unmasked

T = TypeVar("T")

# Relative to the standard deviations: tolerated asymmetry and negative eigenvalues of a covariance,
# as in the inverse of a nearly singular information matrix.
ALIKE = 1e-3
ROUNDING = 1e-14  # of the largest variance, per state: what rounding makes of 0

NUMBERS = "biuf"  # NumPy's dtype kinds of real numbers
HELD = {
    "c": "complex numbers",
    "M": "dates",
    "O": "objects, None among them perhaps",
    "S": "text",
    "U": "text",
    "V": "rows of different lengths",
    "m": "lapses of time",
}


def given_a(value: object, kind: type[T], what: str, got: str) -> T:
    """`value` if it is of this kind; InputError says what it is instead, and how one is `got`."""
    if isinstance(value, kind):
        return value
    held = repr(value) if isinstance(value, str | PurePath) else f"a {type(value).__name__}"
    name = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    raise InputError(f"{what}: takes {name}, {got}; this is {held}")


def given_log(value: object) -> Log:
    """A log."""
    return given_a(value, Log, "log", "as urdyn.read(path) gives")


def given_motion(value: object) -> Motion:
    """A motion."""
    return given_a(value, Motion, "motion", "as urdyn.condition(log) gives")


def positive(numbers: Array) -> Any:
    """Whether each is above 0."""
    return numbers > 0.0


def not_negative(numbers: Array) -> Any:
    """Whether each is 0 or more, and finite."""
    return (numbers >= 0.0) & np.isfinite(numbers)


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
    """A finite number, or a row of them, that `fits`: (n,) where there are n `streams`."""
    held = _held(value)
    row = np.atleast_1d(_numbers(held))
    truths = held.dtype.kind == "b"
    if truths or row.ndim != 1 or not np.isfinite(row).all() or not np.all(fits(row)):
        raise InputError(f"{what} {value}: takes {takes}")
    if streams is None:
        return row
    if len(row) not in (1, streams):
        raise InputError(f"{what}: {len(row)} for {streams} streams; give one for all, or each")
    return np.broadcast_to(row, (streams,))


def given_number(
    value: object,
    what: str,
    takes: str = "a finite number",
    fits: Callable[[Array], Any] = np.isfinite,
) -> float:
    """One finite number that `fits`."""
    return float(given(value, what, takes, lambda x: fits(x) & (len(x) == 1))[0])


def given_side(side: object, streams: int | None = None) -> Array:
    """Side of the changes that matter, (n,): +1 a rise, -1 a fall, 0 both."""
    takes = "+1 where only a rise is a fault, -1 a fall, 0 both"
    return given(side, "side", takes, lambda x: np.isin(x, (-1.0, 0.0, 1.0)), streams)


def given_tolerance(tolerance: object, streams: int | None = None) -> Array:
    """Change that is no fault, 0 or more, (n,)."""
    return given(tolerance, "tolerance", "finite numbers, 0 or more", not_negative, streams)


def given_promise(promise: object) -> float:
    """Steps to a false alarm, 1 or more."""
    takes = "the steps to a false alarm, 1 or more"
    return given_number(promise, "promise", takes, lambda x: x >= 1.0)


def given_count(count: object, what: str, least: int = 1, most: float = np.inf) -> int:
    """A whole number from `least` to `most`."""
    ends = f", {least} or more" if most == np.inf else f" from {least} to {most}"

    def fits(x: Array) -> Mask:
        return np.asarray((x >= least) & (x <= most) & (x % 1.0 == 0.0))

    return int(given_number(count, what, f"a whole number{ends}", fits))


def given_each(
    values: object,
    what: str,
    shape: tuple[int, ...],
    takes: str = "finite numbers",
    fits: Callable[[Array], Any] = np.isfinite,
) -> Array:
    """Numbers of this shape that all fit, as `shaped` makes them."""
    array = shaped(what, _array(values, what), shape)
    wrong = np.argwhere(~fits(array))
    if len(wrong):
        at = tuple(wrong[0].tolist())
        raise InputError(f"{what}{list(at) or ''} is {array[at]}: takes {takes}")
    return array


def given_sd(values: object, what: str, shape: tuple[int, ...]) -> Array:
    """Standard deviations of this shape, or densities of them, as `shaped` makes them."""
    return given_each(values, what, shape, "finite numbers, 0 or more", not_negative)


def given_covariance(values: object, what: str, n: int | None = None) -> Array:
    """A covariance, (n, n), of any size where n is None; it may be singular, up to rounding."""
    cov = _array(values, what)
    if cov.ndim != 2 or cov.shape != ((len(cov) if n is None else n,) * 2):
        due = "(m, m)" if n is None else f"{(n, n)}"
        raise InputError(f"{what} has the shape {cov.shape}; it has to be a covariance, {due}")
    if not np.isfinite(cov).all():
        raise InputError(f"{what} holds NaN or infinity; it has to be a finite covariance")
    variance = cov.diagonal()
    none = ROUNDING * len(cov) * np.abs(cov).max(initial=0.0)
    if (variance < -none).any():
        least = f"{variance.min():.4g}"
        raise InputError(f"{what} has the variance {least}; a covariance has none below 0")
    sd = np.sqrt(np.maximum(variance, 0.0))
    apart = np.abs(cov - cov.T) - ALIKE * np.outer(sd, sd)
    if (apart > none).any():
        i, j = (int(k) for k in np.unravel_index(apart.argmax(), cov.shape))
        raise InputError(
            f"{what}[{i}, {j}] is {cov[i, j]:.4g} and {what}[{j}, {i}] {cov[j, i]:.4g}; "
            "a covariance is symmetric"
        )
    _require_definite(cov + none * np.eye(len(cov)), what)
    return cov


def _require_definite(cov: Array, what: str) -> None:
    """InputError where the covariance is not positive semidefinite."""
    sd = np.sqrt(cov.diagonal())
    correlation = cov / np.where(sd > 0.0, np.outer(sd, sd), 1.0)
    least = float(np.linalg.eigvalsh(correlation).min(initial=0.0))
    if least < -ALIKE * len(cov):
        raise InputError(
            f"{what} is no covariance: as correlations it has the eigenvalue {least:.4g}, which "
            "has to be 0 or more; bring what is off its diagonal nearer to 0"
        )


def given_belief(belief: object, what: str, n: int) -> Gaussian:
    """A Gaussian belief about n states."""
    if not isinstance(belief, Gaussian):
        raise InputError(f"{what} {belief!r}: takes a Gaussian, with mean and covariance")
    mean = given_each(belief.mean, f"{what}'s mean", (n,))
    return Gaussian(mean, given_covariance(belief.cov, f"{what}'s covariance", n))


def given_names(names: Sequence[str]) -> None:
    """InputError where two states share a name, or one's is no text."""
    for name in names:
        if not isinstance(name, str):
            raise InputError(f"a state's name is text, not {name!r}")
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError(f"two states of one name: {', '.join(twice)}")


def given_places(places: object, what: str, n: int) -> Index:
    """Indices of some of n states, from 0."""
    at = _array(places, what)
    fits = (at >= 0.0) & (at < n) & (at % 1.0 == 0.0)
    if np.asarray(places).dtype == bool or at.ndim != 1 or not fits.all():
        raise InputError(f"{what} {places}: takes a row of whole numbers from 0 to {n - 1}")
    return at.astype(np.intp)


def given_streams(streams: object) -> int:
    """Number of streams, 1 or more."""
    return given_count(streams, "streams")


def given_step(observed: object, streams: int) -> Array:
    """Each stream's observation in one step, (n,), NaN where there is none."""
    plain = type(observed) is np.ndarray and observed.dtype == np.float64
    values = cast(Array, observed) if plain else np.atleast_1d(given_numbers(observed, "a step"))
    if values.shape != (streams,):
        raise InputError(
            f"a step has the shape {values.shape}; give a number for each of {streams} streams"
        )
    return values


def given_rows(series: object, what: str) -> Array:
    """A series of steps x streams, (N, n), NaN where nothing was measured; (N,) is one stream."""
    rows = given_numbers(series, what)
    rows = rows[:, None] if rows.ndim == 1 else rows
    if rows.ndim != 2 or not rows.shape[1]:
        raise InputError(f"{what} is steps x streams of numbers; this has the shape {rows.shape}")
    return rows


def given_numbers(values: object, what: str) -> Array:
    """Numbers of any shape, NaN where masked."""
    held = _held(values)
    if (kind := held.dtype.kind) not in NUMBERS:
        told = HELD.get(kind, kind)
        raise InputError(f"{what} holds {told}: takes numbers, NaN where nothing was measured")
    return _numbers(held)


def as_numbers(value: object) -> Array:
    """`value` as an array, NaN where masked; a 0-d NaN where it holds no numbers."""
    return _numbers(_held(value))


def _held(value: object) -> NDArray[Any]:
    """`value` as an array, whatever it holds."""
    try:
        return np.asanyarray(value)
    except ValueError:  # rows of different lengths
        return np.empty(0, dtype=np.void)


def _numbers(held: NDArray[Any]) -> Array:
    if held.dtype.kind not in NUMBERS:
        return np.array(np.nan)
    return unmasked(held).copy()


def _array(values: object, what: str) -> Array:
    """A copy as `frozen` makes it; InputError where `values` are not numbers."""
    try:
        return frozen(unmasked(cast(ArrayLike, values)).copy())
    except (TypeError, ValueError):
        raise InputError(f"{what} {values!r}: takes numbers") from None
