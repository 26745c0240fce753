"""The values that pass between rooms: frozen, read-only, shape-checked, SI, time first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any, TypeVar, cast

import numpy as np
from numpy.ma import MaskedArray
from numpy.typing import ArrayLike, NDArray

from urdyn.errors import InputError, LogError

V = TypeVar("V")

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]
Which = slice | Index  # rows, by their range or one by one

NORMAL90 = 1.645  # [sd] of a Gaussian: 90 % lies within this of the mean, 95 % below it
MAD_TO_SD = 1.4826  # [-] sd of a Gaussian per median absolute deviation: 1 / Φ⁻¹(3/4)
STANDSTILL = 0.02  # [rad/s] velocity that a joint at rest may report


def changed(value: V, **changes: Any) -> V:
    """A frozen value with other fields: `replace` for tight loops, in a quarter of its time.

    `__post_init__` does not run: the new fields are not checked.
    """
    had, new = vars(value), object.__new__(type(value))
    names: tuple[str, ...] = cast(Any, value).__match_args__
    if len(had) > len(names):  # cached values belong to the old one
        had = {name: had[name] for name in names}
    vars(new).update(had, **changes)
    return new


def remade(value: Any) -> tuple[Any, ...]:
    """The `__reduce__` of a value: a copy, in another process too, is made by its constructor.

    Arrays that pickle makes by itself are writable.
    """
    had = (getattr(value, name) for name in value.__match_args__)
    return type(value), tuple(dict(x) if isinstance(x, MappingProxyType) else x for x in had)


def unmasked(values: ArrayLike) -> Array:
    """`values` as a float64 array, NaN where masked; the caller's own array where it is one."""
    if isinstance(values, MaskedArray):
        return np.asarray(np.ma.filled(values.astype(np.float64), np.nan))
    return np.asarray(values, dtype=np.float64)


def frozen(values: ArrayLike) -> Array:
    """`values` as a read-only float64 array, NaN where masked; the caller's stays writable."""
    array = unmasked(values).view()
    array.flags.writeable = False
    return array


def freeze(value: Any, *names: str) -> None:
    """Make these fields of a value, all if none is named, `frozen` arrays; for `__post_init__`."""
    for name in names or value.__match_args__:
        object.__setattr__(value, name, frozen(getattr(value, name)))


def owned(values: ArrayLike) -> Array:
    """`values` as `frozen` makes them; a copy, unless they are read-only already.

    A read-only view of an array that is written to later is not copied either: logs of an hour are
    assembled this way.
    """
    array = unmasked(values)
    return frozen(array.copy() if array.flags.writeable else array)


