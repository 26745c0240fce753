"""The history of a tracked run, read a column at a time: an hour holds millions of rows."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from urdyn.errors import LogError
from urdyn.report.digits import NORMAL90, number
from urdyn.types import Array

SD = ".sd"  # after the name of a quantity: the column of its standard deviation
PAYLOAD = "payload"
PREFIX = "urdyn."  # before the keys of metadata
SPANS = ((600.0, 1.0, "s"), (3 * 3600.0, 60.0, "min"), (72 * 3600.0, 3600.0, "h"))


@dataclass(frozen=True)
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
class Clock:
    """The unit in which a run's time reads well."""

    seconds: float  # [s] in one unit
    unit: str

    def __call__(self, t: float) -> str:
        """A moment, as words."""
        return f"{number(round(t / self.seconds, 2), 3)} {self.unit}"

    @property
    def axis(self) -> str:
        """Title of an axis of time."""
        return f"time [{self.unit}]"


def clock(span: float) -> Clock:
    """The unit for times up to `span` [s]."""
    return next((Clock(s, unit) for end, s, unit in SPANS if span < end), Clock(86400.0, "d"))


@dataclass(frozen=True)
class History:
    """A run's Parquet file."""

    path: Path

    @cached_property
    def _file(self) -> pq.ParquetFile:
        """Open, since what a day's file says of its groups of rows takes long to read."""
        return pq.ParquetFile(self.path)

    @property
    def schema(self) -> Any:
        """Columns and metadata, as Arrow knows them."""
        return self._file.schema_arrow

    @property
    def columns(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self.schema.names)

    @cached_property
    def start(self) -> float:
        """The first stamp [s]."""
        t = self.column("t")
        if not len(t):
            raise LogError("the run holds no reading; track a longer log", self.path)
        return float(t[0])

    @cached_property
    def t(self) -> Array:
        """Time since the run began, (N,) [s]."""
        return self.column("t") - self.start

    @cached_property
    def clock(self) -> Clock:
        """How to tell its time."""
        return clock(float(self.t[-1]))

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Base first."""
        return self._owners(lambda owner, quantity: quantity == "coulomb")

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Base first."""
        return self._owners(lambda owner, quantity: quantity == "mass" and owner != PAYLOAD)

    def column(self, name: str) -> Array:
        """A column, (N,)."""
        table = self._file.read(columns=[name], use_threads=False)
        return np.asarray(table.column(name).to_numpy(), dtype=float)

    def series(self, owner: str, quantity: str) -> Series:
        """A quantity on the rows where it is known."""
        name = f"{owner}.{quantity}"
        mean, sd = self.column(name), self.column(name + SD)
        told = np.isfinite(mean) & np.isfinite(sd)
        return Series(
            owner, quantity, self._units.get(name, "-"), self.t[told], mean[told], sd[told]
        )

    def holds(self, owner: str, quantity: str) -> bool:
        """Whether a quantity was tracked."""
        return f"{owner}.{quantity}" in self.columns

    def currents(self, joint: str) -> tuple[Array, Array]:
        """Measured and predicted current of a joint, (N,) each [A]; NaN where not compared."""
        j = self.joints.index(joint)
        return self.column(f"current_{j}"), self.column(f"predicted_{j}")

    @cached_property
    def provenance(self) -> Mapping[str, Any]:
        """What the run was made of, as its writer told."""
        return dict(self._told("provenance"))

    @cached_property
    def _units(self) -> Mapping[str, str]:
        return {str(name): str(unit) for name, unit in self._told("units").items()}

    def _told(self, key: str) -> Mapping[str, Any]:
        """The project's own metadata."""
        metadata = self.schema.metadata or {}
        told: Mapping[str, Any] = json.loads(metadata.get(f"{PREFIX}{key}".encode(), b"{}"))
        return told

    def _owners(self, wanted: Callable[[str, str], bool]) -> tuple[str, ...]:
        names = (name.rpartition(".") for name in self.columns if name + SD in self.columns)
        return tuple(owner for owner, _, quantity in names if wanted(owner, quantity))
