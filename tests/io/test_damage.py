"""Every way in which a recording was ever seen broken: one clear line, or a defect that is told."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from urdyn.errors import LogError
from urdyn.io import read
from urdyn.io.clock import PAUSE

Break = Callable[[list[str]], bytes]


def joined(lines: list[str], end: str = "\n") -> bytes:
    return end.join([*lines, ""]).encode()


def with_line(number: int, line: str) -> Break:
    """`line` in the place of a line of the file."""
    return lambda text: joined([*text[: number - 1], line, *text[number:]])


def with_more(number: int, *lines: str) -> Break:
    """`lines` before a line of the file."""
    return lambda text: joined([*text[: number - 1], *lines, *text[number - 1 :]])


def restamped(shift: float, first: int, stop: int) -> Break:
    """The clock is off in the data rows first:stop."""

    def broken(text: list[str]) -> bytes:
        cells = [line.split(",") for line in text]
        for row in range(first + 1, min(stop + 1, len(cells))):
            cells[row][0] = f"{float(cells[row][0]) + shift:.2f}"
        return joined([",".join(row) for row in cells])

    return broken


def counted(since: float, by: int) -> Break:
    """Stamps that count so many to the second, and began long ago [s]."""

    def broken(text: list[str]) -> bytes:
        cells = [line.split(",", 1) for line in text[1:]]
        rows = [f"{round((since + float(stamp)) * by)},{rest}" for stamp, rest in cells]
        return joined([text[0], *rows])

    return broken


def stamped(date: Callable[[int], str]) -> Break:
    """Stamps that are written as dates, by the row."""
    return lambda t: joined(
        [t[0], *(f"{date(n)},{row.split(',', 1)[1]}" for n, row in enumerate(t[1:]))]
    )


MENDED: dict[str, tuple[Break, str, int, int, int]] = {
    # what -> how, kind of defect, count, line, rows left of 50
    "half a last row": (lambda t: joined(t)[:-12], "truncated row", 1, 51, 49),
    "a short row": (with_line(8, "10.06,0.006"), "short row", 1, 8, 49),
    "a long row": (with_line(8, "10.06,0,0,0,0,7,8"), "long row", 1, 8, 49),
    "blank lines": (with_more(5, "", "  "), "blank line", 2, 5, 50),
    "a second header": (lambda t: joined([*t[:9], t[0], *t[9:]]), "repeated header", 1, 10, 50),
    "a word": (with_line(9, "10.07,overrun,0,0,0"), "text in place of a number", 1, 9, 50),
    "an empty field": (with_line(9, "10.07,,0,,0"), "empty field", 2, 9, 50),
    "not a number": (with_line(9, "10.07,nan,NaN,0,0"), "NaN", 2, 9, 50),
    "infinite": (with_line(9, "10.07,inf,0,-inf,0"), "impossible value", 2, 9, 50),
    "an angle of 1e5": (with_line(9, "10.07,1e5,0,0,0"), "impossible value", 1, 9, 50),
    "a current of 1e282": (with_line(9, "10.07,0,0,1e282,0"), "impossible value", 1, 9, 50),
    "a repeated row": (lambda t: joined([*t[:9], t[8], *t[9:]]), "repeated stamp", 1, 10, 50),
    "a torn row": (with_more(10, "10.07,9,9,9,9"), "repeated stamp with other values", 1, 10, 50),
    "a lost second": (restamped(1.0, 20, 99), "gap", 1, 22, 50),
    "two rows swapped": (
        lambda t: joined([*t[:9], t[10], t[9], *t[11:]]),
        "stray stamp",
        1,
        10,
        49,
    ),
    "a torn packet": (restamped(-9.7, 4, 9), "stray stamp", 5, 6, 45),
    "the clock restarts": (restamped(-9.0, 30, 99), "clock set back", 1, 32, 50),
    "another recording follows": (lambda t: joined([*t, *t]), "clock set back", 1, 53, 100),
    "twenty recordings follow": (
        lambda t: joined([t[0], *t[1:41] * 21]),
        "clock set back",
        20,
        42,
        840,
    ),
    "torn, then restarted": (
        lambda t: joined([*t[:30], *t[1:9], "99,0,0,0,0", *t[9:20]]),
        "clock set back",
        1,
        31,
        48,
    ),
    "a stamp of 1e300": (with_line(9, "1e300,0,0,0,0"), "impossible stamp", 1, 9, 49),
    "no stamp": (with_line(9, ",0,0,0,0"), "row without a stamp", 1, 9, 49),
    "null bytes": (with_line(9, "\0" * 40), "null bytes", 1, 9, 49),
    "bytes that are no text": (
        lambda t: joined(t).replace(b"10.07,0.007", b"10.07,\xff\xfe"),
        "text in place of a number",
        1,
        9,
        50,
    ),
    "a stray quote": (with_line(9, '10.07,"0.5,0,0,0'), "short row", 1, 9, 49),
    "an empty row": (with_line(9, "10.07,,,,"), "row without values", 1, 9, 50),
    "a column of words": (
        lambda t: joined([t[0] + ",mode", *(row + ",RUNNING" for row in t[1:])]),
        "text column",
        1,
        1,
        50,
    ),
}


@pytest.mark.parametrize("what", MENDED)
def test_damage_is_mended_and_told_with_its_line(
    what: str, text: list[str], tmp_path: Path
) -> None:
    broken, kind, count, line, left = MENDED[what]
    path = tmp_path / "log.csv"
    path.write_bytes(broken(text))
    log = read(path)
    assert len(log) == left
    told = {defect.kind: defect for defect in log.defects}
    defect = told[kind]
    assert (defect.count, defect.line) == (count, line), str(defect)
    assert (np.diff(log.t) > 0).all()
    assert all(np.abs(v[np.isfinite(v)]).max() < 1e3 for v in log.channels.values())


@pytest.mark.parametrize("came", ["nan", "inf", "-1.0", "1764500000.0", ""])
def test_a_recorder_whose_clock_tells_nothing_leaves_the_pause_to_be_guessed(
    came: str, text: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(joined([f"{text[0]},received", *(f"{row},{came}" for row in text[1:] * 2)]))
    if came[-2:] == ".0":  # of the second of two files that somebody has joined
        path.write_bytes(path.read_bytes().replace(f",{came}".encode(), b",9.0", 50))
    log = read(path)
    assert log.t[50] - log.t[49] == pytest.approx(PAUSE)


@pytest.mark.parametrize("word", ["", "None", "null", "N/A", "-"])
@pytest.mark.parametrize("titles", [["timestamp,actual_q_0,amperes"], []])
def test_a_column_that_begins_with_words_for_nothing_is_one_of_numbers(
    word: str, titles: list[str], tmp_path: Path
) -> None:
    """As programs write it until a robot is switched on: for longer than is sampled."""
    said = [word if k < 150 else str(k) for k in range(1000)]
    rows = [f"{k / 100},{value},{value}" for k, value in enumerate(said)]
    (path := tmp_path / "log.csv").write_bytes(joined([*titles, *rows]))
    log = read(path, columns=None if titles else "timestamp,actual_q*1,amperes")
    np.testing.assert_array_equal(log.channels["amperes"], [*[np.nan] * 150, *range(150, 1000)])
    assert [(d.kind, d.count) for d in log.defects] == [
        ("empty field", 300),
        ("row without values", 150),
    ]


STATES = "actual_q_0,actual_qd_0,actual_current_0"


def test_a_row_of_zeros_is_no_measurement_unless_there_is_nothing_else(tmp_path: Path) -> None:
    """A recorder that has lost its robot writes such rows; no arm does."""
    rows = np.linspace(1.0, 2.0, 150).reshape(50, 3)
    rows[10:15] = 0.0
    rows[20, 1:] = 0.0  # stands, and holds nothing
    path = tmp_path / "log.csv"
    for told in (rows, np.zeros((50, 3))):
        lines = [f"{0.01 * k:.2f},{q},{v},{i}" for k, (q, v, i) in enumerate(told)]
        path.write_bytes(joined([f"timestamp,{STATES}", *lines]))
        log = read(path)
        lost = np.isnan(log.channels["actual_q"][:, 0])
        assert np.array_equal(lost, ~told.any(axis=1) & told.any())
        assert len(log) == 50
    path.write_bytes(joined(["timestamp," + STATES, *(f"{k},{k},0,0" for k in range(1, 9))]))
    assert not read(path).defects


@pytest.mark.parametrize("times", [2, 3])
def test_a_sample_under_several_stamps_is_one_row(tmp_path: Path, times: int) -> None:
    """A recorder that polls too often; of an arm that stands, nobody knows."""
    t = np.arange(40)
    once = np.stack(
        [np.cumsum(np.where(t < 30, 0.01, 0.0)), np.where(t < 30, 1.0, 0.0), 2.0 + t], 1
    )
    once[30:, 2] = 2.0
    stamps, rows = 0.01 * np.arange(40 * times) / times, np.repeat(once, times, axis=0)
    lines = [f"{s:.4f},{q},{v},{i}" for s, (q, v, i) in zip(stamps, rows, strict=True)]
    path = tmp_path / "log.csv"
    path.write_bytes(joined([f"timestamp,{STATES}", *lines]))
    log = read(path)
    np.testing.assert_array_equal(log.channels["actual_q"][:30, 0], once[:30, 0])
    assert len(log) == 30 + 10 * times
    told = {defect.kind: defect for defect in log.defects}["row of the sample before"]
    assert (told.count, told.line, told.remedy) == (30 * (times - 1), 3, "kept once")


REFUSED: dict[str, tuple[Break, str]] = {
    "empty": (lambda t: b"", "log.csv: is empty"),
    "only blank lines": (lambda t: b"\n\r\n\n", "log.csv: is empty"),
    "only a header": (lambda t: joined(t[:1]), "log.csv:1: has a header and no data"),
    "one row": (lambda t: joined(t[:2]), "one row is left, a log needs two"),
    "one stamp": (lambda t: joined([t[0], *[t[1]] * 9]), "one row is left"),
    "no header": (
        lambda t: joined(t[1:]),
        r"log.csv:1: has no header; name its 5 columns, .*--columns timestamp,-\*4",
    ),
    "no stamps": (
        lambda t: joined([line.partition(",")[2] for line in t]),
        "no column of time stamps; say the --rate",
    ),
    "header too long": (
        lambda t: joined([t[0] + ",x", *t[1:]]),
        "log.csv:1: the header names 6 columns, the rows have 5",
    ),
    "header too short": (
        lambda t: joined([t[0][:-17], *t[1:]]),
        "log.csv:1: the header names 4 columns, the rows have 5",
    ),
    "one name twice": (
        lambda t: joined([t[0].replace("q_1", "q_0"), *t[1:]]),
        "log.csv:1: two columns are called actual_q_0",
    ),
    "rows in no order": (
        lambda t: joined([t[0], *t[:0:-1]]),
        "the clock goes back .*; its rows are in no order: sort them",
    ),
    "many recordings": (
        lambda t: joined([t[0], *t[1:41] * 25]),
        "log.csv:42: the clock goes back .*; its rows are in no order: sort them",
    ),
    "time runs backwards": (
        lambda t: joined([t[0], *t[:0:-1]]),
        "log.csv:3: the clock goes back",
    ),
    **{
        f"{unit} since {since:g} s": (
            counted(since, by),
            f"log.csv:2: its stamps are {unit}; stamps are to be in s: divide them by {by:,}$",
        )
        for unit, by, since in (
            ("milliseconds", 10**3, 1.6e9),
            ("microseconds", 10**6, 1.6e9),
            ("microseconds", 10**6, 2e5),
            ("nanoseconds", 10**9, 1.6e9),
            ("nanoseconds", 10**9, 283.0),
            ("nanoseconds", 10**9, 1.6e3),  # as many as milliseconds since 1970
        )
    },
    **{
        f"dates in digits, {what}": (
            stamped(date),
            "log.csv:2: its stamps are dates that begin with YYYYMMDDhhmmss; "
            "write them in s, or without them say the --rate in Hz$",
        )
        for what, date in (
            ("of whole seconds", lambda n: f"202007141639{n:02}"),
            ("with milliseconds", lambda n: f"20200714163959{20 * n:03}"),
            ("but for one", lambda n: f"202007141639{n:02}" if n else "0"),
        )
    },
    "stamps of no clock": (
        lambda t: joined([t[0], *("9" * 30 + row for row in t[1:])]),
        "log.csv:2: 50 of 50 rows cannot be used: 50 x impossible stamp",
    ),
    "a third is short": (
        lambda t: joined([r if n % 3 else r[:9] for n, r in enumerate(t, 2)]),
        "log.csv:2: 17 of 50 rows cannot be used: 17 x short row",
    ),
    "a third is silent": (
        lambda t: joined([r if n % 3 else r[:5] + ",,,," for n, r in enumerate(t, 2)]),
        "log.csv:2: 17 of 50 rows cannot be used: 17 x row without values",
    ),
    "nothing but words": (
        lambda t: joined(["timestamp,mode", *(f"{n},on" for n in range(9))]),
        "log.csv:1: has no channel; it has timestamp",
    ),
    "lines that end in CR": (lambda t: joined(t, "\r"), "log.csv: ends its lines in CR alone"),
    "UTF-16": (lambda t: joined(t).decode().encode("utf-16"), "log.csv: is UTF-16; save it"),
    "not text": (lambda t: bytes(range(256)) * 9, "log.csv: is not text"),
    "half an archive": (lambda t: gzip.compress(joined(t))[:-20], "log.csv: cannot be read"),
    "half a Parquet": (lambda t: b"PAR1" + joined(t), "log.csv: cannot be read: damaged file"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_no_log_is_refused_in_one_line(what: str, text: list[str], tmp_path: Path) -> None:
    broken, message = REFUSED[what]
    path = tmp_path / "log.csv"
    path.write_bytes(broken(text))
    with pytest.raises(LogError) as caught:
        read(path)
    assert re.search(message, str(caught.value)), str(caught.value)
    assert caught.value.path == str(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "told"), [("nowhere.csv", "cannot be read"), (".", "is a folder without")]
)
def test_what_cannot_be_opened_is_refused(name: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=told):
        read(tmp_path / name)
    with pytest.raises(LogError, match=told):
        read(tmp_path / name, columns="timestamp,actual_q*6")


@pytest.mark.parametrize("tail", [b"", bytes(4096)], ids=["cut", "zeros"])
@pytest.mark.parametrize("form", ["gzip", "zstd", "zstd in frames"])
def test_a_torn_archive_is_read_up_to_its_tear(form: str, tail: bytes, tmp_path: Path) -> None:
    """A piece of 16 kB more is lost, at most; no number is read of which digits are missing."""
    rng = np.random.default_rng(3)
    rows = [
        f"{n / 100.0:.2f},{a!r},{b!r}" for n, (a, b) in enumerate(rng.random((8000, 2)).tolist())
    ]
    plain = joined(["timestamp,actual_q_0,actual_q_1", *rows])
    zstd = partial(pa.compress, codec="zstd", asbytes=True)
    frames = [zstd(plain[at : at + 20_000]) for at in range(0, len(plain), 20_000)]
    packed = {"gzip": gzip.compress(plain), "zstd": zstd(plain), "zstd in frames": b"".join(frames)}
    path, whole = tmp_path / "log.csv", packed[form]
    path.write_bytes(whole)
    sound = read(path)
    path.write_bytes(whole[: len(whole) * 4 // 5] + tail)
    log = read(path)
    assert 0.7 * len(sound.t) < len(log.t) < len(sound.t)
    np.testing.assert_array_equal(log.t, sound.t[: len(log.t)])
    np.testing.assert_array_equal(log.joint("actual_q"), sound.joint("actual_q")[: len(log.t)])
    [torn] = log.defects
    assert (torn.kind, torn.line) == ("torn archive", len(log.t) + 2)


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_no_corruption_raises_anything_but_log_error(
    data: st.DataObject, text: list[str], tmp_path: Path
) -> None:
    content = bytearray(joined(text, data.draw(st.sampled_from(["\n", "\r\n"]))))
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(content) - 1))
        junk = data.draw(st.binary(max_size=9) | st.sampled_from([b",", b"\n", b'"', b"-", b"e"]))
        content[at : at + data.draw(st.integers(0, 9))] = junk
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    try:
        log = read(path)
    except LogError as error:
        assert error.path == str(path)
    else:
        assert (np.diff(log.t) > 0).all()


def test_damage_in_a_large_file_is_found_by_its_line(tmp_path: Path, text: list[str]) -> None:
    """Large enough to be halved many times, with damage in both halves."""
    lines = [text[0], *(f"{n / 500},{n % 9},0,0,0" for n in range(40_000))]
    lines[7_000], lines[30_001], lines[39_000] = "13.998", "", "77.998,x,0,0,0"
    path = tmp_path / "log.csv"
    path.write_bytes(joined(lines))
    log = read(path)
    assert len(log) == 39_998
    assert {(d.kind, d.line) for d in log.defects} == {
        ("short row", 7_001),
        ("blank line", 30_002),
        ("text in place of a number", 39_001),
    }
    np.testing.assert_array_equal(log.channels["actual_q"][6_999], [7_000 % 9, 0])


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_the_size_of_blocks_changes_nothing(
    data: st.DataObject, text: list[str], tmp_path: Path
) -> None:
    """Whole, and in blocks so small that every one is parsed alone, line by line or not."""
    text = [*text[:30], "", text[0], *text[30:], "10.5,1"]
    for _ in range(data.draw(st.integers(0, 4))):
        at = data.draw(st.integers(2, len(text) - 1))
        text[at] = data.draw(st.sampled_from(["", "x", "1,2", "\0", '"', text[at] + ",,", text[2]]))
    path = tmp_path / "log.csv"
    path.write_bytes(joined(text)[:-1])
    with pytest.MonkeyPatch.context() as patch:
        whole = outcome(path)
        patch.setattr("urdyn.io.parse.SMALL", data.draw(st.sampled_from([1, 100])))
        assert outcome(path) == whole


def outcome(path: Path) -> object:
    try:
        log = read(path)
    except LogError as error:
        return str(error)
    return log.t.tobytes(), log.channels["actual_q"].tobytes(), sorted(map(str, log.defects))
