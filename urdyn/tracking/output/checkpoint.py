"""All that a run remembers, as a file: a killed process goes on from there.

The file is written after the history parts that it counts, each of them whole or not at all; what
a killed process leaves beyond its checkpoint is dropped and made again. So every sample counts
once.
"""

from __future__ import annotations

import json
import math
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from urdyn.errors import InputError
from urdyn.estimate.protocol import S
from urdyn.io import writing
from urdyn.tracking.belief.interest import Interest
from urdyn.tracking.belief.payload_setting import Setting
from urdyn.tracking.sources.losses import Losses
from urdyn.tracking.step.state import TrackerState
from urdyn.types import Array

FILE = "checkpoint.npz"
DAMAGE = (
    zipfile.BadZipFile, zlib.error, OSError, EOFError, LookupError, ValueError, TypeError,
    NotImplementedError, RuntimeError,
)  # fmt: skip
ANEW = "name another --out, or start anew with --fresh"

T = TypeVar("T")
Cells = Mapping[str, NDArray[Any]]
Layout = Mapping[str, Sequence[int]]  # shapes, by place in the tree


@dataclass(frozen=True, eq=False)
class Checkpoint(Generic[S]):
    """Where a run is."""

    state: TrackerState[S]
    interest: Interest
    losses: Losses
    index: int = 0  # of the next sample
    parts: int = 0  # of the history, written so far
    began: float = np.nan  # [s] stamp of the first sample
    last: float = np.nan  # [s] stamp of the newest
    ahead: float = 0.0  # [s] by which that is ahead of the robot's clock, if that was set
    setting: Setting = field(default_factory=Setting)  # of the controller


def flattened(checkpoint: Checkpoint[S]) -> tuple[Layout, Array]:
    """Its numbers, end to end, and their places and shapes."""
    cells = dict(_cells(checkpoint, "at"))
    layout = {place: list(cell.shape) for place, cell in cells.items()}
    return layout, np.concatenate([cell.ravel() for cell in cells.values()], dtype=np.float64)


def write(layout: Layout, numbers: Array, identity: Mapping[str, str], folder: Path) -> None:
    """Write DIR/checkpoint.npz; `identity`: twin, source and settings it belongs to."""
    with writing(folder / FILE) as stream:
        about = json.dumps({"identity": dict(identity), "layout": dict(layout)})
        np.savez(stream, about=about, numbers=numbers)


def load(start: Checkpoint[S], identity: Mapping[str, str], folder: Path) -> Checkpoint[S]:
    """The checkpoint in `folder`, in the form of `start`; `start` itself where there is none.

    Raises:
        InputError: it is damaged, or of another twin, source or settings.
    """
    path = folder / FILE
    if not path.exists():
        return start
    try:
        with _opened(path) as archive:
            (written, layout), numbers = _about(archive), archive["numbers"]
    except DAMAGE as error:
        raise InputError(f"{path}: is damaged ({error}); {ANEW}") from error
    if missing := identity.keys() - written.keys():
        raise InputError(f"{path}: does not say its {' and '.join(sorted(missing))}; {ANEW}")
    if other := [name for name, wanted in identity.items() if written[name] != wanted]:
        raise InputError(f"{path}: is of a run with another {' and '.join(other)}; {ANEW}")
    try:
        ends = np.cumsum([math.prod(shape) for shape in layout.values()])
        cells = np.split(numbers, ends)  # the last is empty
        places = zip(layout.items(), cells, strict=False)
        return _filled(start, {at: cell.reshape(shape) for (at, shape), cell in places}, "at")
    except DAMAGE as error:
        raise InputError(f"{path}: lacks what this run remembers ({error}); {ANEW}") from error


def whose(folder: Path) -> Mapping[str, str]:
    """The identity that the checkpoint in `folder` was written with; empty if none can be read."""
    try:
        with _opened(folder / FILE) as archive:
            return _about(archive)[0]
    except DAMAGE:
        return {}


@contextmanager
def _opened(path: Path) -> Iterator[Cells]:
    """Its arrays, each read on demand."""
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        yield archive


def _about(archive: Cells) -> tuple[dict[str, str], dict[str, Sequence[int]]]:
    """The identity, and the layout of the numbers."""
    about = json.loads(str(archive["about"]))
    return dict(about["identity"]), dict(about["layout"])


def remove(folder: Path) -> None:
    """Remove the checkpoint, and a half-written one of a killed process."""
    for path in (folder / FILE, *folder.glob(f".{FILE}.*.part")):
        path.unlink(missing_ok=True)


def _cells(value: object, place: str) -> Iterator[tuple[str, NDArray[Any]]]:
    """Every number and array in a tree of dataclasses and tuples, with its place."""
    for name, inner in _branches(value):
        yield from _cells(inner, f"{place}.{name}")
    if not isinstance(value, tuple) and not is_dataclass(value):
        yield place, np.asarray(value)


def _branches(value: object) -> list[tuple[str, Any]]:
    if is_dataclass(value):
        return [(field.name, getattr(value, field.name)) for field in fields(value)]
    return [(str(k), inner) for k, inner in enumerate(value)] if isinstance(value, tuple) else []


def _filled(form: T, cells: Cells, place: str) -> T:
    """A tree of the same form as `form`, with the numbers in `cells`."""
    filled: Any
    kind: Any = type(form)
    inner = {name: _filled(branch, cells, f"{place}.{name}") for name, branch in _branches(form)}
    if is_dataclass(form):
        filled = replace(cast(Any, form), **inner)
    elif isinstance(form, tuple):
        filled = tuple(inner.values())
    else:
        cell = cells[place]
        filled = cell.astype(form.dtype) if isinstance(form, np.ndarray) else kind(cell.item())
    return cast(T, filled)
