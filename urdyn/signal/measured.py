"""A recording as far as its sensors can have measured it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.errors import LogError
from urdyn.signal.channels import ever_in_contact, ever_undriven, noted
from urdyn.signal.stretches import median_step
from urdyn.signal.stuck import without_stuck
from urdyn.signal.torn import without_torn
from urdyn.types import Log, Mask


def measured(log: Log) -> Log:
    """The log with NaN for what no sensor measured, each kind counted.

    Angles and velocities of a stuck sensor, single ones that are out of reach of the rows beside
    them, and currents of an arm that does not move itself, or works in contact. Of rows with one
    stamp the first is kept. LogError where no current is left.
    """
    return without_torn(without_stuck(_without_contact(_without_undriven(_without_repeats(log)))))


def _without_undriven(log: Log) -> Log:
    """The log without currents where a hand moves the arm, or its drives have no power."""
    return _without_currents(log, ever_undriven(log), "moved by hand or without power")


def _without_contact(log: Log) -> Log:
    """The log without currents where the arm works in contact."""
    return _without_currents(log, ever_in_contact(log), "in contact")


def _without_currents(log: Log, where: Mask, why: str) -> Log:
    """The log without currents in some rows (N,), counted; LogError if no other has any."""
    if not where.any() or "actual_current" not in log:
        return log
    current = np.where(where[:, None], np.nan, log.joint("actual_current"))
    if not np.isfinite(current).any() and np.isfinite(log.joint("actual_current")).any():
        told = f"no current is left without those of an arm {why}: they do not tell it"
        raise LogError(told, log.source.path, column="actual_current")
    kind, count = f"sample of an arm {why}", int(np.count_nonzero(where))
    defects = noted(log, kind, count, "taken without its currents")
    return replace(log, channels={**log.channels, "actual_current": current}, defects=defects)


def _without_repeats(log: Log) -> Log:
    """One row per stamp, as in a live twin; the log itself where most rows are repeats."""
    again = np.diff(log.t, prepend=-np.inf) == 0.0
    if not again.any() or median_step(log.t) == 0.0:
        return log
    channels = {name: values[~again] for name, values in log.channels.items()}
    defects = noted(log, "repeated stamp", int(np.count_nonzero(again)), "kept once")
    return replace(log, t=log.t[~again], channels=channels, defects=defects)
