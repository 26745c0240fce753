"""What was written reads back bit for bit, and no reader ever meets half a file."""

from __future__ import annotations

import errno
import io
import os
import secrets
import stat
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from urdyn.errors import InputError
from urdyn.io import read, sha256, write, write_folder, write_text, writing
from urdyn.types import Log, Source

SUFFIXES = [".csv", ".parquet", ".csv.gz", ".csv.bz2", ".csv.xz", ".csv.zst", ".mcap", ".db3"]
numbers = st.floats(-1e3, 1e3) | st.sampled_from([np.nan, -0.0, 5e-324, 0.1 + 0.2])


@st.composite
def logs(draw: st.DrawFn) -> Log:
    n, width = draw(st.integers(2, 12)), draw(st.integers(1, 7))
    steps = draw(arrays(float, n, elements=st.floats(1e-4, 0.1)))
    channels = {
        "actual_q": draw(arrays(float, (n, width), elements=numbers)),
        "speed_scaling": draw(arrays(float, n, elements=numbers)),
        "output_double_register_3": draw(arrays(float, n, elements=numbers)),
        "payload": np.ones(n),  # a row without any value is no row of a log
    }
    return Log(1e6 + np.cumsum(steps), channels)


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(log=logs(), suffix=st.sampled_from(SUFFIXES))
def test_what_was_written_reads_back_bit_for_bit(log: Log, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"log{suffix}"
    write(log, path)
    back = read(path)
    assert back.t.tobytes() == log.t.tobytes()
    assert set(back.channels) == set(log.channels)
    for name, values in log.channels.items():
        assert back.channels[name].shape == values.shape
        np.testing.assert_array_equal(back.channels[name], values)
        zero = values == 0
        np.testing.assert_array_equal(
            np.signbit(back.channels[name][zero]), np.signbit(values[zero])
        )
    assert back.source.sha256 == sha256(path)


class Small(io.FileIO):
    """A file on a disk that has room for a word."""

    def write(self, data: bytes) -> int:
        if len(data) > 10:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


@pytest.fixture
def log() -> Log:
    t = np.arange(5) / 500
    return Log(t, {"actual_q": np.zeros((5, 2)), "payload": t}, Source("monday.csv", "ab" * 32))


def test_csv_is_what_an_rtde_recorder_writes(log: Log, tmp_path: Path) -> None:
    write(log, tmp_path / "log.csv")
    lines = (tmp_path / "log.csv").read_bytes().decode().split("\n")
    assert lines[:2] == ["timestamp,actual_q_0,actual_q_1,payload", "0,0,0,0"]
    assert lines[-1] == ""


def test_parquet_carries_its_origin(log: Log, tmp_path: Path) -> None:
    write(log, tmp_path / "log.parquet")
    metadata = pq.read_metadata(tmp_path / "log.parquet").metadata
    assert metadata[b"urdyn.source.sha256"] == b"ab" * 32
    assert metadata[b"urdyn.source.path"] == b"monday.csv"
    assert metadata[b"urdyn.version"]


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if s != ".db3"])  # a bag holds its own name
def test_equal_logs_are_equal_files(suffix: str, log: Log, tmp_path: Path) -> None:
    first, second = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    write(log, first)
    write(log, second)
    assert sha256(first) == sha256(second)


@pytest.mark.parametrize("name", ["log.txt", "log.gz", "log.parquet.gz", ".csv.7z"])
def test_a_suffix_that_says_nothing_is_refused(name: str, log: Log, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.csv or \.parquet"):
        write(log, tmp_path / name)


def test_a_write_that_fails_leaves_the_old_file_and_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    write_text(path, "whole\n")
    with pytest.raises(RuntimeError), writing(path) as stream:
        stream.write(b"half")
        raise RuntimeError
    assert path.read_text() == "whole\n"
    assert list(tmp_path.iterdir()) == [path]


def test_of_two_who_write_a_file_at_once_the_last_to_end_has_it(tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    with writing(path) as one, writing(path) as other:
        one.write(b"one")
        other.write(b"other")
    assert path.read_text() == "one" and list(tmp_path.iterdir()) == [path]


def test_nothing_is_written_through_a_link_in_a_parts_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever foretells the name cannot make us overwrite what is ours alone to write."""
    (victim := tmp_path / "victim").write_text("precious")
    monkeypatch.setattr(secrets, "token_hex", lambda _: str(os.getpid()))
    (tmp_path / f".out.csv.{os.getpid()}.part").symlink_to(victim)
    with pytest.raises(InputError, match="File exists"):
        write_text(tmp_path / "out.csv", "text")
    assert victim.read_text() == "precious"


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444])
def test_a_file_that_is_written_anew_is_readable_by_the_same_people(
    mode: int, tmp_path: Path
) -> None:
    write_text(path := tmp_path / "twin.toml", "old")
    path.chmod(mode)
    with writing(path) as stream:
        stream.write(b"new")
        (part,) = tmp_path.glob(".twin.toml.*.part")
        assert stat.S_IMODE(part.stat().st_mode) == mode
    assert path.read_text() == "new" and stat.S_IMODE(path.stat().st_mode) == mode


@pytest.mark.parametrize("large", ["twin.toml", "report.html"])
def test_a_full_disk_leaves_every_old_text_of_a_folder(large: str, tmp_path: Path) -> None:
    old = {"twin.toml": "old", "report.html": "old"}
    write_folder(tmp_path, old)
    with pytest.MonkeyPatch.context() as here:
        here.setattr(Path, "open", lambda path, how: io.BufferedWriter(Small(path, how)))
        with pytest.raises(InputError, match=f"{large}: cannot be written: No space left"):
            write_folder(tmp_path, dict.fromkeys(old, "new") | {large: "more than room for"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == old


def test_what_went_wrong_first_is_what_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, *how: object, **more: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system", str(path))

    monkeypatch.setattr(Path, "open", refuse)
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(InputError, match="page: cannot be written: Read-only file system"):
        write_text(tmp_path / "page", "text")


@pytest.mark.parametrize("name", [".", "nowhere/report.html"])
def test_what_cannot_be_written_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_text(tmp_path / name, "text")


def test_a_name_that_no_file_can_have_is_refused(log: Log) -> None:
    for name in ("a\0b.csv", "a\0b.db3", "a\0b"):
        for use in (read, sha256, partial(write, log), partial(write_text, text="text")):
            with pytest.raises(InputError, match=r"'a\\x00b.*no file can be called so"):
                use(name)


def test_a_hash_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        sha256(tmp_path / "nowhere")


NO_TEXT = b"l\xe4uf".decode(errors="surrogateescape")  # as Python has such a file's name


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("first", [".csv", ".parquet"])
def test_a_log_whose_name_is_no_text_can_be_converted(
    log: Log, tmp_path: Path, first: str, suffix: str
) -> None:
    write(log, tmp_path / f"log{first}")
    odd = (tmp_path / f"log{first}").rename(tmp_path / f"{NO_TEXT}{first}")
    write(read(odd), out := tmp_path / f"same{suffix}")
    np.testing.assert_array_equal(read(out).channels["payload"], log.channels["payload"])


def test_a_log_whose_name_is_no_text_can_be_written_of(tmp_path: Path) -> None:
    name = f"{NO_TEXT}.csv"
    write_text(tmp_path / "page.html", f"{name} ± 1")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "l?uf.csv ± 1"
