"""What kind of bag a path is, by its first bytes; and what opens bags, where it is installed."""

from __future__ import annotations

import hashlib
from importlib.util import find_spec
from pathlib import Path

from urdyn.errors import LogError, MissingExtraError
from urdyn.io.files import sha256

# First bytes -> suffix by which bag readers know the form.
MAGIC = {b"SQLite format 3\0": ".db3", b"\x89MCAP0\r\n": ".mcap", b"#ROSBAG V2.0": ".bag"}
METADATA = "metadata.yaml"  # of a folder that is a ROS 2 bag
EXTRA = "ros2"


def require(*packages: str) -> None:
    """MissingExtraError where one of these packages is not installed."""
    for package in packages:
        if find_spec(package) is None:
            raise MissingExtraError(EXTRA, package)


def is_bag(path: Path) -> bool:
    """Is it a bag: a file that begins as one, or a folder?"""
    return path.is_dir() or _form(path) is not None


def check(path: Path) -> None:
    """LogError where bag readers would not know what this is."""
    if path.is_dir():
        if not (path / METADATA).is_file():
            raise LogError(f"is a folder without {METADATA}, so no ROS 2 bag; name a file", path)
    elif (form := _form(path)) and path.suffix != form:
        raise LogError(f"is a {form} bag by its first bytes; give its name that ending", path)


def fingerprint(path: Path) -> str:
    """SHA-256 of a bag; of a folder, of the hashes of its files in the order of their names."""
    if path.is_file():
        return sha256(path)
    whole = hashlib.sha256()
    for file in sorted(child for child in path.iterdir() if child.is_file()):
        whole.update(f"{file.name} {sha256(file)}\n".encode())
    return whole.hexdigest()


def _form(path: Path) -> str | None:
    with path.open("rb") as stream:
        start = stream.read(16)
    return next((form for magic, form in MAGIC.items() if start.startswith(magic)), None)
