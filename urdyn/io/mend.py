"""Table -> Log: rows without a place in time are left out, impossible values NaN; both counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.errors import LogError
from urdyn.io import arm_clock, clock
from urdyn.io.names import CLOCKS
from urdyn.io.table import AS_NAN, LEFT_OUT, Table, merge
from urdyn.types import STANDSTILL, Array, Defect, Log, Mask, Source, frozen

UNUSABLE = 0.2  # a log that lost a larger share of its rows is refused
DISORDER = 0.1  # [-] of the steps, that go back: no clock is set so often

# Channel -> largest magnitude that any arm has shown, with much to spare.
LIMITS = {
    "target_q": 1e3,  # [rad]
    "actual_q": 1e3,
    "target_qd": 30.0,  # [rad/s]; the quickest wrist turns by 6.3
    "actual_qd": 30.0,
    "target_current": 1e3,  # [A]
    "actual_current": 1e3,
    "target_moment": 1e5,  # [N·m]
    "joint_temperatures": 1e3,  # [°C]
}
STATE = ("actual_q", "actual_qd", "actual_current")  # never all 0 at once
LIMIT = 1e30  # of everything else: a torn packet reads as 1e282


def mend(table: Table, source: Source) -> Log:
    """The rows of `table` that are a log; LogError where they are none."""
    _check_enough(table, source)
    steps = (_without_strange_stamps, _without_strays, _without_repeats, _without_copies)
    for step in (*steps, _possible, _of_an_arm):
        table = step(table, source)
        _check_enough(table, source)
    table = _on_time(_of_every_joint(table))
    late = clock.gaps(table.channels["timestamp"])
    table = _noted(table, late, "gap", "kept")
    channels = {name: frozen(values) for name, values in table.channels.items()}  # not copied
    return Log(channels.pop("timestamp"), channels, source, table.defects)


def _without_strange_stamps(table: Table, source: Source) -> Table:
    """Rows whose stamp can be in seconds; LogError where they are in another unit."""
    table = _without(table, np.isnan(table.channels["timestamp"]), "row without a stamp")
    t = table.channels["timestamp"]
    if len(t) and (told := _in_another_unit(t)):
        raise LogError(told, source.path, int(table.line[0]), "timestamp")
    return _without(table, ~clock.credible(t), "impossible stamp")


def _in_another_unit(t: Array) -> str:
    """What stamps (N,) are, and what to do; "" where they may be in seconds."""
    if clock.dated(t):
        return (
            "its stamps are dates that begin with YYYYMMDDhhmmss; write them in s, or without them "
            "say the --rate in Hz"
        )
    if unit := clock.finer(t):
        by = clock.UNITS[unit]
        return f"its stamps are {unit}; stamps are to be in s: divide them by {by:,.0f}"
    return ""


def _without_strays(table: Table, source: Source) -> Table:
    """Rows in the order of time; a clock that was set back for good counts on after a pause.

    Raises:
        LogError: rows are in no order: it was set back too often, or the recorder's with it.
    """
    t = table.channels["timestamp"]
    ordered = clock.recordings(t)
    back = np.cumsum([len(rows) for rows in ordered])[:-1]
    if len(back) > clock.OFTEN or (len(back) and np.mean(np.diff(t) < 0.0) > DISORDER):
        raise LogError(
            f"the clock goes back from {t[back[0] - 1]:.10g} s to {t[back[0]]:.10g} s; its rows "
            "are in no order: sort them by their stamps",
            source.path,
            int(table.line[back[0]]),
        )
    table = _without(table, ~np.concatenate(ordered), "stray stamp")
    back = np.cumsum([np.count_nonzero(rows) for rows in ordered])[:-1]
    if not len(back):
        return table
    t, unknown = table.channels["timestamp"], np.full(len(table), np.nan)
    received = table.channels.get("received", unknown)
    if len(early := back[clock.earlier(t, back, received)]):
        told = "the robot's clock and the recorder's go back together; name logs in order of time"
        raise LogError(told, source.path, int(table.line[early[0]]))
    pauses = clock.pauses(t, back, received)
    table.channels["timestamp"] = clock.counted_on(t, back, pauses)
    for row, pause in zip(back, pauses, strict=True):
        again = np.arange(len(table)) == row
        table = _noted(table, again, "clock set back", f"counted on {round(pause, 3):g} s later")
    return table


def _without_repeats(table: Table, source: Source) -> Table:
    """One row per stamp: the first, for a recorder that polls reads the next one half updated."""
    first = clock.leaders(table.channels["timestamp"])
    repeat = first != np.arange(len(first))
    torn = repeat.copy()
    torn[repeat] = False
    for name in table.channels.keys() - CLOCKS:
        values = table.channels[name]
        one, other = values[repeat], values[first[repeat]]
        differ = (one != other) & ~(np.isnan(one) & np.isnan(other))
        torn[repeat] |= _any(differ)
    table = _noted(table, repeat & ~torn, "repeated stamp", "kept once")
    table = _noted(table, torn, "repeated stamp with other values", LEFT_OUT)
    return table.take(~repeat) if repeat.any() else table


def _without_copies(table: Table, source: Source) -> Table:
    """One row per sample: a recorder that polls too often writes the last one under a new stamp.

    No moving joint repeats the angle, and no sensor the noise, of the row before.
    """
    if not table.channels.keys() >= set(STATE):
        return table
    same = _any(np.abs(table.channels["actual_qd"]) > STANDSTILL)
    for name in STATE:
        values = table.channels[name]
        same[1:] &= ~_any(values[1:] != values[:-1])  # NaN is unequal to NaN
    same[0] = False
    return _without(table, same, "row of the sample before", "kept once")


def _possible(table: Table, source: Source) -> Table:
    """Values that a robot can have; others become NaN, in place, for nothing else holds them."""
    silent = np.ones(len(table), dtype=bool)
    for name, values in table.channels.items():
        strange = np.abs(values) > LIMITS.get(name, LIMIT)
        if strange.any():
            values[strange] = np.nan
            rows = _any(strange)
            table = _noted(table, rows, "impossible value", AS_NAN, int(strange.sum()))
        if name not in CLOCKS:
            silent &= ~_any(~np.isnan(values))
    return _noted(table, silent, "row without values", AS_NAN)


def _of_an_arm(table: Table, source: Source) -> Table:
    """Rows but those whose state is all 0, as a recorder that has lost its robot writes."""
    if not table.channels.keys() >= set(STATE):
        return table
    zeros = ~np.any([_any(table.channels[name] != 0.0) for name in STATE], axis=0)
    if not zeros.any() or zeros.all():  # nothing but such rows: no robot was lost
        return table
    for name in table.channels.keys() & LIMITS.keys():
        table.channels[name][zeros] = np.nan
    return _noted(table, zeros, "row of zeros", AS_NAN)


def _of_every_joint(table: Table) -> Table:
    """Per-joint channels, all as wide as the widest; missing columns are NaN."""
    wide = {name: x for name, x in table.channels.items() if name in LIMITS and x.ndim == 2}
    joints = max((x.shape[1] for x in wide.values()), default=0)
    lacking = {name: joints - x.shape[1] for name, x in wide.items() if x.shape[1] < joints}
    for name, count in lacking.items():
        padding = ((0, 0), (0, count))
        table.channels[name] = np.pad(wide[name], padding, constant_values=np.nan)
    defect = Defect("missing column", sum(lacking.values()), 0, AS_NAN)
    return replace(table, defects=merge((*table.defects, defect)))


def _on_time(table: Table) -> Table:
    """Rows where the arm's own motion puts them, if their stamps scatter."""
    t, q, v = (table.channels.get(name) for name in ("timestamp", "actual_q", "actual_qd"))
    if t is None or q is None or v is None or not 2 == q.ndim == v.ndim:
        return table
    put = arm_clock.scattered(t, q, v)
    if put is None:
        return table
    table = _noted(table, put != t, "stamp that scatters", "put where the arm's motion says")
    table.channels["timestamp"] = put
    return table


