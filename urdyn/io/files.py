"""Files as bytes: hashed; written beside and renamed, so that no reader meets half a file."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from urdyn.errors import InputError

PATIENCE = 1.0  # [s] for what a process that was killed still has to write
LOOK = 0.01  # [s] between two looks


def sha256(path: str | Path) -> str:
    """Hexadecimal SHA-256 of a file's bytes."""
    try:
        with Path(path).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error


@contextmanager
def writing(path: str | Path) -> Iterator[BinaryIO]:
    """Binary stream whose bytes become `path` at the end of the block, all of them or none."""
    target = Path(path).resolve()  # a link keeps pointing, what it points at is replaced
    if target.exists() and not target.is_file():
        raise InputError(f"{path}: cannot be written: not a regular file")
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as stream:
            yield stream
        with part.open("rb+") as stream:  # again, for some compressors close what they are given
            os.fsync(stream.fileno())
        part.replace(target)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def alone(folder: str | Path) -> Iterator[int | None]:
    """Hold `folder` for the block; however this process ends, it is let go.

    A process that is given the descriptor holds it too, until both have ended; None where there is
    no such lock, and nothing is held.

    Raises:
        InputError: another process holds it, and does not let it go in PATIENCE.
    """
    try:
        import fcntl
    except ImportError:
        yield None
        return
    holder = os.open(folder, os.O_RDONLY)
    try:
        deadline = time.monotonic() + PATIENCE
        while not _locked(fcntl, holder):
            if time.monotonic() > deadline:
                told = f"{folder}: another urdyn is writing there; take another folder"
                raise InputError(told)
            time.sleep(LOOK)
        yield holder
    finally:
        os.close(holder)


def _locked(fcntl: Any, holder: int) -> bool:
    try:
        fcntl.flock(holder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def write_text(path: str | Path, text: str) -> None:
    """Write `text` as UTF-8, atomically."""
    with writing(path) as stream:
        stream.write(text.encode())
