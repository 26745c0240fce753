"""A text file as blocks of whole lines: memory holds one of them, and damage stays local."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from urdyn.errors import LogError
from urdyn.io.compression import Unpacked

SIZE = 1 << 24  # [bytes]: large enough for all cores, small beside the numbers
LONGEST = 1 << 24  # [bytes]: no row is as long as this
BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class Block:
    """Whole lines of a file."""

    data: bytes
    line: int  # of the first of them, from 1

    @property
    def lines(self) -> int:
        """Number of lines; the last may lack its line feed."""
        return self.data.count(b"\n") + (not self.data.endswith(b"\n") and bool(self.data))

    def below(self, line: int) -> Block:
        """What stands below a line of the file."""
        if line < self.line:
            return self
        rest = self.data.split(b"\n", line - self.line + 1)
        return Block(rest[-1] if len(rest) == line - self.line + 2 else b"", line + 1)

    def halves(self) -> tuple[Block, Block] | None:
        """The block in two, parted at the line feed nearest the middle; None: it is one line."""
        cut = self.data.find(b"\n", len(self.data) // 2) + 1
        if not 0 < cut < len(self.data):
            return None
        head = Block(self.data[:cut], self.line)
        return head, Block(self.data[cut:], self.line + head.lines)


def blocks(stream: Unpacked, path: str) -> Iterator[Block]:
    """The stream, block after block, without a byte order mark, nor the line that a tear broke."""
    line, rest = 1, b""
    while chunk := _chunk(stream):
        chunk = chunk.removeprefix(BOM) if line == 1 and not rest else chunk
        whole, feed, tail = chunk.rpartition(b"\n")
        if feed:
            yield (block := Block(rest + whole + feed, line))
            line, rest = line + block.lines, tail
        elif len(rest := rest + tail) > LONGEST:
            raise LogError(f"a line of more than {LONGEST >> 20} MB: no recording", path, line)
    if rest and not stream.torn:
        yield Block(rest, line)


def _chunk(stream: Unpacked) -> bytes:
    """SIZE bytes, or all that is left: decompressors may give less than they are asked for."""
    parts, wanted = [], SIZE
    while wanted > 0 and (part := stream.read(wanted)):
        parts.append(part)
        wanted -= len(part)
    return b"".join(parts)
