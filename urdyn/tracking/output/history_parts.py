"""The files of a growing history: one per checkpoint, joined at the end."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from urdyn.errors import InputError
from urdyn.io import alone
from urdyn.io.run_folder import HISTORY, PARTS

PATIENCE = 2.0  # [s]
WHOLE = b"PAR1"  # the end of every Parquet file


def part_file(folder: Path, number: int) -> Path:
    """Path of a part."""
    return folder / PARTS / f"part-{number:06d}.parquet"


@contextmanager
def writing_parts(folder: Path) -> Iterator[None]:
    """Exclude other writers of a history from `folder`.

    The scribe of a killed run may still be writing for a moment, and is waited for.
    """
    (folder / PARTS).mkdir(parents=True, exist_ok=True)
    with alone(folder / PARTS, PATIENCE):
        yield


def drop_others(folder: Path, count: int) -> None:
    """Keep the first `count` parts, and drop what a killed run left beyond them.

    Raises:
        InputError: one of them is missing, or cut short.
    """
    counted = [part_file(folder, number) for number in range(count)]
    unfinished = folder.glob(f".{HISTORY}.*.part")
    for path in {*(folder / PARTS).iterdir(), *unfinished} - {*counted}:
        path.unlink()
    for path in counted:
        if not path.exists():
            raise InputError(f"{path.parent}: lacks {path.name}; start anew with --fresh")
        with path.open("rb") as part:
            part.seek(-min(len(WHOLE), path.stat().st_size), os.SEEK_END)
            if part.read() != WHOLE:
                raise damaged(path)


def damaged(part: Path) -> InputError:
    """The error for a missing or damaged part."""
    return InputError(f"{part}: is damaged; start anew with --fresh")


def discard_parts(folder: Path) -> None:
    """Delete the parts, once they are joined for good."""
    shutil.rmtree(folder / PARTS)
