"""What a track folder holds, finished or not: the columns that a fleet is judged by."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from urdyn.errors import LogError
from urdyn.report.track_history import PREFIX, SD, Series
from urdyn.types import Array

FILE, PARTS = "history.parquet", "history.parts"


@dataclass(frozen=True)
class Run:
    """The history of one robot, in one file or in the parts of a run that has not ended."""

    files: tuple[Path, ...]
    finished: bool
    written: float  # [s] since 1970, when the newest of them was

    @cached_property
    def t(self) -> Array:
        """Time since the run began, (N,) [s]."""
        t = self.column("t")
        if not len(t):
            raise LogError("holds no reading yet; track on")
        return np.asarray(t - t[0])

    @property
    def start(self) -> float:
        """The first stamp [s]."""
        return float(self.column("t")[0])

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Base first."""
        end = ".coulomb"
        names = (name for name in self._schema.names if f"{name}{SD}" in self._schema.names)
        joints = tuple(name.removesuffix(end) for name in names if name.endswith(end))
        if not joints:
            raise LogError("its history knows of no joint; track with this version")
        return joints

    def series(self, joint: str, quantity: str) -> Series:
        """A quantity of a joint on the rows where it is known."""
        name = f"{joint}.{quantity}"
        mean, sd = self.column(name), self.column(name + SD)
        told = np.isfinite(mean) & np.isfinite(sd)
        if not told.any():
            raise LogError(f"knows nothing of {name}; track a longer log")
        return Series(joint, quantity, "", self.t[told], mean[told], sd[told])

    @cached_property
    def surprise(self) -> float:
        """Normalised innovation squared a measured current, 1 expected; NaN: none was compared."""
        measured, nis = self.column("measured"), self.column("nis")
        told = measured > 0
        return float(nis[told].sum() / measured[told].sum()) if told.any() else np.nan

    @cached_property
    def provenance(self) -> dict[str, str]:
        """What it was made of; nothing where the run has not said so yet."""
        told = (self._schema.metadata or {}).get(f"{PREFIX}provenance".encode(), b"{}")
        try:
            return {str(key): str(value) for key, value in json.loads(told).items()}
        except (ValueError, AttributeError) as error:
            raise _broken(error) from error

    @property
    def source(self) -> str:
        """What was tracked, as its user named it; "" where nobody has said so yet."""
        return self.provenance.get("source", "")

    def column(self, name: str) -> Array:
        """A column, (N,)."""
        if name not in self._schema.names:
            raise LogError(f"its history has no column {name!r}; track with this version")
        try:
            tables = [pq.ParquetFile(file).read([name], use_threads=False) for file in self.files]
        except (pa.ArrowException, OSError) as error:
            raise _broken(error) from error
        whole = [np.asarray(table.column(name).to_numpy(), dtype=float) for table in tables]
        return np.concatenate(whole)

    @cached_property
    def _schema(self) -> pa.Schema:
        try:
            return pq.read_schema(self.files[0])
        except (pa.ArrowException, OSError) as error:
            raise _broken(error) from error


def find_run(folder: Path) -> Run:
    """The newest history in a track folder.

    Raises:
        LogError: there is none; the reason, without the folder's name.
    """
    if not folder.is_dir():
        raise LogError("is no folder" if folder.exists() else "does not exist")
    whole, parts = folder / FILE, sorted((folder / PARTS).glob("part-*.parquet"))
    since = whole.stat().st_mtime if whole.is_file() else -np.inf
    until = parts[-1].stat().st_mtime if parts else -np.inf
    if until > since:  # a live robot was taken up again, or has never been left
        return Run(tuple(parts), False, until)
    if whole.is_file():
        return Run((whole,), True, since)
    if (folder / PARTS).is_dir() or any(folder.glob("checkpoint.npz")):
        raise LogError("its run has not written anything yet; wait, or track on")
    if any(folder.glob(f"*/{FILE}")):
        raise LogError(f"holds no {FILE}, but folders that do: name those")
    raise LogError(f"holds no {FILE}; `urdyn track` writes one")


def _broken(error: Exception) -> LogError:
    return LogError(f"its history cannot be read ({str(error).splitlines()[0]}); track again")
