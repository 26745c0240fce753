"""The files of a history that grows: one a checkpoint, joined at the end."""

from __future__ import annotations

import shutil
from pathlib import Path

from urdyn.errors import InputError

FILE, PARTS = "history.parquet", "history.parts"


def part_file(folder: Path, number: int) -> Path:
    """Where a part is."""
    return folder / PARTS / f"part-{number:06d}.parquet"


def open_parts(folder: Path, count: int) -> None:
    """A folder of the parts that count; what a killed run left beyond them is dropped.

    Raises:
        InputError: one that counts is missing.
    """
    counted = [part_file(folder, number) for number in range(count)]
    (folder / PARTS).mkdir(parents=True, exist_ok=True)
    for path in {*(folder / PARTS).iterdir()} - {*counted}:
        path.unlink()
    for path in counted:
        if not path.exists():
            raise InputError(f"{path.parent}: lacks {path.name}; start anew with --fresh")


def discard_parts(folder: Path) -> None:
    """No parts, once they are joined for good."""
    shutil.rmtree(folder / PARTS)
