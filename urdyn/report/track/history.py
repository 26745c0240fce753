"""The history of a tracked run, finished or not, read a column at a time: days are long."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from urdyn.errors import LogError
from urdyn.io.run_folder import HISTORY, PARTS
from urdyn.io.spans import Clock, clock
from urdyn.types import NORMAL90, Array, Mask

SD = ".sd"  # after the name of a quantity: the column of its standard deviation
GROSS = 0.01  # [-] of the rows, whose surprise counts as gross errors, not as misfit
EXPLAINED = 2.0  # [s] before a change is reported, in which it may have happened
PAYLOAD = "payload"
GROUP = 100  # parts whose rows are compressed together
PREFIX = "urdyn."  # before the keys of metadata


@dataclass(frozen=True, eq=False)
class Series:
    """One quantity over time, where it is known."""

    owner: str  # joint, link or "payload"
    quantity: str
    unit: str
    t: Array  # (N,) [s] since the run began
    mean: Array  # (N,) [unit]
    sd: Array  # (N,) [unit]

    @property
    def half(self) -> Array:
        """Half width of the 90 % interval, (N,) [unit]."""
        return NORMAL90 * self.sd


@dataclass(frozen=True)
class History:
    """The history of one robot, in one file or in the parts of a run that has not ended."""

    files: tuple[Path, ...]
    finished: bool = True
    written: float = np.nan  # [s] since 1970, of the newest of them

    @cached_property
    def start(self) -> float:
        """The first stamp [s]."""
        t = self.column("t")
        if not len(t):
            raise LogError("holds no reading yet; track a longer log")
        return float(t[0])

    @cached_property
    def t(self) -> Array:
        """Time since the run began, (N,) [s]."""
        return self.column("t") - self.start

    @cached_property
    def clock(self) -> Clock:
        """The unit of its time."""
        return clock(float(self.t[-1]))

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Base first."""
        joints = self._owners(lambda owner, quantity: quantity == "coulomb")
        if not joints:
            raise LogError("its history knows of no joint; track with this version")
        return joints

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Base first."""
        return self._owners(lambda owner, quantity: quantity == "mass" and owner != PAYLOAD)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self._schema.names)

    def column(self, name: str) -> Array:
        """A column, (N,)."""
        if name not in self.names:
            raise LogError(f"its history has no column {name!r}; track with this version")
        try:
            table = self._file.read([name], use_threads=False)
        except (pa.ArrowException, OSError) as error:
            raise _broken(error) from error
        return np.asarray(table.column(name).to_numpy(), dtype=float)

    def series(self, owner: str, quantity: str) -> Series:
        """A quantity on the rows where it is known."""
        name = f"{owner}.{quantity}"
        mean, sd = self.column(name), self.column(name + SD)
        known = np.isfinite(mean) & np.isfinite(sd)
        if not known.any():
            raise LogError(f"knows nothing of {name}; track a longer log")
        unit = self._told("units").get(name, "-")
        return Series(owner, quantity, str(unit), self.t[known], mean[known], sd[known])

    def holds(self, owner: str, quantity: str) -> bool:
        """Whether a quantity was tracked."""
        return f"{owner}.{quantity}" in self.names

    def currents(self, joint: str) -> tuple[Array, Array]:
        """Measured and predicted current of a joint, (N,) each [A]; NaN where not compared."""
        j = self.joints.index(joint)
        return self.column(f"current_{j}"), self.column(f"predicted_{j}")

    def seen(self, joint: str) -> bool:
        """Whether a current of a joint was compared, so that anything was learnt about it."""
        current, predicted = self.currents(joint)
        return bool(np.isfinite(current - predicted).any())

    @cached_property
    def surprise(self) -> float:
        """Normalised innovation squared per measured current, 1 expected; NaN: none was compared.

        The mean without the most surprising rows: on a real arm a few hold gross errors, which a
        filter gives little weight, and one can be as large as all others together.
        """
        measured, nis = self.column("measured"), self.column("nis")
        told = (measured > 0) & self.unexplained
        if not told.any():
            return np.nan
        each = nis[told] / measured[told]
        usual = each <= np.quantile(each, 1.0 - GROSS)
        return float(nis[told][usual].sum() / measured[told][usual].sum())

    @cached_property
    def unexplained(self) -> Mask:
        """Rows whose surprise no change explains, (N,).

        In the seconds before a payload change is reported, that change is the cause.
        """
        changes = self.t[self.column("widened") > 0]
        next_one = np.append(changes, np.inf)[np.searchsorted(changes, self.t)]
        return np.asarray(next_one - self.t > EXPLAINED)

    @cached_property
    def provenance(self) -> Mapping[str, Any]:
        """What the run was made from; empty where not known yet."""
        return dict(self._told("provenance"))

    @property
    def source(self) -> str:
        """What was tracked, as its user named it; "" where not known yet."""
        return str(self.provenance.get("source", ""))

    @cached_property
    def _file(self) -> pq.ParquetFile:
        """Kept open, since the metadata of a day's row groups takes long to read."""
        try:
            return _opened(self.files[0]) if len(self.files) == 1 else _joined(self.files)
        except (pa.ArrowException, OSError) as error:
            raise _broken(error) from error

    @property
    def _schema(self) -> Any:
        """Columns and metadata, as Arrow knows them."""
        return self._file.schema_arrow

    def _told(self, key: str) -> Mapping[str, Any]:
        """The project's own metadata."""
        metadata = self._schema.metadata or {}
        try:
            return dict(json.loads(metadata.get(f"{PREFIX}{key}".encode(), b"{}")))
        except (ValueError, TypeError) as error:
            raise _broken(error) from error

    def _owners(self, wanted: Callable[[str, str], bool]) -> tuple[str, ...]:
        names = (name.rpartition(".") for name in self.names if name + SD in self.names)
        return tuple(owner for owner, _, quantity in names if wanted(owner, quantity))


