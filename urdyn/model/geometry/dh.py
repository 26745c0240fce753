"""UR's own numbers: Denavit-Hartenberg deltas, as the controller's calibration has them.

    T = Rz(theta) Tz(d) Tx(a) Rx(alpha)    of each joint [Denavit1955]_

Axes that are meant to be parallel have their common normal anywhere: its d is metres and more, and
only the sum along the run is meaningful.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.model.geometry.canonical import coordinates
from urdyn.model.geometry.hayati import Form
from urdyn.model.geometry.turns import places_of
from urdyn.types import Array, freeze


@dataclass(frozen=True, eq=False)
class Deltas:
    """What a controller adds to the drawing, base first."""

    theta: Array  # (J,) [rad]
    d: Array  # (J,) [m]
    a: Array  # (J,) [m]
    alpha: Array  # (J,) [rad]

    def __post_init__(self) -> None:
        freeze(self, "theta", "d", "a", "alpha")


def deltas_of(form: Form, table: Array) -> Deltas:
    """The deltas of an arm with a ... theta `table` (J, 5)."""
    crossed = np.array(form.free)
    crossed[:, 2] = False
    rows = coordinates(replace(form, free=crossed), places_of(table))
    off = rows - form.nominal
    # UR's a and alpha of a joint are those behind it; behind the last is the tool.
    behind = np.vstack([off[1:, :2], np.zeros(2)])
    return Deltas(off[:, 4], off[:, 3], behind[:, 0], behind[:, 1])
