"""Files as bytes: hashed; written beside and renamed, so that no reader meets half a file."""

from __future__ import annotations

import hashlib
import os
import secrets
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from urdyn.errors import InputError

LOOK = 0.01  # [s] between two checks whether a folder is free


def place(path: str | Path) -> Path:
    """Where a file is or is to be; InputError where no file can have such a name."""
    if "\0" in str(path):
        raise InputError(f"{str(path)!r}: no file can be called so")
    return Path(path)


def sha256(path: str | Path) -> str:
    """Hexadecimal SHA-256 of a file; of a folder, that of its files' hashes in order of name."""
    try:
        if (folder := place(path)).is_dir():
            files = sorted(child for child in folder.iterdir() if child.is_file())
            lines = "".join(f"{file.name} {sha256(file)}\n" for file in files)
            return hashlib.sha256(lines.encode(errors="surrogateescape")).hexdigest()
        with Path(path).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error


@contextmanager
def writing(path: str | Path) -> Iterator[BinaryIO]:
    """Binary stream whose bytes become `path` at the end of the block, all of them or none."""
    target = place(path).resolve()  # a link stays, its target is replaced
    if target.exists() and not target.is_file():
        raise InputError(f"{path}: cannot be written: not a regular file")
    part = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with part.open("xb") as stream:  # ours alone: no other writer's, and through no link
            with suppress(FileNotFoundError):
                shutil.copymode(target, part)  # who may read the old file may read the new one
            yield stream
        with part.open("rb") as stream:  # reopened, for some compressors close what they are given
            os.fsync(stream.fileno())
        part.replace(target)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):  # the earlier error is the one to report
            part.unlink(missing_ok=True)


@contextmanager
def alone(place: str | Path, patience: float = 0.0) -> Iterator[None]:
    """Lock `place`, a folder or a file, for the block; it is freed however this process ends.

    Raises:
        InputError: another process holds it for longer than `patience` [s].
    """
    try:
        import fcntl
    except ImportError:  # the system has no such lock: nothing is locked
        yield
        return
    holder = os.open(place, os.O_RDONLY)
    try:
        deadline = time.monotonic() + patience
        while not _locked(fcntl, holder):
            if time.monotonic() > deadline:
                raise InputError(f"{place}: another urdyn is writing there; take another place")
            time.sleep(LOOK)
        yield
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
    _write_texts({Path(path): text})


def write_folder(folder: Path, texts: Mapping[str, str]) -> None:
    """Write texts by name into a folder, made if need be; none where there is no room for all."""
    folder.mkdir(parents=True, exist_ok=True)
    _write_texts({folder / name: text for name, text in texts.items()})


def _write_texts(texts: Mapping[Path, str]) -> None:
    """Write texts as UTF-8; none takes its place before the disk has had room for all."""
    with ExitStack() as every:
        for path, text in texts.items():
            stream = every.enter_context(writing(path))
            stream.write(text.encode(errors="replace"))  # a log's name may not be valid text
            stream.flush()
