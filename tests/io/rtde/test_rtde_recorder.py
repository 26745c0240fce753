"""Recordings of controllers: every package, whole, whatever happens to whom."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rtde_arm import Start
from virtual_controller import JOINTS, SKIPPED, WRAP

from urdyn.cli.ending import ended_by
from urdyn.errors import InputError, RtdeError
from urdyn.io import read
from urdyn.io.rtde import DEFAULT, Server, Summary, record, recording, serve
from urdyn.io.rtde.client import Connected
from urdyn.io.rtde.clients import Clients
from urdyn.io.rtde.controller import Controller
from urdyn.io.rtde.handshake import Agreement
from urdyn.io.rtde.journal import Journal
from urdyn.io.rtde.link import Package
from urdyn.io.rtde.recipe import Recipe
from urdyn.io.rtde.tally import Tally
from urdyn.signal.channels import STATUS
from urdyn.types import Log

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once
NAMES = ("actual_q", "target_q", "actual_current", "joint_temperatures", "output_int_register_12")
ROWS = pa.record_batch({"timestamp": pa.array([1.0, 2.0]), "actual_q_0": pa.array([0.1, 0.2])})


def torn(log: Log) -> int:
    """Rows whose values are not all of one cycle."""
    phase = log.channels["output_int_register_12"][:, None] % WRAP / WRAP
    made = {
        "actual_q": phase + JOINTS / 8,
        "target_q": phase - JOINTS / 8,
        "actual_current": 2 * phase + JOINTS / 8,
        "joint_temperatures": 25 + phase + JOINTS,
    }
    wrong = [(log.channels[name] != values).any(axis=1) for name, values in made.items()]
    return int(np.any(wrong, axis=0).sum())


def is_whole(log: Log, summary: Summary) -> bool:
    cycles = log.channels["output_int_register_12"]
    whole = len(log) == summary.samples and not torn(log) and (np.diff(cycles) == 1).all()
    return bool(whole and (log.t == cycles / 500).all())


def test_five_seconds_at_500_hz_lose_nothing(start: Start, tmp_path: Path) -> None:
    told: list[Summary] = []
    summary = record(start().host, tmp_path / "a.csv", 500, NAMES, 5.0, told.append)
    assert summary.lost == summary.torn == summary.reconnects == 0 and not summary.gaps
    assert abs(summary.samples - 2500) < 5 and abs(summary.rate - 500) < 1
    log = read(tmp_path / "a.csv")
    assert is_whole(log, summary) and not log.defects
    assert 0 < summary.age_p50 <= summary.age_p99
    assert len(told) >= 9 and told[-1].samples == summary.samples


@pytest.mark.slow
def test_a_minute_at_500_hz_loses_nothing_and_is_fresh(start: Start, tmp_path: Path) -> None:
    names = (*DEFAULT, *NAMES)
    summary = record(start().host, tmp_path / "a.parquet", 500, names, 60.0)
    assert summary.lost == summary.torn == summary.reconnects == 0
    assert is_whole(read(tmp_path / "a.parquet"), summary)
    assert summary.age_p99 < 1e-3


@pytest.mark.parametrize("suffix", [".csv", ".csv.zst", ".parquet", ".mcap"])
def test_every_form_holds_every_bit(start: Start, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    summary = record(start().host, path, recipe=NAMES, duration=1.0)
    assert is_whole(read(path), summary)
    assert [child.name for child in tmp_path.iterdir()] == [path.name]


def test_parquet_keeps_types_and_an_account(start: Start, tmp_path: Path) -> None:
    arm = start()
    summary = record(arm.host, tmp_path / "a.parquet", 125, NAMES, 0.5)
    file = pq.read_schema(tmp_path / "a.parquet")
    assert str(file.field("output_int_register_12").type) == "int32"
    told = json.loads(file.metadata[b"urdyn.recording"])
    assert told["address"] == f"{arm.host}:30004" and told["frequency"] == 125.0
    assert told["controller"] == "5.23.0.0" and told["samples"] == summary.samples


def test_the_default_recipe_is_what_the_project_reads(start: Start, tmp_path: Path) -> None:
    record(start(generation="cb3").host, tmp_path / "a.parquet", duration=0.5)
    log = read(tmp_path / "a.parquet")
    for name in ("target_q", "target_moment", "actual_current", "actual_TCP_force", "joint_mode"):
        assert log.channels[name].shape == (len(log), 6)
    assert log.channels["payload_cog"].shape == (len(log), 3)
    assert log.channels.keys() >= set(STATUS)


def test_cycles_that_the_controller_skipped_are_marked(start: Start, tmp_path: Path) -> None:
    arm = start("", 30004, "e", "skip")
    summary = record(arm.host, tmp_path / "a.csv", recipe=NAMES, duration=2.5)
    assert summary.lost == len(SKIPPED)
    ((row, missing),) = summary.gaps
    log = read(tmp_path / "a.csv")
    assert missing == len(SKIPPED) and log.channels["output_int_register_12"][row] == SKIPPED.stop
    np.testing.assert_array_equal(np.flatnonzero(log.channels["skipped"]), [row])


def test_a_clock_that_is_set_is_no_loss_and_a_pause_is_one() -> None:
    tally, came = Tally(), np.arange(6) * 0.002
    stamps = came + np.array([0.0, 0.0, 3600.0, np.inf, np.nan, 0.0])
    assert not tally.take(stamps, came, 0.002).any() and not tally.lost
    tally.take(np.array([0.02]), np.array([0.02]), 0.002)
    assert tally.lost == 4


@pytest.mark.parametrize("by", [3600.0, -3600.0])
def test_a_clock_that_is_set_makes_no_package_old(by: float) -> None:
    tally, came = Tally(), 5.0 + np.arange(2000) * 0.002
    late = np.random.default_rng(4).uniform(0.0, 1e-3, len(came))
    for batch in np.split(np.arange(len(came)), 20):
        tally.take(came[batch] + by * (batch >= 1050), came[batch] + late[batch], 0.002)
    assert tally.summary("", 0.0).age_p99 == pytest.approx(1e-3, rel=0.05)


def test_packages_that_a_network_held_back_are_as_old_as_they_are() -> None:
    tally, came = Tally(), 5.0 + np.arange(2000) * 0.002
    held = np.where((came > 6.1) & (came < 7.6), 7.6, came)
    for batch in np.split(np.arange(len(came)), np.searchsorted(held, np.arange(5.5, 9.0, 0.5))):
        if len(batch):
            tally.take(came[batch], held[batch], 0.002)
    assert tally.summary("", 0.0).age_p99 == pytest.approx(1.5, rel=0.05)


def test_recordings_of_a_controller_that_was_restarted_are_as_far_apart_as_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though the computer was restarted, too, so that its monotonic clock began anew."""
    days, paths, begun = (
        3 * 86400.0,
        (tmp_path / "a.csv", tmp_path / "b.parquet"),
        datetime.now(UTC),
    )
    recipe = Recipe(("timestamp", "actual_q"), ("DOUBLE", "VECTOR6D"), 500.0)
    for path, later, up in zip(paths, (0.0, days), (900.0, 40.0), strict=True):
        today = SimpleNamespace(now=lambda zone, later=later: begun + timedelta(seconds=later))
        monkeypatch.setattr(recording, "datetime", today)
        monkeypatch.setattr(recording, "time", SimpleNamespace(monotonic=lambda up=up: up))
        recorder = recording.Recording(Journal(path), "", None)
        packages = [(t, recipe.pack({"timestamp": t})) for t in np.arange(50) / 500]
        connected = Connected(Agreement(recipe, 2, (5, 0, 0, 0)))
        recorder.take([connected, *(Package(up + t, values) for t, values in packages)])
        recorder.finish()
    assert np.diff(read(*paths).t)[49] == pytest.approx(days - 49 / 500, abs=1e-6)


