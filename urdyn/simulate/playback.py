"""A trajectory from a file: time and joint angles, one row per line."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from urdyn.errors import LogError
from urdyn.given import given_number, positive
from urdyn.model.arm import Arm
from urdyn.simulate.limits import rated, require
from urdyn.simulate.trajectory import Trajectory, blocks
from urdyn.simulate.written import read_motion, rows_of
from urdyn.types import Array

FINE = 500.0  # [Hz] at which limits are checked, at least: a controller's rate


def from_file(path: str | Path, arm: Arm, rate: float) -> Trajectory:
    """The trajectory in a CSV of t [s], q0 ... [rad] (a header is optional) at `rate` [Hz].

    A quintic spline through all points that starts and ends at rest; columns of velocity and
    acceleration are not needed. Or the motion in an excitation.toml. InputError where the file
    cannot be used or the arm cannot follow, also between the rows of the trajectory.
    """
    rate = given_number(rate, "rate", "a finite number of Hz, above 0", positive)
    at = _motion(path, arm.joints)
    fine = at(max(rate, FINE))
    require(arm, rated(arm), fine, str(path))
    return fine if rate >= FINE else at(rate)


def _motion(path: str | Path, joints: int) -> Callable[[float], Trajectory]:
    """The trajectory in a file, as a function of its rate [Hz]."""
    if Path(path).suffix.lower() == ".toml":
        motion, duration, told = read_motion(path, joints)
        return partial(rows_of, motion, duration - 1.0 / told)
    points = read_points(path, joints)
    return partial(through, points[:, 0] - points[0, 0], points[:, 1:])


def through(t: Array, q: Array, rate: float) -> Trajectory:
    """Quintic spline through q (N, J) at t (N,), t[0] = 0, at rest at both ends."""
    rest = [(order, np.zeros(q.shape[1])) for order in (1, 2)]
    spline = make_interp_spline(t, q, k=5, bc_type=(rest, rest))
    # The last row is at or after the end, with the arm at rest.
    stamps = np.arange(np.ceil(t[-1] * rate - 1e-9) + 1.0) / rate
    motion = np.empty((3, len(stamps), q.shape[1]))
    for rows in blocks(len(stamps)):
        inside = np.minimum(stamps[rows], t[-1])
        motion[:, rows] = [spline(inside, nu=order) for order in range(3)]
    return Trajectory(stamps, *motion)


def read_points(path: str | Path, joints: int) -> Array:
    """Rows of time and angles, (N, 1 + J); two or more, finite, time increasing."""
    rows = list(_rows(path, joints))
    if len(rows) < 2:
        raise LogError("a trajectory has two points or more", path)
    points = np.array([numbers[: 1 + joints] for _, numbers in rows])
    back = np.flatnonzero(np.diff(points[:, 0]) <= 0.0)
    if len(back):
        raise LogError("time does not increase", path, rows[back[0] + 1][0], "t")
    return points


def _rows(path: str | Path, joints: int) -> Iterator[tuple[int, list[float]]]:
    """Line number and numbers of every line that is neither empty nor the header."""
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream)
            for cells in reader:
                if cells and not (reader.line_num == 1 and _is_header(cells)):
                    yield reader.line_num, _numbers(cells, joints, path, reader.line_num)
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}", path) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise LogError(f"is not a CSV of numbers: {error}", path) from None


def _is_header(cells: list[str]) -> bool:
    """Whether the line begins with a name rather than a time."""
    try:
        float(cells[0])
    except ValueError:
        return True
    return False


def _numbers(cells: list[str], joints: int, path: str | Path, line: int) -> list[float]:
    """The numbers of one line."""
    width = 1 + joints
    if len(cells) not in (width, 1 + 3 * joints):
        raise LogError(
            f"{len(cells)} columns; the arm needs {width}: t and {joints} angles", path, line
        )
    try:
        numbers = [float(cell) for cell in cells]
    except ValueError as error:
        raise LogError(f"not a number: {error}", path, line) from None
    if not np.all(np.isfinite(numbers)):
        raise LogError("a trajectory has no gaps: every number must be finite", path, line)
    return numbers
