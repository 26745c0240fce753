"""Compressed files: known by their first bytes when read, by their suffix when written."""

from __future__ import annotations

import bz2
import gzip
import hashlib
import io
import lzma
import zlib
from collections.abc import Callable
from typing import Any, BinaryIO, cast

import pyarrow as pa

# First bytes -> what reads them.
READERS: dict[bytes, Callable[[BinaryIO], Any]] = {
    b"\x1f\x8b": lambda raw: gzip.GzipFile(fileobj=raw),
    b"BZh": bz2.BZ2File,
    b"\xfd7zXZ\0": lzma.LZMAFile,
    b"\x28\xb5\x2f\xfd": lambda raw: pa.CompressedInputStream(pa.PythonFile(raw), "zstd"),
}

# Suffix -> what writes it; no name and no date inside, so that equal logs are equal files.
WRITERS: dict[str, Callable[[BinaryIO], Any]] = {
    ".gz": lambda raw: gzip.GzipFile("", "wb", 6, raw, mtime=0),
    ".bz2": lambda raw: bz2.BZ2File(raw, "wb"),
    ".xz": lambda raw: lzma.LZMAFile(raw, "wb"),  # noqa: SIM115  the caller closes it
    ".zst": lambda raw: pa.CompressedOutputStream(raw, "zstd"),
}

# What the readers, and Parquet's, raise where an archive is torn or is not one.
TORN = (EOFError, OSError, lzma.LZMAError, zlib.error, pa.ArrowException, UnicodeDecodeError)


PIECE = 1 << 14  # [bytes] that a tear takes with it, at most


class Unpacked:
    """A file's bytes, decompressed; those of a torn archive up to the tear."""

    def __init__(self, stream: BinaryIO, packed: bool) -> None:
        self._stream, self._packed = stream, packed
        self._begun = self.torn = False  # has it given bytes; did it then break?

    def read(self, size: int) -> bytes:
        """Up to `size` bytes; none at the end, or from a tear on. Raises where none came before."""
        if not self._packed:
            return self._stream.read(size)
        try:
            piece = b"" if self.torn else self._stream.read(min(size, PIECE))
        except TORN:
            if not self._begun:
                raise
            self.torn, piece = True, b""
        self._begun = True
        return piece


class HashedFile(io.RawIOBase):
    """A file that is hashed as it is read, so that a large one is read once."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream, self._hash = stream, hashlib.sha256()

    def readable(self) -> bool:
        """True: the stream can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill `buffer` from the file; returns the number of bytes read."""
        count: int = self._stream.readinto(buffer)  # type: ignore[attr-defined]
        self._hash.update(memoryview(buffer)[:count])
        return count

    def sha256(self) -> str:
        """Hash of the whole file, including what follows the archive."""
        while self.read(1 << 20):
            pass
        return self._hash.hexdigest()


def decompressed(file: HashedFile) -> Unpacked:
    """The file's bytes, decompressed."""
    raw = io.BufferedReader(file, 1 << 20)
    start = raw.peek(8)
    for magic, reader in READERS.items():
        if start.startswith(magic):
            return Unpacked(reader(cast(BinaryIO, raw)), packed=True)
    return Unpacked(cast(BinaryIO, raw), packed=False)
