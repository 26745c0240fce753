"""Every dialect reads to the same log, and every real recording reads as it is described."""

from __future__ import annotations

import bz2
import gzip
import hashlib
import lzma
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from urdyn.errors import LogError
from urdyn.io import read, read_table
from urdyn.types import Array

SPEC = "timestamp,actual_q*2,actual_current*2"
UR10E = "timestamp,actual_q*6,actual_qd*6,actual_current*6,target_current*6,target_moment*6"

Rewrite = Callable[[list[str]], bytes]


def joined(lines: list[str], end: str = "\n") -> bytes:
    return end.join([*lines, ""]).encode()


def quoted(row: str) -> str:
    return ",".join(f'"{cell}"' for cell in row.split(","))


def zstd(data: bytes) -> bytes:
    packed: bytes = pa.Codec("zstd").compress(data, asbytes=True)
    return packed


DIALECTS: dict[str, Rewrite] = {
    "commas": joined,
    "carriage returns": lambda t: joined(t, "\r\n"),
    "spaces, as UR's recorder": lambda t: joined([r.replace(",", " ") for r in t], "\r\n"),
    "aligned with spaces": lambda t: joined([r.replace(",", "   ") for r in t]),
    "commas and spaces": lambda t: joined([r.replace(",", ", ") for r in t]),
    "tabs": lambda t: joined([r.replace(",", "\t") for r in t]),
    "decimal commas": lambda t: joined([r.replace(",", ";").replace(".", ",") for r in t]),
    "semicolons": lambda t: joined([r.replace(",", ";") for r in t]),
    "decimal commas in quotes": lambda t: joined([quoted(r.replace(".", "~")) for r in t]).replace(
        b"~", b","
    ),
    "bars": lambda t: joined([r.replace(",", "|") for r in t]),
    "semicolons, as Excel is told": lambda t: joined(
        ["sep=;", *(r.replace(",", ";").replace(".", ",") for r in t)], "\r\n"
    ),
    "byte order mark": lambda t: b"\xef\xbb\xbf" + joined(t),
    "quotes": lambda t: joined([quoted(r) for r in t]),
    "quoted header": lambda t: joined([quoted(t[0]), *t[1:]]),
    "trailing commas": lambda t: joined([r + "," for r in t]),
    "trailing commas in the rows": lambda t: joined([t[0], *(r + ",," for r in t[1:])]),
    "trailing commas in the header": lambda t: joined([t[0] + ",", *t[1:]]),
    "a counter": lambda t: joined(["," + t[0], *(f"{n},{r}" for n, r in enumerate(t[1:]))]),
    "a comment mark": lambda t: joined(["# " + t[0], *t[1:]]),
    "a remark above": lambda t: joined(["# recorded by me, at last", *t]),
    "remarks above a comment mark": lambda t: joined(["# cell 9", "#", "# " + t[0], *t[1:]]),
    "no last line feed": lambda t: joined(t)[:-1],
    "gzip": lambda t: gzip.compress(joined(t)),
    "gzip in two members": lambda t: gzip.compress(joined(t[:9])) + gzip.compress(joined(t[9:])),
    "bzip2": lambda t: bz2.compress(joined(t)),
    "xz": lambda t: lzma.compress(joined(t)),
    "zstd": lambda t: zstd(joined(t)),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_dialect_is_the_same_log(dialect: str, text: list[str], tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(data := DIALECTS[dialect](text))
    log = read(path)
    np.testing.assert_array_equal(log.t, [float(f"{10 + n / 100:.2f}") for n in range(50)])
    q = [[n / 1000, 0.5] for n in range(50)]
    np.testing.assert_array_equal(log.channels["actual_q"], q)
    np.testing.assert_array_equal(log.channels["actual_current"][:, 1], -1.5)
    assert set(log.channels) == {"actual_q", "actual_current"}
    assert log.defects == ()
    assert log.source.path == str(path)
    assert log.source.sha256 == hashlib.sha256(data).hexdigest()


@pytest.fixture
def path(text: list[str], tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    path.write_bytes(joined(text))
    return path


def test_columns_name_a_headerless_file(rows: list[str], path: Path) -> None:
    titled = read(path)
    path.write_bytes(joined(rows))
    log = read(path, columns=SPEC)
    np.testing.assert_array_equal(log.channels["actual_q"], titled.channels["actual_q"])
    assert set(read(path, columns="timestamp,-*2,actual_current*2").channels) == {"actual_current"}


def test_what_is_said_above_a_headerless_file_is_no_row(rows: list[str], path: Path) -> None:
    path.write_bytes(joined(["sep=,", *rows]))
    log = read(path, columns=SPEC)
    assert (len(log), log.defects, log.source.path) == (50, (), str(path))


def test_a_comma_of_thousands_is_no_decimal_comma(text: list[str], path: Path) -> None:
    path.write_bytes(joined([*text[:9], text[9].replace(",0.5,", ',"1,000.5",'), *text[10:]]))
    log = read(path)
    assert [(d.kind, d.line) for d in log.defects] == [("text in place of a number", 10)]
    np.testing.assert_array_equal(np.delete(log.channels["actual_q"][:, 1], 8), 0.5)


def test_columns_take_the_place_of_a_header(path: Path) -> None:
    log = read(path, columns="timestamp,target_q*2,target_current*2")
    assert len(log) == 50
    assert set(log.channels) == {"target_q", "target_current"}


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("timestamp,actual_q*6", "--columns names 7 columns, the rows have 5"),
        ("timestamp,actual_q*x,a,b", "--columns cannot be read.*write --columns timestamp"),
        ("timestamp,actual_q*0,a,b", "--columns cannot be read"),
        ("timestamp,,a,b,c", "--columns cannot be read"),
        ("timestamp,a,a,b,c", "two columns are called a"),
    ],
)
def test_columns_that_do_not_fit_are_refused(spec: str, message: str, path: Path) -> None:
    with pytest.raises(LogError, match=message):
        read(path, columns=spec)


@pytest.mark.parametrize(
    ("asked", "q", "resolved"),
    [
        ((10, 20), range(10, 20), (10, 20)),
        ((None, 3), range(3), (0, 3)),
        ((47, None), range(47, 50), (47, 50)),
        ((None, None), range(50), (0, 50)),
    ],
)
def test_rows_are_the_files_own(
    asked: tuple[int | None, int | None], q: range, resolved: tuple[int, int], path: Path
) -> None:
    log = read(path, rows=asked)
    np.testing.assert_array_equal(log.channels["actual_q"][:, 0], [n / 1000 for n in q])
    assert log.source.rows == resolved


def test_rows_count_lost_rows_and_tell_only_their_own_damage(
    text: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(joined([*text[:2], "", text[2], "10.9", *text[4:20], "short", *text[20:]]))
    log = read(path, rows=(3, 10))
    np.testing.assert_array_equal(log.channels["actual_q"][:, 0], np.arange(3, 10) / 1000)
    assert log.defects == ()


@pytest.mark.parametrize("asked", [(5, 5), (9, 3), (-3, 9), (0, 51), (50, None), (60, 70)])
def test_rows_that_are_not_there_are_refused(asked: tuple[int, int | None], path: Path) -> None:
    with pytest.raises(LogError, match="--rows"):
        read(path, rows=asked)


def test_rate_makes_stamps_where_there_are_none(text: list[str], tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    lines = [line.partition(",")[2] for line in text]
    path.write_bytes(joined([*lines[:4], "damage", *lines[5:]]))
    log = read(path, rate=125.0)
    np.testing.assert_array_equal(log.t, np.delete(np.arange(50), 3) / 125.0)
    for rate in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(LogError, match="is not a rate"):
            read(path, rate=rate)


@pytest.mark.parametrize("stamp", ["12:00:{:06.3f}", "29.11.2026 12:00:{:06.3f}"])
def test_stamps_that_are_text_are_not_called_missing(
    stamp: str, rows: list[str], path: Path
) -> None:
    lines = [",".join([stamp.format(float(t)), *rest]) for t, *rest in (r.split(",") for r in rows)]
    path.write_bytes(joined([path.read_text().split("\n")[0], *lines]))
    with pytest.raises(LogError, match=f"time stamps as text, such as {stamp[:-9]}.*make them sec"):
        read(path)
    assert len(read(path, rate=100.0)) == 50


def test_lapses_of_parquet_are_seconds(tmp_path: Path) -> None:
    t = np.arange(5) * 10
    for unit, per in (("ms", 1), ("us", 1000), ("ns", 1_000_000)):
        stamps = pa.array(t * per, pa.duration(unit))
        pq.write_table(pa.table({"timestamp": stamps, "payload": t}), tmp_path / "log.parquet")
        np.testing.assert_allclose(read(tmp_path / "log.parquet").t, t / 1000, rtol=1e-12)


def test_rate_is_refused_where_there_are_stamps(path: Path) -> None:
    with pytest.raises(LogError, match="has time stamps of its own"):
        read(path, rate=125.0)


def test_logs_that_follow_each_other_are_the_log_they_were_cut_from(
    text: list[str], tmp_path: Path
) -> None:
    """Their hashes are told; where the second's stamps begin anew, they count on after a minute."""
    head, *rows = text
    half = len(rows) // 2
    parts = tmp_path / "first.csv", tmp_path / "second.csv"
    for part, some in zip(parts, (rows[:half], rows[half:]), strict=True):
        part.write_bytes(joined([head, *some]))
    (tmp_path / "whole.csv").write_bytes(joined(text))
    log, whole = read(*parts), read(tmp_path / "whole.csv")
    np.testing.assert_array_equal(log.t, whole.t)
    for name, values in whole.channels.items():
        np.testing.assert_array_equal(log.channels[name], values)
    hashes = [hashlib.sha256(part.read_bytes()).hexdigest() for part in parts]
    assert log.source.sha256.split() == hashes
    (tmp_path / "again.csv").write_bytes(joined(text).replace(b"-1.5", b"-1.6"))
    again = read(tmp_path / "whole.csv", tmp_path / "again.csv")
    np.testing.assert_allclose(again.t, [*whole.t, *(whole.t - whole.t[0] + whole.t[-1] + 60.0)])


def test_logs_that_cannot_follow_each_other_are_refused(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_bytes(joined(["timestamp,actual_q_0", "0.0,1.0", "0.1,1.1", "0.2,1.2"]))
    with pytest.raises(LogError, match=r"other\.csv.*in columns: actual_current"):
        read(path, other, columns=None)
    with pytest.raises(LogError, match="takes a slice of one"):
        read(path, path, rows=(0, 2))


def lived(path: Path, t: Array, speed: float, seed: int, ahead: float = 0.0) -> Path:
    """A log of one joint at constant speed [rad/s], whose current has noise while it moves."""
    noise = np.random.default_rng(seed).standard_normal(200)[np.rint(100 * t).astype(int)]
    v = np.full(len(t), speed)
    told = "timestamp,received,actual_q_0,actual_qd_0,actual_current_0"
    columns = np.stack([t, t + ahead, v * t, v, v * noise], axis=1)
    np.savetxt(path, columns, "%.6f", ",", header=told, comments="")
    return path


def test_rows_that_would_count_twice_are_refused(tmp_path: Path) -> None:
    t = np.arange(100) / 100.0
    one = lived(tmp_path / "a.csv", t[:60], 0.5, 1)
    other = lived(tmp_path / "b.csv", t[50:], 0.5, 1)
    with pytest.raises(LogError, match=r"b\.csv: 10 of its rows are in .*a\.csv, too"):
        read(one, other)
    copy = shutil.copy(one, tmp_path / "copy.csv")
    with pytest.raises(LogError, match=r"copy\.csv: the same rows as .*a\.csv"):
        read(one, other, copy)


def test_a_row_that_ends_a_log_and_begins_the_next_is_kept_once(tmp_path: Path) -> None:
    """A recorder that begins another file each hour may write it twice."""
    t = np.arange(100) / 100.0
    one = lived(tmp_path / "a.csv", t[:60], 0.5, 1)
    log = read(one, lived(tmp_path / "b.csv", t[59:], 0.5, 1))
    assert len(log) == 100 and [defect.kind for defect in log.defects] == ["repeated stamp"]


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_a_robot_that_begins_anew_may_do_as_it_did(speed: float, tmp_path: Path) -> None:
    """At rest it repeats every bit, and in motion all but the noise of its sensors."""
    t, ahead = np.arange(100) / 100.0, (1.7e9, 1.7e9 + 300.0)
    paths = [lived(tmp_path / f"{k}.csv", t, speed, k, ahead[k]) for k in range(2)]
    assert np.diff(read(*paths).t).max() == pytest.approx(300.0 - t[-1], abs=1e-5)


@pytest.mark.parametrize("days", [0.0, 3.0])
def test_recordings_that_were_made_in_another_order_are_refused(
    days: float, tmp_path: Path
) -> None:
    """Where both clocks say so; one alone may have been set, as at the end of summer time.

    They are 20 ppm apart: in three days, five seconds.
    """
    t, later = np.arange(100) / 100.0, 86400.0 * days
    first = lived(tmp_path / "1.csv", t, 0.5, 1, 1.7e9)
    second = lived(tmp_path / "2.csv", t + 1.0, 0.5, 1, 1.7e9)
    rows = np.genfromtxt(second, delimiter=",", names=True)
    rows["timestamp"] += later
    rows["received"] += later * (1.0 + 2e-5)
    np.savetxt(second, rows, "%.6f", ",", header=",".join(rows.dtype.names), comments="")
    with pytest.raises(LogError, match="clock and the recorder's go back together"):
        read(second, first)
    assert len(read(first, second)) == 200
    assert len(read(second, lived(first, t, 0.5, 1, 1.7e9 - 3600.0))) == 200


def test_angles_of_no_joint_are_refused_where_they_stand(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(joined(["timestamp,actual_q", "0.0,1.0", "0.1,1.1"]))
    with pytest.raises(LogError, match=r"log\.csv: actual_q has the shape"):
        read(path)


def test_channels_limit_what_is_kept(path: Path) -> None:
    assert set(read(path, channels=("actual_q", "actual_qd")).channels) == {"actual_q"}
    with pytest.raises(LogError, match="has no actual_qd; it has actual_current, actual_q, time"):
        read(path, channels=("actual_qd",))
    with pytest.raises(LogError, match="has none of actual_qd, payload; it has actual_current"):
        read(path, channels=("actual_qd", "payload", "actual_qd"))


def test_what_another_table_has_is_told_in_a_line(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(",".join(f"x{k:02d}_mean" for k in range(30)) + "\n" + "1," * 29 + "1\n")
    with pytest.raises(LogError, match=r"x11_mean and 18 more; name its .* by --columns$"):
        read(path, channels=("actual_q",))


def test_a_missing_joint_is_nan(text: list[str], tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(joined([text[0].replace("q_1", "q_4"), *text[1:]]))
    log = read(path)
    assert log.channels["actual_q"].shape == (50, 6)
    assert np.isnan(log.channels["actual_q"][:, 3]).all()
    assert {(d.kind, d.count) for d in log.defects} == {("missing column", 8)}  # 4 of currents too


@pytest.mark.parametrize("lacking", ["actual_q_2", "actual_qd_2", "actual_current_1"])
def test_every_joint_has_its_column_in_every_channel(lacking: str, tmp_path: Path) -> None:
    """Whether the first joint's column lacks or the last one's: there is a place for it."""
    names = [f"{c}_{j}" for c in ("actual_q", "actual_qd", "actual_current") for j in range(3)]
    kept = [name for name in names if name != lacking]
    rows = [[0.01 * k, *(np.sin(0.1 * k + j) for j in range(len(kept)))] for k in range(50)]
    path = tmp_path / "log.csv"
    text = [",".join(["timestamp", *kept]), *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(text))
    log = read(path)
    channel, _, joint = lacking.rpartition("_")
    for name in ("actual_q", "actual_qd", "actual_current"):
        unknown = np.isnan(log.channels[name]).all(axis=0)
        width = 6 if joint == "1" else 3
        assert unknown.tolist() == [
            (name == channel and j == int(joint)) or j >= 3 for j in range(width)
        ]


def test_registers_keep_their_numbers(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"timestamp,output_int_register_0,output_int_register_12\n1,2,3\n2,3,4\n")
    assert set(read(path).channels) == {"output_int_register_0", "output_int_register_12"}


def test_instants_and_flags_of_a_cobotops_log_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "Num;Timestamp;Current_J0;Temperature_T0;Current_J1;Temperature_J1;Speed_J0;grip_lost;;\n"
        '1;2022-10-26T08:17:21.847Z;0,5;27,875;-2,1E-3;29;"0,25";False;;\n'
        '2;"2022-10-26T10:17:22.847+02:00";0,5;27,875;-2;29;0,25;True;;\n',
    )
    log = read(path)
    assert log.t[1] - log.t[0] == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_array_equal(log.channels["actual_current"], [[0.5, -2.1e-3], [0.5, -2.0]])
    np.testing.assert_array_equal(log.channels["joint_temperatures"], [[27.875, 29.0]] * 2)
    np.testing.assert_array_equal(log.channels["actual_qd"], [[0.25, np.nan]] * 2)
    np.testing.assert_array_equal(log.channels["grip_lost"], [0, 1])


def test_parquet_lists_and_columns_are_the_same_log(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    q = np.arange(12.0).reshape(4, 3)
    stamps = np.array([0, 10, 20, 30], dtype="datetime64[ms]")
    table = {"timestamp": stamps, "actual_q": list(q), "mode": list("abcd"), "ok": [True] * 4}
    pq.write_table(pa.table(table), path)
    log = read(path)
    np.testing.assert_allclose(log.t, [0, 0.01, 0.02, 0.03], rtol=1e-12)
    np.testing.assert_array_equal(log.channels["actual_q"], q)
    np.testing.assert_array_equal(log.channels["ok"], 1.0)
    assert [str(d) for d in log.defects] == ["1 x text column (kept out: mode)"]
    np.testing.assert_array_equal(read(path, rows=(1, 3)).channels["actual_q"], q[1:3])
    flat = {"timestamp": [0.0, 1, 2, 3], **{f"actual_q_{k}": q[:, k] for k in range(3)}}
    pq.write_table(pa.table(flat), path)
    np.testing.assert_array_equal(read(path).channels["actual_q"], q)
    assert read(path, rows=(1, 3)).source.rows == (1, 3)


def test_parquet_lists_of_several_lengths_are_refused_though_their_sum_fits(tmp_path: Path) -> None:
    """One value too few and later one too many would shift all between by a joint."""
    path, q = tmp_path / "log.parquet", [[0.0, 1.0, 2.0] for _ in range(9)]
    q[3], q[5] = q[3][:2], [*q[5], 3.0]
    pq.write_table(pa.table({"timestamp": np.arange(9) / 100.0, "actual_q": pa.array(q)}), path)
    with pytest.raises(LogError, match="lists of more than one length"):
        read(path)


def test_lists_of_several_lengths_that_nobody_asked_for_are_no_matter(tmp_path: Path) -> None:
    lists = pa.array([[1.0]] * 4 + [[1.0, 1.0]] * 5)
    table = {"timestamp": np.arange(9) / 100.0, "actual_q": [[0.0, 1.0, 2.0]] * 9, "alarms": lists}
    pq.write_table(pa.table(table), tmp_path / "log.parquet")
    assert len(read(tmp_path / "log.parquet", channels=("actual_q",))) == 9


@pytest.mark.parametrize(("nothing", "width"), [([], -1), (None, -1), (None, 3)])
@pytest.mark.parametrize("rows", [[0], [5], range(9), range(100)])
def test_lists_that_are_empty_or_missing_are_empty_fields(
    nothing: list[float] | None, width: int, rows: Sequence[int], tmp_path: Path
) -> None:
    """Wherever they stand: no column vanishes for them, and no log is refused."""
    lists = [nothing if k in rows else [float(k), 1.0, 2.0] for k in range(100)]
    columns = {
        "timestamp": np.arange(100) / 100.0,
        "actual_q": [[0.0, 1.0, 2.0]] * 100,
        "actual_current": pa.array(lists, pa.list_(pa.float64(), width)),
    }
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    log = read(tmp_path / "log.parquet")
    expected = [one or [np.nan] * 3 for one in lists]
    np.testing.assert_array_equal(log.channels["actual_current"], expected)
    assert log.defects[0].kind == "empty field"


@pytest.mark.parametrize("lists", [False, True])
def test_nulls_of_parquet_are_empty_fields(tmp_path: Path, lists: bool) -> None:
    """As pandas writes what was not measured."""
    path = tmp_path / "log.parquet"
    t, q = np.arange(50) / 100.0, np.linspace(0.0, 0.1, 50).tolist()
    columns = [
        [None if (k, joint) == (9, 2) else value for k, value in enumerate(q)] for joint in range(6)
    ]
    fields: dict[str, object] = {f"actual_q_{k}": columns[k] for k in range(6)}
    if lists:
        fields = {"actual_q": pa.array(list(zip(*columns, strict=True)))}
    pq.write_table(pa.table({"timestamp": t, **fields}), path)
    log = read(path)
    (defect,) = log.defects
    assert (defect.kind, defect.count) == ("empty field", 1)
    np.testing.assert_array_equal(np.argwhere(np.isnan(log.channels["actual_q"])), [[9, 2]])


def test_parquet_names_its_own_columns(tmp_path: Path) -> None:
    pq.write_table(pa.table({"timestamp": [0.0], "actual_q_0": [1.0]}), tmp_path / "log.parquet")
    with pytest.raises(LogError, match="is Parquet, which names its own columns; leave out"):
        read(tmp_path / "log.parquet", columns="timestamp,actual_q")


def test_rows_of_a_long_parquet_are_found_in_their_batch(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    t = np.arange(200_000) / 500
    q = pa.FixedSizeListArray.from_arrays(pa.array(np.repeat(t, 2)), 2)
    pq.write_table(pa.table({"timestamp": t, "actual_q": q, "payload": t}), path)
    log = read(path, rows=(150_000, 150_010), channels=("actual_q",))
    np.testing.assert_array_equal(log.channels["actual_q"][:, 1], t[150_000:150_010])
    assert set(log.channels) == {"actual_q"}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"timestamp": [1.0, 2.0], "actual_q": [[1.0, 2.0], [1.0]]}, "more than one length"),
        ({"timestamp": pa.array([], pa.float64())}, "has no data"),
        ({"timestamp": [1.0, 2.0], "mode": ["a", "b"]}, "has no channel"),
        ({"actual_q_0": [1.0, 2.0]}, "has no column of time stamps"),
    ],
)
def test_parquet_that_is_no_log_is_refused(
    table: dict[str, object], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(table), path)
    with pytest.raises(LogError, match=message):
        read(path)


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("ur-20_01_17-p1", 918),
        ("ur-20_02_10-30sec_12harm", 3691),
        ("ur-20_02_12-40sec_12harm", 4639),
        ("ur-20_02_19_15harm50sec", 5347),
    ],
)
def test_sound_recordings_have_no_defects(name: str, rows: int, recordings: Path) -> None:
    log = read(recordings / "ur10e_dynamics" / f"{name}.csv", columns=UR10E)
    assert (len(log), log.defects) == (rows, ())
    assert {v.shape for v in log.channels.values()} == {(rows, 6)}


def test_the_loaded_run_tells_its_torn_packets_and_its_half_row(recordings: Path) -> None:
    path = recordings / "ur10e_dynamics" / "ur-20_02_19_15harm50secLoad.csv"
    log = read(path, columns=UR10E)
    assert len(log) == 6107 - 1 - 9
    told = {(d.kind, d.count, d.line) for d in log.defects}
    assert ("truncated row", 1, 6107) in told
    assert {("impossible stamp", 1, 5), ("stray stamp", 8, 2), ("gap", 1, 11)} <= told
    assert not any(np.isnan(values).any() for values in log.channels.values())


def test_a_ur3e_recording_reads_whole(recordings: Path) -> None:
    log = read(recordings / "ur3e_rtde" / "ur3e_payload_1070g.csv")
    assert len(log) == 888
    assert [d.kind for d in log.defects] == ["text column"]
    temperature = log.channels["joint_temperatures"]
    assert temperature.shape == (888, 6)
    assert temperature.min() > 30
    assert temperature.max() < 45
    assert "output_int_register_12" in log


def test_production_hours_read_with_their_empty_rows(recordings: Path) -> None:
    log = read(recordings / "ur3_cobotops" / "cobotops_part1.csv")
    assert len(log) == 2869
    assert {"actual_current", "joint_temperatures", "actual_qd", "grip_lost"} <= set(log.channels)
    assert {d.kind: d.line for d in log.defects} == {"empty field": 815, "gap": 1096}


def test_freedrive_wants_a_rate(recordings: Path) -> None:
    path = recordings / "ur5e_freedrive" / "robot_data_o1.csv"
    with pytest.raises(LogError, match="--rate"):
        read(path)
    assert len(read(path, rate=125.0)) == 855


def test_poses_are_a_table_and_no_log(recordings: Path) -> None:
    path = recordings / "ur10_laser_tracker" / "series_a.csv"
    table, source = read_table(path)
    assert len(table) == 11_911
    assert table.defects == ()
    assert len(source.sha256) == 64
    assert table.channels["measurement_x"][0] == 2361.9831
    with pytest.raises(LogError):
        read(path)


@pytest.mark.parametrize("written", ["actual_q[{0}]", "actual_q_{1}", "actual_q[{1}]"])
def test_values_of_a_joint_are_known_however_they_are_counted(tmp_path: Path, written: str) -> None:
    """In brackets, or from one on: no vector of six that begins at 0 has a seventh value."""
    names = [written.format(j, j + 1) for j in range(6)]
    path = tmp_path / "log.csv"
    path.write_text(",".join(["timestamp", *names]) + "\n0,0,1,2,3,4,5\n0.01,0,1,2,3,4,5\n")
    np.testing.assert_array_equal(read(path).channels["actual_q"][0], np.arange(6.0))
