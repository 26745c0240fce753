"""Outgoing topics -> an MCAP file, or a ROS 2 bag in sqlite3."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Mapping
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, BinaryIO

from urdyn.errors import InputError, LogError
from urdyn.io.bags import joint_states, sample
from urdyn.io.bags.forms import require
from urdyn.io.bags.messages import opened
from urdyn.io.bags.outgoing import Told
from urdyn.version import __version__


def write_mcap(told: Told, stream: BinaryIO, metadata: Mapping[str, str]) -> None:
    """One MCAP file; chunks are compressed with zstd, and an index stands at the end."""
    require("mcap", "rosbags")
    from mcap.writer import Writer

    writer: Any = Writer(stream)
    writer.start(profile="ros2", library=f"urdyn {__version__}")
    channels = []
    for one in told.topics:
        schema = writer.register_schema(one.type, "ros2msg", one.definition.encode())
        about = {"offered_qos_profiles": "", "topic_type_hash": one.digest}
        channels.append(writer.register_channel(one.topic, "cdr", schema, about))
    for sequence, (topic, stamp, data) in enumerate(told.messages):
        writer.add_message(channels[topic], stamp, data, stamp, sequence)
    writer.add_metadata("urdyn", dict(metadata))
    writer.finish()


def write_db3(told: Told, path: Path) -> None:
    """A ROS 2 bag: a folder with metadata.yaml, or where `path` ends in .db3 that file alone."""
    require("rosbags")
    alone = path.suffix.lower() == ".db3"
    if path.exists() and not (path.is_file() if alone else path.is_dir() and _ours(path)):
        raise InputError(
            f"{path}: cannot be written: something else is there, or a bag with more than one of "
            "our logs; name another place"
        )
    target = path.resolve()  # a link stays
    if not target.parent.is_dir():
        raise InputError(f"{path}: cannot be written: there is no such folder")
    beside = Path(mkdtemp(prefix=f".{path.stem}.", dir=target.parent))
    try:
        bag = beside / path.stem
        _write_bag(told, bag)
        if alone:
            (bag / f"{bag.name}.db3").replace(target)
        else:
            _put(bag, target, beside / "before")
    except (OSError, sqlite3.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be written: {why}") from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _put(bag: Path, path: Path, aside: Path) -> None:
    """Move a folder into another's place, and that one aside; all or nothing."""
    if not path.exists():
        bag.replace(path)
        return
    path.replace(aside)
    try:
        bag.replace(path)
    except BaseException:
        aside.replace(path)
        raise


def _ours(path: Path) -> bool:
    """Is it the folder of a bag as we write them, with nothing else in it?"""
    try:
        with opened(path) as bag:
            types = {topic.type for topic in bag.topics}
    except LogError:
        return False
    return sample.TYPE in types <= {sample.TYPE, joint_states.TYPE} and len([*path.iterdir()]) == 2


def _write_bag(told: Told, folder: Path) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer

    with Writer(folder, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        topics = [
            writer.add_connection(one.topic, one.type, msgdef=one.definition, rihs01=one.digest)
            for one in told.topics
        ]
        for topic, stamp, data in told.messages:
            writer.write(topics[topic], stamp, data)