def shaped(what: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """`values` as `frozen` makes them; InputError where they have another shape."""
    array = frozen(values)
    if array.shape != shape:
        raise InputError(f"{what} has the shape {array.shape}; here it has to be {shape}")
    return array


def index_of(name: str, names: Sequence[str], what: str) -> int:
    """Index of `name` in `names`; InputError, with what may be meant, where it is missing."""
    if name in names:
        return names.index(name)
    close = get_close_matches(str(name), names, 1)
    hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"
    raise InputError(f"no {what} {name}; {hint}")


@dataclass(frozen=True)
class Source:
    """Where a value came from, so that anyone can check it."""

    path: str = ""  # as the user named it
    sha256: str = ""  # of the file's bytes
    rows: tuple[int, int] | None = None  # half-open slice of its data rows; None: all


@dataclass(frozen=True)
class Defect:
    """One kind of damage that reading met and mended or left out, counted."""

    kind: str  # "truncated row", "repeated stamp", "gap", ...
    count: int
    line: int  # first line of the file that shows it, from 1; 0 where no line applies
    remedy: str  # what was done: "left out", "kept as NaN", ...

    def __str__(self) -> str:
        where = f", first in line {self.line}" if self.line else ""
        return f"{self.count} x {self.kind} ({self.remedy}{where})"


@dataclass(frozen=True, eq=False)
class Log:
    """What the robot said, untouched: RTDE names, SI units, NaN where it said nothing."""

    t: Array  # (N,) [s], increasing; a recorder may have written one twice
    channels: Mapping[str, Array]  # RTDE name -> (N,) or (N, width)
    source: Source = field(default_factory=Source)
    defects: tuple[Defect, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", owned(self.t))
        channels = {name: owned(values) for name, values in self.channels.items()}
        object.__setattr__(self, "channels", MappingProxyType(channels))
        if self.t.ndim != 1:
            raise InputError(f"t has the shape {self.t.shape}; time is one axis")
        onward = np.diff(self.t) >= 0.0
        if not onward.all():
            back = int(np.argmin(onward)) + 1
            told = f"stamps have to increase; that of row {back} does not"
            raise LogError(told, self.source.path)
        for name, values in channels.items():
            if values.shape[:1] != self.t.shape:
                raise InputError(f"{name} has the shape {values.shape}; t has {len(self)} rows")
        q = channels.get("actual_q")
        if q is not None and q.ndim != 2:
            told = f"actual_q has the shape {q.shape}; it has to be rows x joints"
            raise LogError(told, self.source.path)

    __reduce__ = remade

    def __len__(self) -> int:
        return len(self.t)

    def __contains__(self, name: str) -> bool:
        return name in self.channels

    @property
    def joints(self) -> int:
        """Number of joints in the log; 6 where it has no joint angles."""
        return int(self.channels["actual_q"].shape[1]) if "actual_q" in self.channels else 6

    def joint(self, name: str) -> Array:
        """Per-joint channel, (N, J); NaN throughout where the log does not have it."""
        if name in self.channels:
            return self.channels[name]
        return frozen(np.full((len(self), self.joints), np.nan))

    def slice(self, start: int, stop: int | None = None) -> Log:
        """Rows start:stop as a log of its own; a view, nothing is copied."""
        rows = slice(start, stop)
        begin = self.source.rows[0] if self.source.rows else 0
        first, last, _ = rows.indices(len(self))
        return replace(
            self,
            t=self.t[rows],
            channels={name: values[rows] for name, values in self.channels.items()},
            source=replace(self.source, rows=(begin + first, begin + max(first, last))),
        )


# A Motion's fields per joint, (N, J).
JOINT_SERIES = ("q", "v", "a", "jerk", "current", "temperature", "shift", "instrument")


@dataclass(frozen=True, eq=False)
class Motion:
    """What we made of a log: joint kinematics at the stamps of the measured current.

    Stamps increase, except where the clock of a robot at work is set back. They are uniform within
    a stretch once `synchronise` has run, else as the robot gave them, because resampling colours
    the noise that the likelihood needs white.
    """

    t: Array  # (N,) [s]
    q: Array  # (N, J) [rad]
    v: Array  # (N, J) [rad/s]
    a: Array  # (N, J) [rad/s²]
    jerk: Array  # (N, J) [rad/s³]
    current: Array  # (N, J) [A], as measured; NaN where not
    temperature: Array  # (N, J) [°C]; NaN where not measured
    breaks: tuple[int, ...] = ()  # rows that begin a new stretch after a gap, 0 not among them
    source: Source = field(default_factory=Source)
    # (N, J) [rad] jump of the encoder's zero since the row before; (0, 0) where not given.
    shift: Array = field(default_factory=lambda: np.zeros((0, 0)))
    # (N, J) [rad/s²] the acceleration without vibrations or the noise of `a`; NaN where unknown.
    instrument: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        if not self.shift.size:
            object.__setattr__(self, "shift", np.zeros_like(self.q))
        if not self.instrument.size:
            object.__setattr__(self, "instrument", np.full_like(self.q, np.nan))
        object.__setattr__(self, "t", owned(self.t))
        shape = len(self), *np.shape(self.q)[1:]
        for name in JOINT_SERIES:
            object.__setattr__(self, name, shaped(name, owned(getattr(self, name)), shape))
        if not all(0 < row < len(self) for row in self.breaks):
            raise InputError(f"breaks {self.breaks}: takes rows from 1 to {len(self) - 1}")

    __reduce__ = remade

    def __len__(self) -> int:
        return len(self.t)

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def instrumental(self) -> Array:
        """The instrument's acceleration, (N, J) [rad/s²]; `a` where it is unknown."""
        return np.where(np.isnan(self.instrument), self.a, self.instrument)

    @property
    def step(self) -> Array:
        """Time since the row before, (N,) [s]; 0 in the first row of every stretch."""
        step = np.diff(self.t, prepend=self.t[:1])
        step[list(self.breaks)] = 0.0
        return step

    def ahead(self, offset: float) -> Motion:
        """The same currents beside the kinematics `offset` seconds later, by Taylor's series.

        The instrument is not shifted, for the jerk would add the noise of `a` to it.
        """
        h = offset
        return replace(
            self,
            q=self.q + h * (self.v + h / 2 * (self.a + h / 3 * self.jerk)),
            v=self.v + h * (self.a + h / 2 * self.jerk),
            a=self.a + h * self.jerk,
        )

    def slice(self, start: int, stop: int | None = None) -> Motion:
        """Rows start:stop as a motion of its own; a view, nothing is copied."""
        first, last, _ = slice(start, stop).indices(len(self))
        breaks = tuple(b - first for b in self.breaks if first < b < last)
        return self.rows(slice(first, last), breaks)

    def rows(self, kept: Which, breaks: tuple[int, ...]) -> Motion:
        """Some rows as a motion of its own; `breaks` are those that begin a new stretch there."""
        series = {name: getattr(self, name)[kept] for name in ("t", *JOINT_SERIES)}
        return replace(self, **series, breaks=breaks)


@dataclass(frozen=True, eq=False)
class Parameters:
    """A vector that is never parted from its names and units."""

    values: Array  # (P,)
    names: tuple[str, ...]  # "elbow_joint.coulomb", "forearm_link.mass", ...
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", shaped("values", owned(self.values), (len(self.names),)))
        if len(self.units) != len(self.names):
            raise InputError(f"{len(self.names)} names, {len(self.units)} units; one of each")
        if len(set(self.names)) < len(self.names):
            raise InputError("two parameters of one name")

    __reduce__ = remade

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, name: str) -> float:
        return float(self.values[index_of(name, self.names, "parameter")])


@dataclass(frozen=True, eq=False)
class Gaussian:
    """A belief: mean and covariance, read-only here; callers must not change the given arrays.

    They are not copied, since filters make two in a step; a model's priors are copies.
    """

    mean: Array  # (P,)
    cov: Array  # (P, P)

    def __post_init__(self) -> None:
        freeze(self, "mean")
        if self.mean.ndim != 1:
            raise InputError(f"mean has the shape {self.mean.shape}; it has to be a row of numbers")
        object.__setattr__(self, "cov", shaped("cov", self.cov, self.mean.shape * 2))

    __reduce__ = remade

    @property
    def sd(self) -> Array:
        """Marginal standard deviations, (P,)."""
        return np.sqrt(np.diag(self.cov))