def find_history(folder: Path) -> History:
    """The newest history in a track folder: its parts, until they are all in the whole.

    Raises:
        LogError: there is none, or it is damaged; the reason, without the folder's name.
    """
    if not folder.is_dir():
        raise LogError("is no folder" if folder.exists() else "does not exist")
    whole, parts = folder / HISTORY, sorted((folder / PARTS).glob("part-*.parquet"))
    # A live run was resumed, or has not ended; by its stamps, for a copy may lose the files' times.
    if parts and not (whole.is_file() and _end(whole) == _end(parts[-1])):
        return History(tuple(parts), False, parts[-1].stat().st_mtime)
    if whole.is_file():
        return History((whole,), True, whole.stat().st_mtime)
    if (folder / PARTS).is_dir() or any(folder.glob("checkpoint.npz")):
        raise LogError("its run has not written anything yet; wait, or track on")
    if any(folder.glob(f"*/{HISTORY}")):
        raise LogError(f"holds no {HISTORY}, but folders that do: name those")
    raise LogError(f"holds no {HISTORY}; `urdyn track` writes one")


def _end(path: Path) -> float:
    """Last stamp in a file of a history [s]."""
    try:
        file = _opened(path)
        rows = file.read_row_group(file.num_row_groups - 1, ["t"], use_threads=False)
        return float(rows.column("t")[-1].as_py())
    except (pa.ArrowException, OSError, LookupError) as error:
        raise _broken(error) from error


def _opened(path: Path) -> pq.ParquetFile:
    """Open a file by the bytes of its name, which may not be valid text."""
    return pq.ParquetFile(pa.OSFile(os.fsencode(path)))


def _joined(paths: Sequence[Path]) -> pq.ParquetFile:
    """Parts as one file, which lasts as long as it is open.

    They are many and small, and each is opened once: opening takes as long as reading.
    """
    with NamedTemporaryFile() as whole:
        schema = _opened(paths[0]).schema_arrow
        with pq.ParquetWriter(whole, schema, compression="zstd", use_dictionary=False) as writer:
            for k in range(0, len(paths), GROUP):
                parts = [_opened(path).read(use_threads=False) for path in paths[k : k + GROUP]]
                writer.write_table(pa.concat_tables(parts).combine_chunks())
        whole.flush()
        return _opened(Path(whole.name))


def _broken(error: Exception) -> LogError:
    return LogError(f"its history cannot be read ({str(error).splitlines()[0]}); track again")
