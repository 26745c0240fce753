"""A simulated log, the twin identified from it, and the command line as users call it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Before a command: as a script begins it in the background, deaf to Ctrl-C.
DEAF = ("sh", "-c", "trap '' INT; exec \"$@\"", "sh")


def urdyn(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return subprocess.run(
        (sys.executable, "-m", "urdyn", *map(str, arguments)),
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": path} | environment,
        check=False,
    )


@contextmanager
def without_pages() -> Iterator[None]:
    """Runs whose page nobody looks at draw none."""
    with pytest.MonkeyPatch.context() as here:
        here.setattr("urdyn.report.track.apart.draw", lambda *of: 1.0)
        yield


def kept(path: Path, said: subprocess.CompletedProcess[str]) -> None:
    """What a command said, as a file."""
    path.write_text(json.dumps([said.returncode, said.stdout, said.stderr]))


def told(path: Path) -> subprocess.CompletedProcess[str]:
    """What a command said, from its file."""
    return subprocess.CompletedProcess((), *json.loads(path.read_text()))


@dataclass(frozen=True)
class Story:
    """A simulated arm, its log and its identification."""

    log: Path
    truth: Path
    held_out: Path
    out: Path  # twin.toml, identified.urdf, report.html
    simulated: subprocess.CompletedProcess[str]
    identified: subprocess.CompletedProcess[str]
