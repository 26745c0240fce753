"""A recipe: which variables one data package carries, in which order, and how they lie in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from urdyn.errors import RtdeError
from urdyn.io.rtde.fields import TYPES
from urdyn.types import Array

Rows = NDArray[np.void]  # (N,) structured: one row per package, one field per variable
Values = Mapping[str, Any]  # RTDE name -> number, or six or three of them; SI

# What identification, tracking and diagnosis read, and beside it what people need to explain a
# recording: what was commanded, how fast a program ran, and when and why the controller stopped.
DEFAULT: tuple[str, ...] = (
    "timestamp",
    *("target_q", "target_qd", "target_qdd", "target_current", "target_moment"),
    *("actual_q", "actual_qd", "actual_current", "joint_temperatures"),
    *("actual_TCP_pose", "actual_TCP_force", "actual_TCP_speed", "joint_control_output"),
    *("speed_scaling", "robot_mode", "robot_status_bits", "safety_mode", "runtime_state"),
    *("joint_mode", "payload", "payload_cog"),
)
# Older controllers do not know them.
OPTIONAL: tuple[str, ...] = ("payload", "payload_cog", "robot_status_bits")


@dataclass(frozen=True)
class Recipe:
    """Variables of a data package, as the controller accepted them."""

    names: tuple[str, ...]
    types: tuple[str, ...]  # one per name, keys of TYPES
    frequency: float = 0.0  # [Hz] of output packages; 0: inputs, sent when they change
    id: int = 0  # first byte of its packages, 1 to 255

    def __post_init__(self) -> None:
        assert len(self.names) == len(self.types), "one type a name"
        assert TYPES.keys() >= set(self.types), "types of the guide"

    @cached_property
    def dtype(self) -> np.dtype[np.void]:
        """How one package lies in memory, without header and recipe id."""
        shapes = [(TYPES[type_][0], (TYPES[type_][1],)) for type_ in self.types]
        lone = ((number, () if width == (1,) else width) for number, width in shapes)
        return np.dtype([(name, *cell) for name, cell in zip(self.names, lone, strict=True)])

    @property
    def size(self) -> int:
        """Bytes of one package, without header and recipe id."""
        return self.dtype.itemsize

    def pack(self, values: Values) -> bytes:
        """One package; 0 for a variable that `values` lacks."""
        row = np.zeros((), self.dtype)
        for name in self.names:
            if name in values:
                _put(row, name, values[name])
        return row.tobytes()

    def rows(self, packages: bytes) -> Rows:
        """Packages laid end to end, one row each."""
        return np.frombuffer(packages, self.dtype)

    def unpack(self, package: bytes) -> dict[str, Any]:
        """RTDE name -> number, or float array of six or three, of one package."""
        row = self.rows(package)[0]
        return {
            name: row[name].item() if not row[name].shape else row[name].astype(np.float64)
            for name in self.names
        }


def channels(rows: Rows) -> dict[str, Array]:
    """RTDE name -> (N,) or (N, width): the rows as channels of a log."""
    return {name: rows[name].astype(np.float64) for name in rows.dtype.names or ()}


def _put(row: NDArray[np.void], name: str, value: Any) -> None:
    """Write one variable of a package."""
    try:
        row[name] = value
    except (ValueError, TypeError, OverflowError) as error:
        told = f"{name} cannot be sent as {row.dtype[name]}: {error}"
        raise RtdeError(told) from error
