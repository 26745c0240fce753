"""The estimated state of an arm at one moment, as listeners receive it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Estimates with their sd by part and quantity, in SI units."""

    robot: str
    stamp: int  # [ns] of the newest sample in it, by the robot's clock
    samples: int  # that are in it
    joints: tuple[str, ...]
    mean: Mapping[str, Mapping[str, float]]  # "elbow_joint" -> "coulomb" -> value
    sd: Mapping[str, Mapping[str, float]]
    units: Mapping[str, str]  # quantity -> unit
    predicted: Array  # (J,) [N·m] joint torque by the belief before the sample; NaN: unknown
    residual: Array  # (J,) [N·m] measured less predicted
    com: Array  # (3,) [m] of the payload, at the flange; NaN: it weighs nothing
    scales: Array  # (2, J) [-] viscous and Coulomb friction relative to commissioning
    delay: float = 0.0  # [s] from that sample's arrival to its processing; 0: recorded
