"""UR's own numbers read back, as a controller does."""

from __future__ import annotations

import numpy as np

from urdyn.model.geometry.canonical import coordinates
from urdyn.model.geometry.dh import Deltas
from urdyn.model.geometry.hayati import Form
from urdyn.model.geometry.turns import places_of
from urdyn.types import Array


def table_of(form: Form, deltas: Deltas) -> Array:
    """a ... theta (J, 5) of an arm with UR's `deltas`; those behind the last joint must be zero."""
    rows = np.array(form.nominal)
    rows[1:, 0] += deltas.a[:-1]
    rows[1:, 1] += deltas.alpha[:-1]
    rows[:, 3] += deltas.d
    rows[:, 4] += deltas.theta
    return coordinates(form, places_of(rows))
