"""A verb's output: results on standard output, everything else on standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.segment import Segment
from rich.text import Text

from urdyn.cli.legible import printable
from urdyn.cli.now_and_then import lines
from urdyn.progress import Progress, silent
from urdyn.version import __version__

PLAIN_WIDTH = 120  # columns of text outside a terminal


def complaints(path: object, defects: Iterable[object]) -> list[str]:
    """A file's defects, in a line each."""
    return [f"{path}: {defect}" for defect in defects]


@dataclass(frozen=True)
class Printable:
    """A renderable in whose text nothing acts on the terminal, wherever its words are from."""

    thing: RenderableType

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """What rich styles and moves by itself stays."""
        for piece in console.render(self.thing, options):
            yield piece if piece.control else Segment(printable(piece.text), piece.style)


@dataclass(frozen=True)
class Voice:
    """The output of a verb, for people or for programs."""

    json: bool = False  # standard output is for one JSON object
    quiet: bool = False  # nothing but the JSON, errors, and doubts about results

    def show(self, *things: RenderableType) -> None:
        """Results for people; on standard error if standard output is JSON."""
        self._print(sys.stderr if self.json else sys.stdout, *things)

    def note(self, *things: RenderableType) -> None:
        """What people should know about how the result came about."""
        self._print(sys.stderr, *things)

    def doubt(self, *doubts: str) -> None:
        """Reasons to doubt results: beside them, or on standard error where they are not shown."""
        if self.quiet:
            replace(self, quiet=False).note(*doubts)
        else:
            self.show(*doubts)

    def result(self, document: Mapping[str, Any]) -> None:
        """Results for programs: the one JSON object, with the version that made them."""
        if self.json:
            made = {"urdyn": __version__, **document}
            with _standard_output():
                sys.stdout.write(json.dumps(made, indent=2, allow_nan=False) + "\n")

    def data(self, text: str) -> None:
        """A file for a pipe: on standard output, with nothing else there."""
        if not self.json:
            with _standard_output():
                sys.stdout.write(text)

    @contextmanager
    def progress(self, doing: str) -> Iterator[Progress]:
        """A bar where it can be redrawn, elsewhere a line now and then."""
        if self.quiet:
            yield silent
            return
        if not redrawn(sys.stderr):
            with lines(self.note, doing) as told:
                yield told
            return
        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        with Bar(*columns, console=_on(sys.stderr), transient=True) as bar:
            task = bar.add_task(doing, total=1.0)
            yield lambda doing, share: bar.update(task, description=doing, completed=share)

    def _print(self, stream: TextIO, *things: RenderableType) -> None:
        if self.quiet:
            return
        with _standard_output() if stream is sys.stdout else nullcontext():
            for thing in things:
                # A sentence is not wrapped, so that paths in it can be copied.
                words = Text(thing) if isinstance(thing, str) else thing
                console = _on(stream)
                with console.capture() as said:
                    console.print(Printable(words), soft_wrap=isinstance(thing, str))
                stream.write(said.get())  # above a table that is kept up to date, if there is one


@contextmanager
def _standard_output() -> Iterator[None]:
    """Flush what is written in the block; an error names standard output."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, "standard output") from error


def redrawn(stream: TextIO) -> bool:
    """Whether what is written can be replaced: on a terminal, but for a dumb one."""
    return stream.isatty() and _on(stream).is_interactive


def _on(stream: TextIO) -> Console:
    width = None if stream.isatty() else PLAIN_WIDTH
    return Console(file=stream, width=width, highlight=False)
