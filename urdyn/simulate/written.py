"""A motion in few numbers, as in excitation.toml: a Fourier series, or moves.

[motion]
duration = 20.0                 # [s]
rate = 500.0                    # [Hz] at which it is sent to the robot
period = 19.998                 # [s]
middle = [...]                  # [rad] per joint
sine = [[...], ...]             # [rad] one row per harmonic
cosine = [[...], ...]
[[motion.move]]                 # in place of the series: begin, duration [s], start, goal [rad],
                                # ramp [-], share of its time in which it gathers speed
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io import load_toml
from urdyn.simulate.fourier import Series
from urdyn.simulate.moves import RAMP, Move, Moves
from urdyn.simulate.trajectory import Trajectory, blocks
from urdyn.types import Array

LONGEST = 3600.0  # [s] longest motion in a file
FASTEST = 1000.0  # [Hz]


def motion_document(path: Series | Moves, duration: float, rate: float) -> dict[str, Any]:
    """The table [motion]."""
    head: dict[str, Any] = {"duration": duration, "rate": rate}
    if isinstance(path, Series):
        series = {"middle": path.middle, "sine": path.sine, "cosine": path.cosine}
        return head | {"period": path.period} | series
    moves = [
        {"begin": m.begin, "duration": m.duration, "start": m.start, "goal": m.goal, "ramp": m.ramp}
        for m in path.moves
    ]
    return head | {"move": moves}


def read_motion(file: str | Path, joints: int) -> tuple[Series | Moves, float, float]:
    """The motion in a file, its duration [s] and rate [Hz]; InputError where there is none."""
    try:
        table = load_toml(file).get("motion")
        if not isinstance(table, dict):
            raise InputError("no [motion] in it; write it with `urdyn excite`")
        return _motion(table, joints)
    except InputError as error:
        raise InputError(f"{file}: {str(error).removeprefix(f'{file}: ')}") from None


def _motion(table: Mapping[str, Any], joints: int) -> tuple[Series | Moves, float, float]:
    duration = _number(table, "duration", LONGEST)
    rate = _number(table, "rate", FASTEST)
    if "move" in table:
        return Moves(tuple(_moves(table["move"], joints, duration)), duration), duration, rate
    sine, cosine = (_rows(table, key, joints) for key in ("sine", "cosine"))
    if len(sine) != len(cosine) or not 2 <= len(sine) <= 1000:
        raise InputError("[motion] sine and cosine: are to have a row for each harmonic")
    middle = _rows({"middle": [table.get("middle")]}, "middle", joints)[0]
    return Series(middle, sine, cosine, _number(table, "period", LONGEST)), duration, rate


def _moves(tables: Any, joints: int, duration: float) -> list[Move]:
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputError("[[motion.move]]: is to be a list of moves")
    found, end, at = [], 0.0, None
    for count, table in enumerate(tables, start=1):
        start, goal = _rows({"ends": [table.get("start"), table.get("goal")]}, "ends", joints)
        move = Move(
            begin=_number(table, "begin", duration),
            duration=_number(table, "duration", LONGEST),
            start=start,
            goal=goal,
            ramp=_number({"ramp": RAMP, **table}, "ramp", 0.5),
        )
        follows = at is None or bool(np.array_equal(at, start))
        if move.begin < end or move.end > duration or not follows:
            raise InputError(f"[[motion.move]] {count}: does not follow on the one before it")
        found.append(move)
        end, at = move.end, goal
    return found


def _number(table: Mapping[str, Any], key: str, most: float) -> float:
    value = table.get(key)
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0.0 < value <= most:
        raise InputError(f"[motion] {key}: {value!r} is to be above 0, and {most:g} at most")
    return float(value)


def _rows(table: Mapping[str, Any], key: str, joints: int) -> Array:
    """Rows of one finite number per joint, (N, J)."""
    try:
        rows = np.array(table.get(key), dtype=np.float64)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.ndim != 2 or rows.shape[1] != joints or not np.isfinite(rows).all():
        raise InputError(f"[motion] {key}: is to be rows of {joints} numbers, one a joint")
    return rows


def rows_of(path: Series | Moves, end: float, rate: float) -> Trajectory:
    """A motion as rows, the last at its end [s] or later, with the arm at rest."""
    t = np.arange(np.ceil(end * rate - 1e-9) + 1.0) / rate
    parts = [path.at(np.minimum(t[rows], end)) for rows in blocks(len(t))]
    return Trajectory(t, *(np.concatenate(order) for order in zip(*parts, strict=True)))
