"""urdyn acknowledge: a finding that somebody has seen stays quiet until it is worse, or back."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice

Folder = Annotated[Path, typer.Argument(metavar="DIR", show_default=False)]
Name = Annotated[str, typer.Argument(metavar="ID", show_default=False)]


def acknowledge(folder: Folder, name: Name, json: Json = False, quiet: Quiet = False) -> None:
    """Mark a finding of a tracked run as seen, by its id in DIR/findings.json.

    It stays quiet until it gets worse, or is gone and comes back. An id without its stamp, as in
    collision.tool0 for collision.tool0@2.7, marks all such findings.

    Example: [bold]urdyn acknowledge monday friction_increase.elbow_joint[/bold]
    """
    from urdyn.diagnose.findings.acknowledge import acknowledge as mark
    from urdyn.io.run_folder import REPORT, SEVERITIES

    voice = Voice(json, quiet)
    seen = [dict(finding) for finding in mark(folder, name)]
    worst = max((finding["severity"] for finding in seen), key=SEVERITIES.index)
    times = f", {len(seen)} findings" if len(seen) > 1 else ""
    voice.show(f"{name}: acknowledged at {worst}{times}")
    if (page := folder / REPORT).exists():
        voice.note(f"{page}: is of before; the next run that is tracked there draws it anew")
    voice.result(seen[0] if len(seen) == 1 else {"findings": seen})
