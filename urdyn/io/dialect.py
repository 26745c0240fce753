"""How a text recording is written: found from its first lines, or given by the caller."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from urdyn.errors import LogError
from urdyn.io.cells import fields, is_empty, is_number, is_stamp
from urdyn.io.names import duplicates, example, expand, rename

SAMPLE = 100  # lines that are examined
READ = 1 << 20  # [bytes] in which they are looked for
PRINTED = 1 << 16  # [bytes] of which nearly all have to be text
PRINTABLE = bytes([*range(32, 127), *b"\t\n\r"])
SAID = re.compile(r'(?i)"?sep=([;\t|, ])"?\s*')  # the line that tells Excel the delimiter


class Kind(Enum):
    """What the cells of a column hold."""

    NUMBER = "number"
    FLAG = "flag"  # True and False
    STAMP = "stamp"  # ISO 8601 instants
    TEXT = "text"


@dataclass(frozen=True)
class Dialect:
    """Everything that has to be known to read a line."""

    delimiter: str
    decimal: str
    columns: tuple[str, ...]  # one per field, RTDE names; "" where unwanted
    kinds: tuple[Kind, ...]  # one per field
    filled: int  # fields that a whole row has at least; what follows may be missing
    header: str = ""  # the header as it stands in the file; "" where there is none
    line: int = 0  # of the header, or of the last remark above the data, which begin below
    sample: tuple[str, ...] = ()  # cells of one of the rows

    @property
    def text(self) -> tuple[str, ...]:
        """Columns that hold text, which no channel can."""
        named = zip(self.columns, self.kinds, strict=True)
        return tuple(name for name, kind in named if name and kind is Kind.TEXT)

    @property
    def numeric(self) -> tuple[str, ...]:
        """The columns again, without a name where the cells are text."""
        named = zip(self.columns, self.kinds, strict=True)
        return tuple("" if kind is Kind.TEXT else name for name, kind in named)


def sniff(start: bytes, spec: str | None, path: str) -> Dialect:
    """The dialect of a file that starts with these bytes; `spec` names columns in its stead."""
    lines = _text_lines(start, path)
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip()][:SAMPLE]
    said = SAID.fullmatch(numbered[0][1]) if numbered else None
    numbered = numbered[bool(said) :]
    if not numbered:
        raise LogError("is empty", path)
    numbered = numbered[_remarks([line for _, line in numbered]) :]
    first, head = numbered[0]
    delimiter = said[1] if said else _delimiter(head)
    names = _titles(head, delimiter)
    titled = _is_header(names)
    samples = [fields(line, delimiter) for _, line in numbered[titled:]]
    if not samples:
        raise LogError("has a header and no data", path, first)
    width = _mode(map(len, samples))
    columns = _columns(names if titled else None, spec, samples, path, first)
    sound = [cells for cells in samples if len(cells) >= width]
    decimal = _decimal(sound, delimiter)
    kinds = tuple(_kind(name, k, sound, decimal) for k, name in enumerate(columns))
    filled = min(_mode(map(_filled, samples)), width)
    header, below = (head.strip(), first) if titled else ("", first - 1)
    return Dialect(delimiter, decimal, columns, kinds, filled, header, below, tuple(sound[-1]))


def _text_lines(start: bytes, path: str) -> list[str]:
    """The first lines, if this is text at all."""
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise LogError("is UTF-16; save it as UTF-8", path)
    if b"\n" not in start and b"\r" in start:
        raise LogError("ends its lines in CR alone; save it with LF, or CR and LF", path)
    if len(start[:PRINTED].translate(None, PRINTABLE)) > 0.3 * len(start[:PRINTED]):
        raise LogError("is not text: neither CSV nor Parquet", path)
    lines = start[:READ].decode(errors="replace").split("\n")
    return lines[: -1 if len(start) > READ else None]


def _remarks(lines: Sequence[str]) -> int:
    """How many lines stand above the header: they begin with #, and so may the header itself."""
    told = next((k for k, line in enumerate(lines) if not line.lstrip().startswith("#")), 0)
    if not told:
        return 0
    delimiter = _delimiter(lines[told])
    above, names = (_titles(line, delimiter) for line in lines[told - 1 : told + 1])
    return told if _is_header(names) and len(names) > len(above) else told - 1  # not units


def _delimiter(line: str) -> str:
    return next((d for d in ";\t|," if d in line), " " if " " in line.strip() else ",")


def _titles(line: str, delimiter: str) -> list[str]:
    """The cells of a line that may be a header."""
    return fields(line.strip().lstrip("# "), delimiter)


def _is_header(names: Sequence[str]) -> bool:
    """Do most of the cells look like names?"""
    told = [name for name in names if not is_empty(name)]
    titles = [name for name in told if re.search(r"[A-Za-z]", name) and not is_stamp(name)]
    return 2 * len(titles) > len(told)


def _filled(cells: Sequence[str]) -> int:
    """Number of cells up to the last that is not empty; trailing delimiters do not count."""
    return max((k for k, cell in enumerate(cells, 1) if cell.strip()), default=0)


def _columns(
    header: list[str] | None, spec: str | None, samples: list[list[str]], path: str, line: int
) -> tuple[str, ...]:
    """RTDE names, one for every field of a row; unnamed fields are ""."""
    width, filled = _mode(map(len, samples)), _mode(map(_filled, samples))
    if spec is None and header is None:
        told = f"has no header; name its {filled} columns, for example --columns {example(filled)}"
        raise LogError(told, path, line)
    names = _said(spec, path) if spec else [rename(name) for name in header or ()]
    named = len(names) if spec else _filled(names)
    if not filled <= len(names) or not named <= width:
        who = "--columns names" if spec else "the header names"
        raise LogError(f"{who} {named} columns, the rows have {filled}", path, line)
    if twice := duplicates(names):
        raise LogError(f"two columns are called {twice[0]}", path, line)
    return (*names[:width], *[""] * (width - len(names)))


def _said(spec: str, path: str) -> list[str]:
    """Columns as the caller named them."""
    try:
        return list(expand(spec))
    except ValueError as error:
        raise LogError(
            f"--columns cannot be read: {error}; write --columns {example(19)}", path
        ) from None


def _mode(counts: Iterable[int]) -> int:
    """The most frequent count."""
    return Counter(counts).most_common(1)[0][0]


def _decimal(samples: Sequence[Sequence[str]], delimiter: str) -> str:
    """The decimal mark: a comma, where a cell is such as 0,5.

    Where commas also part the cells, that one is in quotes; beside 0.5 its comma groups thousands.
    """
    comma, point = (
        any(re.fullmatch(rf" *[-+]?\d+{mark}\d+.*", cell) for cells in samples for cell in cells)
        for mark in (",", r"\.")
    )
    return "," if comma and not (point and delimiter == ",") else "."


def _kind(name: str, k: int, samples: Sequence[Sequence[str]], decimal: str) -> Kind:
    """What column `k` holds, by most of its cells."""
    cells = [row[k].replace(decimal, ".") for row in samples if not is_empty(row[k])]
    if sum(map(is_number, cells)) * 2 >= len(cells):
        flags = sum(cell.strip().lower() in ("true", "false") for cell in cells)
        return Kind.FLAG if flags * 2 > len(cells) else Kind.NUMBER
    if name == "timestamp" and sum(map(is_stamp, cells)) * 2 >= len(cells):
        return Kind.STAMP
    return Kind.TEXT
