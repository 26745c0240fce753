"""The folder of results, and the files in it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import urdyn as ud
from urdyn.errors import InputError
from urdyn.io import dump_toml, write_folder
from urdyn.model.describe import describe
from urdyn.twin import document

if TYPE_CHECKING:
    from urdyn.types import Source

FILES = ("twin.toml", "identified.urdf", "report.html")


def require_folder(out: Path) -> None:
    """InputError where results cannot be written to `out`, before the work begins."""
    for path in (out, *out.parents):
        if path.exists():
            if not path.is_dir():
                raise InputError(f"{out}: cannot be a folder of results: {path} is a file")
            _require_room(path, out)
            return


def require_place(out: Path | None) -> None:
    """InputError where the file cannot be written, before the work begins."""
    if out is None:
        return
    folder = out.resolve().parent
    if not folder.is_dir():
        raise InputError(f"{out}: cannot be written: its folder does not exist")
    _require_room(folder, out)


def _require_room(folder: Path, out: Path) -> None:
    """InputError where `out` cannot be made in a folder that exists."""
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{out}: you may not write in {folder}; name another place")


def save(fit: ud.Fit, page: str, out: Path) -> None:
    """Write FILES; all are made before any is written."""
    heading = "urdyn {}: identified from {}".format(
        ud.__version__, ", ".join(_citation(source) for source in fit.sources)
    )
    urdf = describe(fit.dynamics.arm, fit.dynamics.inertials, heading)
    texts = dump_toml(document(fit)), urdf, page
    write_folder(out, dict(zip(FILES, texts, strict=True)))


def _citation(source: Source) -> str:
    return f"{source.path} (sha256 {source.sha256[:12]})"
