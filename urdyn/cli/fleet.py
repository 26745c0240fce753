"""urdyn fleet: many robots' track folders on one page."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice
from urdyn.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from urdyn.report.fleet.gather import Fleet

Folders = Annotated[list[Path], typer.Argument(metavar="DIR", show_default=False)]
Out = Annotated[Path, typer.Option(metavar="FILE", help="Where the page is written.")]
Stale = Annotated[
    float, typer.Option(metavar="H", min=0.0, help="Hours without a word that make a run stale.")
]


def fleet(
    folders: Folders,
    out: Out = Path("fleet.html"),
    stale: Stale = 24.0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Put many robots side by side, most urgent first.

    DIR is a folder that `urdyn track` writes; it may still be at it. The page links to each
    folder's report.html, so keep it where it can see them.

    Example: [bold]urdyn fleet robots/* --out fleet.html[/bold]
    """
    from urdyn.cli.results import require_folder
    from urdyn.io import write_text
    from urdyn.io.run_folder import REPORT
    from urdyn.report.fleet.gather import gather, told
    from urdyn.report.fleet.page import fleet_page, headline

    voice = Voice(json, quiet)
    require_folder(out.parent)
    once = {folder.resolve(): folder for folder in folders}  # one robot counts once
    if out.resolve() in {folder / REPORT for folder in once}:
        raise InputError(f"{out}: is one robot's own page; name another, such as fleet.html")
    found = gather(list(once.values()), time.time(), 3600.0 * stale)
    unread = [f"{each.folder}: {each.reason}" for each in found.unread]
    for each in unread[not found.robots :]:
        voice.note(f"not read: {each}")
    if not found.robots:
        raise InputError(f"no folder can be shown; {unread[0]}")
    page = fleet_page(found, out)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_text(out, page)
    voice.show(_table(found), headline(found))
    voice.note("times are counted from the first stamp of each run")
    voice.note(f"written: {out}")
    voice.result(told(found))


def _table(found: Fleet) -> Table:
    """A row per robot."""
    from urdyn.report.fleet.page import BADGE, sentence
    from urdyn.report.terminal import terminal_table

    heads = ("robot", "state", "what")
    states = (BADGE.get(r.state, r.state) + ", stale" * r.stale for r in found.robots)
    rows = ((r.name, state, sentence(r)) for r, state in zip(found.robots, states, strict=True))
    return terminal_table("", heads, rows, len(heads))
