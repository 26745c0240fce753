"""Poses and the joint angles at which they were taken: from a tracker, or the controller."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.errors import InputError, LogError
from urdyn.io.names import spread
from urdyn.io.pose_columns import Columns, pose_columns
from urdyn.io.reader import Rows, read_table
from urdyn.types import Array, Defect, Index, Mask, Source, freeze, index_of, shaped

FAR = 20.0  # [m] no target is so far from its tracker or robot: larger numbers are millimetres
LEAST = 12  # poses: base and tool alone have as many unknowns
# What three angles can mean, in scipy's words: rotation vector, turning axes, fixed axes.
READINGS = ("rotvec", "XYZ", "xyz")


@dataclass(frozen=True, eq=False)
class Poses:
    """Static poses of something that is fixed to the flange."""

    q: Array  # (N, J) [rad]
    place: Array  # (N, 3) [m]
    angles: Array | None = None  # (N, 3) [rad] as `reading` has it; None: only positions
    reading: str = "rotvec"  # one of READINGS; "" where the file does not say
    own: bool = False  # the controller's: seen from the arm's own base
    source: Source = field(default_factory=Source)
    defects: tuple[Defect, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "q")
        if self.q.ndim != 2:
            raise InputError(f"q has the shape {self.q.shape}; it has to be poses x joints")
        for name in ("place", "angles"):
            if (values := getattr(self, name)) is not None:
                object.__setattr__(self, name, shaped(name, values, (len(self), 3)))
        if self.reading:
            index_of(self.reading, READINGS, "reading")

    def __len__(self) -> int:
        return len(self.q)

    @cached_property
    def turn(self) -> Array:
        """Rotations (N, 3, 3); NaN where only positions were measured."""
        if self.angles is None:
            return np.full((len(self), 3, 3), np.nan)
        angles = np.array(self.angles)  # SciPy takes no read-only ones
        if self.reading == "rotvec":
            return np.asarray(Rotation.from_rotvec(angles).as_matrix())
        return np.asarray(Rotation.from_euler(self.reading, angles).as_matrix())

    def take(self, rows: Mask | Index) -> Poses:
        """Some of the poses."""
        angles = None if self.angles is None else self.angles[rows]
        return replace(self, q=self.q[rows], place=self.place[rows], angles=angles)

    def whole(self) -> Poses:
        """The poses that have every number; LogError where they are too few to `calibrate` by.

        Angles of so few that the places of all are more numbers, or alone enough, are left out.
        """
        held = [each for each in (self.q, self.place, self.angles) if each is not None]
        known = [np.isfinite(each).all(axis=1) for each in held]
        placed, finite = known[0] & known[1], np.logical_and.reduce(known)
        count, places = int(finite.sum()), int(placed.sum())
        if count < places and count < max(LEAST, places / 2):
            bare = Defect("pose without its angles", places - count, 0, "places alone are used")
            return replace(self, angles=None, defects=(*self.defects, bare)).whole()
        if count < LEAST:
            told = f"{count} whole poses; calibrate needs {LEAST} and more"
            raise LogError(told, self.source.path)
        if finite.all():
            return self
        lost = Defect("row without all its numbers", len(self) - count, 0, "left out")
        return replace(self.take(finite), defects=(*self.defects, lost))


def read_poses(
    path: str | Path,
    joint_names: tuple[str, ...],
    *,
    columns: str | None = None,
    rows: Rows | None = None,
) -> Poses:
    """The poses in `path`: a tracker's session, or an RTDE log with actual_TCP_pose."""
    table, source = read_table(path, columns=columns, rows=rows)
    flat = spread(table.channels)
    if {"actual_q_0", "actual_TCP_pose_5"} <= flat.keys():
        if f"actual_q_{len(joint_names) - 1}" not in flat:
            raise LogError(f"has fewer joints than the arm, {len(joint_names)}", path)
        poses = _own(flat, len(joint_names), source)
    else:
        poses = _tracked(flat, pose_columns(flat, joint_names, str(path)), source)
    return replace(poses, defects=table.defects).whole()


def read_pose_stream(path: str | Path) -> tuple[Array, str]:
    """What a tracker measured while the arm worked, and the hash of its file.

    Returns:
        Rows (N, 7) by time: stamp [s], place [m], three angles [rad], NaN where not measured.
    """
    table, source = read_table(path)
    flat = spread(table.channels)
    if "timestamp" not in flat:
        raise LogError("has no timestamp; poses of an arm at work need the log's clock", path)
    tracked = _tracked(flat, pose_columns(flat, (), str(path)), source)
    angles = np.full_like(tracked.place, np.nan) if tracked.angles is None else tracked.angles
    rows = np.column_stack([flat["timestamp"], tracked.place, angles])
    rows = rows[np.isfinite(rows[:, 0])]
    if not np.isfinite(rows[:, 1:4]).all(axis=1).any():
        raise LogError("has no whole pose", path)
    return rows[np.argsort(rows[:, 0], kind="stable")], source.sha256


def _own(flat: dict[str, Array], joints: int, source: Source) -> Poses:
    """Poses that the controller computed."""
    q = np.stack([flat[f"actual_q_{j}"] for j in range(joints)], axis=1)
    pose = np.stack([flat[f"actual_TCP_pose_{k}"] for k in range(6)], axis=1)
    return Poses(q, pose[:, :3], pose[:, 3:], "rotvec", True, source)


def _tracked(flat: dict[str, Array], columns: Columns, source: Source) -> Poses:
    """Poses that a tracker measured; units by the titles, else by the size of the numbers."""
    place = np.stack([flat[name] for name in columns.place], axis=1)
    q = np.array([flat[name] for name in columns.joints]).reshape(-1, len(place)).T
    angles = np.stack([flat[n] for n in columns.turn], axis=1) if columns.turn else None
    if columns.place_unit == "mm" or (not columns.place_unit and _size(place) > FAR):
        place = 1e-3 * place
    if angles is not None and _in_degrees(angles, columns.turn_unit, np.pi):
        angles = np.radians(angles)
    if _in_degrees(q, columns.joint_unit, 2.0 * np.pi):
        q = np.radians(q)
    return Poses(q, place, angles, "", False, source)


def _in_degrees(angles: Array, unit: str, most: float) -> bool:
    return unit in ("deg", "degree", "degrees", "°") or (not unit and _size(angles) > 1.05 * most)


def _size(values: Array) -> float:
    """A number that few values exceed; gross errors do not move it."""
    finite = np.abs(values[np.isfinite(values)])
    return float(np.quantile(finite, 0.95)) if len(finite) else 0.0
