"""How a verb fails: one line on standard error, and an exit status."""

from __future__ import annotations

import functools
import os
import traceback
from collections.abc import Callable
from typing import ParamSpec

import typer

from urdyn.cli.legible import printable
from urdyn.errors import UrdynError

DEBUG = "URDYN_DEBUG"  # environment variable: show tracebacks
BAD_INPUT, INTERRUPTED = 1, 130

P = ParamSpec("P")


def guarded(verb: Callable[P, None]) -> Callable[P, None]:
    """The verb, whose failures are reported in one line."""

    @functools.wraps(verb)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            verb(*args, **kwargs)
        except (typer.Exit, typer.BadParameter, BrokenPipeError):
            raise  # typer's own business
        except (Exception, KeyboardInterrupt) as error:
            if os.environ.get(DEBUG):
                traceback.print_exc()
            sentence, status = explain(error)
            typer.echo(f"urdyn: {printable(' '.join(sentence.split()))}", err=True)
            raise typer.Exit(status) from None

    return run


def explain(error: BaseException) -> tuple[str, int]:
    """What to tell the user about an error, and the exit status."""
    match error:
        case KeyboardInterrupt():
            return "interrupted", INTERRUPTED
        case UrdynError():
            return str(error), BAD_INPUT
        case MemoryError():
            return "not enough memory; ask for less, of a log with --rows", BAD_INPUT
        case OSError(filename=str() as path, strerror=str() as reason):
            return f"{path}: {reason}", BAD_INPUT
        case OSError():
            return str(error), BAD_INPUT
        case _:
            kind = type(error).__name__
            return (
                f"unexpected {kind}: {error}; this is an error in urdyn, "
                f"please report it with what {DEBUG}=1 shows",
                BAD_INPUT,
            )
