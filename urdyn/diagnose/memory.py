"""The state of a diagnosis, as files: its values as a tree, its arrays beside it.

Only the dataclasses in KNOWN are made from it: a file cannot ask for anything else.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from urdyn.diagnose.fast.backlash import Reversals
from urdyn.diagnose.fast.creep import Creep
from urdyn.diagnose.fast.encoder import Unseen
from urdyn.diagnose.fast.fast import FastState
from urdyn.diagnose.fast.oscillation import Heard, Ring
from urdyn.diagnose.fast.pushed_link import Bin
from urdyn.diagnose.fast.quiet import Quiet
from urdyn.diagnose.fast.recurring import Recurred
from urdyn.diagnose.fast.ringing_line import Usual
from urdyn.diagnose.fast.sensor import Felt
from urdyn.diagnose.findings.ledger import Book
from urdyn.diagnose.job import KEPT
from urdyn.diagnose.kinds.change import Change, Push
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.load.carried import Mode, Shown
from urdyn.diagnose.load.carrying import Absence, Carrying, Waiting
from urdyn.diagnose.residual.gathering import Gathering
from urdyn.diagnose.residual.moment import Means, Pool
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.warmth import Warmth
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.learning import Learnt
from urdyn.diagnose.slow.loudness import Loudness
from urdyn.diagnose.slow.onsets import Bank, Block
from urdyn.diagnose.slow.recall import Recall
from urdyn.diagnose.slow.slow_state import LearntBy, SlowState
from urdyn.diagnose.slow.steadiness import Steadiness
from urdyn.diagnose.state import Now, State
from urdyn.errors import InputError
from urdyn.io import writing
from urdyn.signal import Instant
from urdyn.tracking.output.checkpoint import DAMAGE

KNOWN = (
    Absence, Bank, Bin, Block, Book, Carrying, Change, Creep, Fault, FastState, Felt, Finding,
    Gathering, Heard, Instant, Learnt, LearntBy, Loudness, Means, Mode, Now, Pool, Push, Quiet,
    Recall, Recurred, Reversals, Ring, Rows, Shown, SlowState, State, Steadiness, Unseen, Usual,
    Waiting, Warmth,
)  # fmt: skip
CLASSES = {kind.__name__: kind for kind in KNOWN}


class _Cell(NamedTuple):
    """Where an array is written."""

    array: NDArray[Any]  # kept alive, so that no other has its id
    name: str
    since: int  # sample at which it was written
    lasting: bool  # in the file of arrays that the sample before had as well


class Memory:
    """The files from which a run's diagnosis resumes, at either of the last two samples kept.

    Arrays of a state never change. Each is written with the first sample that has it, and, if the
    next has it as well, once more, in a file that exists for as long as it is needed.
    """

    def __init__(self, folder: Path, identity: Mapping[str, str]) -> None:
        self._folder, self._identity = folder, dict(identity)
        self._cells: dict[int, _Cell] = {}  # of the newest sample, by id
        self._needed: dict[int, set[Path]] = {}  # by each of the last two

    def keep(self, state: State, index: int) -> None:
        """Store this sample, all of it or nothing, and keep the one before."""
        # The files of a sample that is kept again are written as if for the first time.
        before = {key: cell for key, cell in self._cells.items() if cell.since != index}
        cells: dict[int, _Cell] = {}

        def place(array: NDArray[Any]) -> _Cell:
            key = id(array)
            if key not in cells:
                old, name = before.get(key), f"a{len(cells)}"
                new = _Cell(array, name, index, lasting=old is not None)
                cells[key] = old if old and old.lasting else new
            return cells[key]

        tree = json.dumps([self._identity, _tree(state, place)])
        new: dict[bool, dict[str, Any]] = {True: {}, False: {"tree": tree}}  # by whether it lasts
        for cell in cells.values():
            if cell.since == index:
                new[cell.lasting][cell.name] = cell.array
        for lasting, arrays in new.items():
            if arrays:  # none last where the sample is kept again: its old file is still needed
                with writing(self._file(index, lasting)) as stream:
                    np.savez(stream, **arrays)
        self._remember(index, cells)
        found = set(self._folder.glob(KEPT.format(index="*")))
        for stray in found.difference(*self._needed.values()):
            stray.unlink()

    def at(self, index: int) -> State:
        """The state kept at this sample.

        Raises:
            InputError: it is damaged, or of another run.
        """
        path, cells = self._file(index), dict[int, _Cell]()
        read = cache(_arrays)

        def array(name: str, since: int, lasting: bool) -> NDArray[Any]:
            value = read(self._file(since, lasting))[name]
            cells[id(value)] = _Cell(value, name, since, lasting)
            return value

        try:
            whose, tree = json.loads(str(read(path)["tree"]))
            # Another version may have stored classes that no longer exist.
            state = _value(tree, array) if whose == self._identity else None
        except DAMAGE as error:
            raise InputError(f"{path}: is damaged ({error}); start anew with --fresh") from error
        if not isinstance(state, State):
            raise InputError(f"{path}: is of another run; start anew with --fresh")
        self._remember(index, cells)
        return state

    def _remember(self, index: int, cells: dict[int, _Cell]) -> None:
        """Note the files of this sample, and of the one before until the run is stored as well."""
        lasting = {self._file(cell.since, True) for cell in cells.values() if cell.lasting}
        others = [kept for kept in self._needed.items() if kept[0] != index]
        self._needed = dict([*others[-1:], (index, {self._file(index), *lasting})])
        self._cells = cells

    def _file(self, index: int, lasting: bool = False) -> Path:
        """The file of the arrays written at a sample."""
        return self._folder / KEPT.format(index=f"{index}-lasting" if lasting else index)


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        return dict(archive)


def _tree(value: Any, place: Callable[[NDArray[Any]], _Cell]) -> Any:
    """A value in JSON's types; types that JSON lacks become lists that begin with a name."""
    if is_dataclass(value):
        assert CLASSES.get(type(value).__name__) is type(value), f"{type(value)} cannot be read"
        inner = {f.name: _tree(getattr(value, f.name), place) for f in fields(value)}
        return ["class", type(value).__name__, inner]
    match value:
        case np.ndarray():
            return ["array", *place(value)[1:]]
        case tuple() | list():
            return [type(value).__name__, [_tree(inner, place) for inner in value]]
        case Mapping():
            return ["dict", [[key, _tree(inner, place)] for key, inner in value.items()]]
        case np.generic():
            return value.item()
    return value


def _value(tree: Any, array: Callable[[str, int, bool], NDArray[Any]]) -> Any:
    match tree:
        case ["class", str(name), dict(inner)]:
            return CLASSES[name](**{key: _value(x, array) for key, x in inner.items()})
        case ["array", str(name), int(since), bool(lasting)]:
            return array(name, since, lasting)
        case ["tuple", list(inner)]:
            return tuple(_value(x, array) for x in inner)
        case ["list", list(inner)]:
            return [_value(x, array) for x in inner]
        case ["dict", list(inner)]:
            return {key: _value(x, array) for key, x in inner}
    return tree