def test_stamps_that_are_none_tell_no_age() -> None:
    tally = Tally()
    tally.take(np.full(6, np.nan), 1.0 + np.arange(6) * 0.002, 0.002)
    assert tally.summary("", 0.0).age_p99 is None


def test_how_long_nothing_came_is_counted_by_arrival() -> None:
    """Stamps tell nothing of it: a controller that was restarted counts from 0."""
    tally, came = Tally(), np.arange(6) * 0.002
    tally.connect()
    tally.take(came, came, 0.002)
    tally.drop(torn=False)
    assert tally.silent(3.01) == pytest.approx(3.0)
    tally.connect()
    tally.take(came, came + 11.01, 0.002)
    assert tally.silent(20.0) == pytest.approx(11.0) and not tally.lost


def test_a_rate_that_cannot_be_had_is_not_written_down(start: Start, tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    summary = record(start().host, path, 300, NAMES, 1.0)
    assert summary.frequency == 500.0 and summary.rate == pytest.approx(500.0, abs=5.0)
    told = json.loads(pq.read_schema(path).metadata[b"urdyn.recording"])
    assert told["frequency"] == 500.0


def test_two_recorders_of_one_file_are_one_too_many(tmp_path: Path) -> None:
    first, other = Journal(tmp_path / "a.csv"), Journal(tmp_path / "a.csv")
    first.write(ROWS)
    with pytest.raises(InputError, match=r"a\.csv: another urdyn is writing there"):
        other.write(ROWS)
    first.finish({})
    assert read(tmp_path / "a.csv").t.tolist() == [1.0, 2.0]


def test_what_was_recorded_is_not_overwritten(tmp_path: Path) -> None:
    for k in range(3):
        journal = Journal(tmp_path / "a.csv.zst")
        stamps, angles = pa.array([k + 0.0, k + 0.5]), pa.array([0.1, 0.2])
        journal.write(pa.record_batch({"timestamp": stamps, "actual_q_0": angles}))
        journal.finish({})
    assert journal.aside == tmp_path / "a.2.csv.zst"
    begun = [read(tmp_path / f"a{which}.csv.zst").t[0] for which in (".1", ".2", "")]
    assert begun == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_recording_is_put_where_a_link_points_to(tmp_path: Path, suffix: str) -> None:
    (disk := tmp_path / "disk").mkdir()
    (link := tmp_path / f"a{suffix}").symlink_to(path := disk / f"b{suffix}")
    for _ in range(2):
        begun(link).finish({})
    assert link.is_symlink() and list(tmp_path.glob("a*")) == [link]
    assert {*disk.iterdir()} == {path, disk / f"b.1{suffix}"}
    assert read(path).t.tolist() == read(disk / f"b.1{suffix}").t.tolist() == [1.0, 2.0]


def begun(path: Path) -> Journal:
    """A journal with two rows in it."""
    journal = Journal(path)
    journal.write(ROWS)
    return journal


def test_a_full_disk_leaves_every_row_that_was_written(tmp_path: Path) -> None:
    """Half a frame would hide all before it."""
    path = tmp_path / "a.csv.zst"
    journal = begun(path)
    told = r"written: File too large; what is in it is whole$"
    with room_for(path.stat().st_size + 3), pytest.raises(InputError, match=told):
        journal.write(ROWS)
    journal.finish({})
    assert read(path).t.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("suffix", [".parquet", ".mcap"])
def test_a_disk_that_is_full_at_the_end_leaves_a_recording_and_says_so(
    tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"a{suffix}"
    journal = begun(path)
    told = rf"a{suffix}: holds the recording as CSV .* for {suffix} cannot be written: File too la"
    with room_for(path.stat().st_size), pytest.raises(InputError, match=told):
        journal.finish({})
    assert read(path).t.tolist() == [1.0, 2.0] and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("suffix", [".parquet", ".mcap"])
def test_a_disk_that_is_full_before_the_end_is_told_and_not_by_the_end(
    tmp_path: Path, suffix: str
) -> None:
    """A recording that broke off is not one of which only the form failed."""
    path = tmp_path / f"a{suffix}"
    journal = begun(path)
    told = "written: File too large; what is in it is whole, as CSV in zstd, which `urdyn` reads"
    with room_for(path.stat().st_size), pytest.raises(InputError, match=told):
        try:
            journal.write(ROWS)
        finally:
            journal.finish({})
    assert read(path).t.tolist() == [1.0, 2.0]


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """Files may not grow beyond this [bytes]."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_drop_is_taken_up_again_and_told(start: Start, tmp_path: Path) -> None:
    arm = start()
    threading.Timer(1.0, lambda: (arm.kill(), start(arm.host))).start()
    summary = record(arm.host, tmp_path / "a.parquet", recipe=NAMES, duration=4.0)
    assert summary.reconnects == 1 and summary.lost == summary.torn == 0
    told = json.loads(pq.read_schema(tmp_path / "a.parquet").metadata[b"urdyn.recording"])
    (note,) = told["notes"]
    table = pq.read_table(tmp_path / "a.parquet")
    connection = table["connection"].to_numpy()
    assert "dropped" in note and np.flatnonzero(np.diff(connection)) + 1 == [note["row"]]
    assert set(connection) == {0, 1}
    received = table["received"].to_numpy()[note["row"] - 1 : note["row"] + 1]
    waited = pytest.approx(float(np.diff(received)[0]), abs=1e-6)  # of 1.8e9 s: 0.2 us
    assert summary.silent == waited and summary.silent > 0.05


@pytest.mark.parametrize("suffix", [".csv", ".csv.zst", ".parquet", ".mcap"])
def test_a_killed_recorder_leaves_a_readable_file(
    start: Start, tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"a{suffix}"
    code = (
        f"from urdyn.io.rtde import record; record({start().host!r}, {str(path)!r}, recipe={NAMES})"
    )
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen([sys.executable, "-c", code], env=env)
    deadline = time.monotonic() + 60
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.2)
    process.kill()
    process.wait(timeout=60)
    log = read(path)
    assert len(log) > 50 and not torn(log)  # of the 600 of an idle machine


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Ctrl-C interrupts, even where this process was begun in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_ends_a_recording_in_good_order(start: Start, tmp_path: Path) -> None:
    threading.Timer(1.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    summary = record(start().host, tmp_path / "a.parquet", recipe=NAMES)
    assert 0.0 < summary.seconds < 1.5 and is_whole(read(tmp_path / "a.parquet"), summary)


def test_who_stops_it_while_it_writes_loses_nothing(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop, write = threading.Event(), Journal.write

    def interrupted(journal: Journal, rows: Any) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        write(journal, rows)

    monkeypatch.setattr(Journal, "write", interrupted)
    with ended_by(stop.set):
        summary = record(start().host, tmp_path / "a.parquet", recipe=NAMES, stop=stop)
    assert stop.is_set() and is_whole(read(tmp_path / "a.parquet"), summary)


def test_names_that_are_optional_are_left_out_with_a_note(tmp_path: Path) -> None:
    controller = Controller((5, 3, 0, 0))
    samples = ({"timestamp": k / 500} for k in range(1000))
    with Server(samples, controller, Clients(controller, "127.0.0.1", 0)) as server:
        summary = record(f"127.0.0.1:{server.port}", tmp_path / "a.csv", duration=0.4)
    assert summary.left_out == ("payload", "payload_cog")
    assert "payload" not in read(tmp_path / "a.csv")


def test_what_cannot_be_recorded_says_why_and_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(RtdeError, match="no controller answers"):
        record("127.0.0.9:1", tmp_path / "a.csv")
    with pytest.raises(InputError, match="is to end in"):
        record("127.0.0.9:1", tmp_path / "a.txt")
    with pytest.raises(InputError, match="no such place"):
        record("127.0.0.9:1", tmp_path / "none" / "a.csv")
    for none in ({"frequency": -1}, {"frequency": 0}, {"duration": 0}, {"duration": "3"}):
        with pytest.raises(InputError, match="above 0"):
            record("127.0.0.9:1", tmp_path / "a.csv", **none)
    with serve(iter(()), port=0), pytest.raises(InputError, match="no address"):
        record("127.0.0.1:port", tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())
