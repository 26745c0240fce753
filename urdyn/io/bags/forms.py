"""What kind of bag a path is, by its first bytes; and what opens bags, where it is installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from urdyn.errors import LogError, MissingExtraError

# First bytes -> suffix by which bag readers know the form.
MAGIC = {b"SQLite format 3\0": ".db3", b"\x89MCAP0\r\n": ".mcap", b"#ROSBAG V2.0": ".bag"}
METADATA = "metadata.yaml"  # of a folder that is a ROS 2 bag
EXTRA = "ros2"


def require(*packages: str) -> None:
    """MissingExtraError where one of these packages is not installed."""
    for package in packages:
        if find_spec(package) is None:
            raise MissingExtraError(EXTRA, package)


def is_log(path: Path) -> bool:
    """Can it be a log: a file, or a folder that is a ROS 2 bag?"""
    return path.is_file() or (path / METADATA).is_file()


def is_bag(path: Path) -> bool:
    """Is it a bag: a file that begins as one, or a folder? LogError where a folder is none."""
    if path.is_dir() and not is_log(path):
        raise LogError(f"is a folder without {METADATA}, so no ROS 2 bag; name a file", path)
    return path.is_dir() or form(path) is not None


@contextmanager
def named(path: Path) -> Iterator[Path]:
    """The bag under a name that ends as bag readers want it."""
    suffix = form(path)
    if suffix in (None, path.suffix):
        yield path
        return
    with TemporaryDirectory(prefix="urdyn.") as folder:
        link = Path(folder) / f"bag{suffix}"
        link.symlink_to(path.resolve())
        yield link


def form(path: Path) -> str | None:
    """Suffix of the form of a file that begins as a bag does."""
    if path.is_dir():
        return None
    with path.open("rb") as stream:
        start = stream.read(16)
    return next((suffix for magic, suffix in MAGIC.items() if start.startswith(magic)), None)