def _check_enough(table: Table, source: Source) -> None:
    """LogError where too little is left to be called a log."""
    lost = [d for d in table.defects if d.remedy == LEFT_OUT or d.kind == "row without values"]
    count = sum(d.count for d in lost)
    total = len(table) + sum(d.count for d in lost if d.remedy == LEFT_OUT)
    if count > UNUSABLE * total:
        kinds = ", ".join(f"{d.count} x {d.kind}" for d in lost)
        line = min(d.line for d in lost)
        raise LogError(f"{count} of {total} rows cannot be used: {kinds}", source.path, line)
    if len(table) < 2:
        rows = "one row is" if len(table) else "no row is"
        raise LogError(f"{rows} left, a log needs two", source.path)


def _any(cells: Mask) -> Mask:
    """Rows with a cell that holds, (N,) of (N,) or (N, width)."""
    return np.asarray(cells.any(axis=tuple(range(1, cells.ndim))))


def _without(table: Table, mask: Mask, kind: str, remedy: str = LEFT_OUT) -> Table:
    """Rows where the mask does not hold; the others are counted."""
    return _noted(table, mask, kind, remedy).take(~mask) if mask.any() else table


def _noted(table: Table, mask: Mask, kind: str, remedy: str, count: int | None = None) -> Table:
    """The table with one more defect, first met in the first row of the mask."""
    if not mask.any():
        return table
    count = int(mask.sum()) if count is None else count
    defect = Defect(kind, count, int(table.line[mask.argmax()]), remedy)
    return replace(table, defects=merge((*table.defects, defect)))
