"""A recording as far as its sensors can have measured it."""

from __future__ import annotations

from urdyn.signal.stuck import without_stuck
from urdyn.signal.torn import without_torn
from urdyn.types import Log


def measured(log: Log) -> Log:
    """The log with NaN for angles and velocities that no sensor measured, each kind counted.

    Those of one that is stuck, and single ones that are out of reach of the rows beside them.
    """
    return without_torn(without_stuck(log))
