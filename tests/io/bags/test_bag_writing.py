"""Bags that we write: other readers take them as sound, and we read them back equal."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

import pyarrow as pa
import pyarrow.parquet as pq
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from ros_messages import bag, joint_states
from rosbags.highlevel import AnyReader
from typer.testing import CliRunner

from urdyn.cli.app import app
from urdyn.errors import InputError, MissingExtraError
from urdyn.io import read, sha256, write
from urdyn.io.bags import forms
from urdyn.io.bags.joints import JOINTS
from urdyn.io.bags.write import _put
from urdyn.types import Log, Source

FORMS = [".mcap", ".db3", "", ".parquet", ".csv", ".csv.zst"]


@pytest.fixture
def log() -> Log:
    rng = np.random.default_rng(1)
    t = 1.7e9 + np.arange(40) / 500
    six = ("actual_q", "actual_qd", "actual_current", "actual_TCP_pose")
    channels = {name: rng.standard_normal((40, 6)) for name in six}
    channels["payload_cog"] = rng.standard_normal((40, 3))
    channels["output_int_register_12"] = np.arange(40.0)
    channels["actual_current"][7, 2] = np.nan
    return Log(t, channels, Source("monday.csv", "ab" * 32))


def equal(one: Log, other: Log) -> bool:
    assert one.t.tobytes() == other.t.tobytes() and set(one.channels) == set(other.channels)
    pairs = [(values, other.channels[name]) for name, values in one.channels.items()]
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


@pytest.mark.parametrize("form", [".mcap", ".db3", ""])
def test_a_missing_extra_says_how_to_get_it_and_leaves_nothing(
    form: str, log: Log, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forms, "find_spec", lambda package: None)
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(MissingExtraError, match=r"pip install -e '\.\[ros2\]'"):
        write(log, tmp_path / f"bag{form}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("start", FORMS)
def test_from_every_form_to_every_other_and_back(start: str, log: Log, tmp_path: Path) -> None:
    first = tmp_path / f"first{start}"
    write(log, first)
    for k, end in enumerate(FORMS):
        other = tmp_path / f"other{k}{end}"
        told = CliRunner().invoke(app, ["convert", str(first), str(other), "--json"])
        assert told.exit_code == 0, told.stderr
        assert json.loads(told.stdout)["samples"] == 40
        assert equal(read(other), log)


@pytest.mark.parametrize("end", [".MCAP", ".DB3"])
def test_an_ending_is_known_in_capitals(end: str, log: Log, tmp_path: Path) -> None:
    write(log, path := tmp_path / f"log{end}")
    assert path.is_file() and equal(read(path), log)


@pytest.mark.parametrize("end", [".mcap", ".db3", ""])
def test_rosbags_reads_what_we_wrote(end: str, log: Log, tmp_path: Path) -> None:
    path = tmp_path / f"log{end}"
    write(log, path)
    with AnyReader([path]) as reader:  # type hashes are checked on the way
        told = [(c, ns, reader.deserialize(raw, c.msgtype)) for c, ns, raw in reader.messages()]
    states = [(ns, m) for c, ns, m in told if c.topic == "/joint_states"]
    samples = [m for c, _, m in told if c.topic == "/rtde"]
    assert len(states) == len(samples) == 40
    for k, (ns, state) in enumerate(states):
        assert (
            ns
            == round(log.t[k] * 1e9)
            == state.header.stamp.sec * 10**9 + state.header.stamp.nanosec
        )
        assert state.name == list(JOINTS)
        np.testing.assert_array_equal(state.position, log.channels["actual_q"][k])
        np.testing.assert_array_equal(state.velocity, log.channels["actual_qd"][k])
        np.testing.assert_array_equal(state.effort, log.channels["actual_current"][k])
        np.testing.assert_array_equal(
            samples[k].actual_tcp_pose, log.channels["actual_TCP_pose"][k]
        )


def test_mcap_s_own_reader_finds_it_sound(log: Log, tmp_path: Path) -> None:
    write(log, tmp_path / "log.mcap")
    with (tmp_path / "log.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert summary.statistics.message_count == 80 and summary.chunk_indexes
        told = [(c.topic, m) for _, c, _, m in reader.iter_decoded_messages()]
        (about,) = reader.iter_metadata()
    registers = [m.output_int_register_12 for topic, m in told if topic == "/rtde"]
    assert registers == list(range(40))
    assert about.metadata["urdyn.source.path"] == "monday.csv"


def test_a_bag_replaces_a_bag_and_nothing_else(log: Log, tmp_path: Path) -> None:
    write(log, tmp_path / "bag")
    write(log.slice(0, 10), tmp_path / "bag")
    assert len(read(tmp_path / "bag")) == 10
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="something else"):
        write(log, tmp_path / "folder")
    with pytest.raises(InputError, match="no such folder"):
        write(log, tmp_path / "none" / "bag.db3")
    assert sorted(child.name for child in tmp_path.iterdir()) == ["bag", "folder"]


@pytest.mark.parametrize("form", ["", ".db3"])
def test_what_a_link_points_to_is_replaced_and_the_link_stays(
    form: str, log: Log, tmp_path: Path
) -> None:
    (disk := tmp_path / "disk").mkdir()
    write(log, path := disk / f"bag{form}")
    (link := tmp_path / f"link{form}").symlink_to(path)
    write(log.slice(0, 10), link)
    assert link.is_symlink() and len(read(path)) == len(read(link)) == 10
    assert list(disk.iterdir()) == [path]


def test_a_bag_with_more_than_a_log_is_left(log: Log, tmp_path: Path) -> None:
    foreign = bag(tmp_path / "foreign", joint_states(3))
    write(log, own := tmp_path / "own")
    (own / "notes.txt").write_text("gripper B")
    for path in (foreign, own):
        before = {child: child.read_bytes() for child in path.iterdir()}
        with pytest.raises(InputError, match="a bag with more than one of our logs"):
            write(log, path)
        assert {child: child.read_bytes() for child in path.iterdir()} == before


@pytest.mark.parametrize("form", [".csv", ".mcap", ""])
def test_no_recording_is_converted_into_its_own_place(form: str, log: Log, tmp_path: Path) -> None:
    write(log, path := tmp_path / f"monday{form}")
    (linked := tmp_path / f"linked{form}").symlink_to(path)
    before = sha256(path)
    pairs = [(path, path), (linked, path), (path, linked)]
    if not form:
        pairs += [(path, path / "monday.db3"), (path / "monday.db3", path)]
    for one, other in pairs:
        told = CliRunner().invoke(app, ["convert", str(one), str(other), "--rows", "0:9"])
        assert told.exit_code == 1 and "would take the place of" in told.stderr
    assert sha256(path) == before and len(read(path)) == 40


def test_a_bag_that_cannot_take_anothers_place_leaves_it(log: Log, tmp_path: Path) -> None:
    write(log, tmp_path / "bag")
    with pytest.raises(FileNotFoundError):
        _put(tmp_path / "none", tmp_path / "bag", tmp_path / "aside")
    assert len(read(tmp_path / "bag")) == 40


FINDING = {
    "kind": "friction_increase",
    "joint": 2,
    "onset_s": 1.0,
    "alarm_s": 2.5,
    "severity": 0.4,
    "confidence": 0.97,
    "time_to_failure_s": {"median": 3600.0, "lo": 1800.0, "hi": 7200.0},
    "evidence": {"delta": 0.12},
}


def test_history_and_findings_become_one_mcap(tmp_path: Path) -> None:
    folder = tmp_path / "monday"
    folder.mkdir()
    t = np.arange(6.0)
    columns = {"t": t, "elbow_joint.coulomb": 3 + t, "widened": t > 3}
    pq.write_table(pa.table(columns), folder / "history.parquet")
    (folder / "findings.json").write_text(json.dumps({"findings": [FINDING]}))
    told = CliRunner().invoke(app, ["convert", str(folder), str(tmp_path / "x.mcap")])
    assert told.exit_code == 0, told.stderr
    with AnyReader([tmp_path / "x.mcap"]) as reader:
        told = [(c.topic, ns, reader.deserialize(r, c.msgtype)) for c, ns, r in reader.messages()]
    assert [ns for _, ns, _ in told] == sorted(ns for _, ns, _ in told)
    history = [m.elbow_joint_coulomb for topic, _, m in told if topic == "/urdyn/history"]
    assert history == list(3 + t)
    ((ns, array),) = [(ns, m) for topic, ns, m in told if topic == "/diagnostics"]
    (line,) = array.status
    assert ns == 2_500_000_000 and line.level == 1
    assert line.name == "urdyn: elbow_joint" and "60 min left" in line.message
    ((text,),) = [(m.data,) for topic, _, m in told if topic == "/urdyn/findings"]
    assert json.loads(text) == FINDING


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "cannot be read"),
        ("[" * 10**5, "cannot be read"),
        ('{"a": 1}', "no list"),
        ('[{"kind": "rust"}]', "no alarm_s"),
        (f'[{{"alarm_s": {10**400}}}]', "no alarm_s"),
    ],
)
def test_what_are_no_findings_is_one_line(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "findings.json").write_text(text)
    out = tmp_path / "x.mcap"
    told = CliRunner().invoke(app, ["convert", str(tmp_path / "findings.json"), str(out)])
    assert told.exit_code == 1 and reason in told.stderr and told.stderr.count("\n") == 1
    assert not out.exists()
