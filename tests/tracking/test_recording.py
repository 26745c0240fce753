"""A recording is read elsewhere: what comes of it is the log, block after block."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from urdyn.errors import InputError, UrdynError
from urdyn.io import write
from urdyn.io.helper import Helper
from urdyn.signal import samples
from urdyn.tracking import open_source
from urdyn.tracking.sources import recording
from urdyn.tracking.sources.recording import BLOCK
from urdyn.types import Log

JOINTS = 3
ALONE = """
import sys
from urdyn.tracking import open_source
source = open_source(sys.argv[1])
assert sum(1 for _ in source.start(0)) == source.length
print(*(name for name in ("pyarrow", "urdyn.io.reader") if name in sys.modules))
"""


@pytest.fixture(scope="module")
def log() -> Log:
    """Of two blocks and a bit, with holes, temperatures in it and no speeds."""
    rng = np.random.default_rng(0)
    names = ("actual_q", "actual_current", "joint_temperatures")
    channels = {name: rng.standard_normal((2 * BLOCK + 100, JOINTS)) for name in names}
    channels["actual_current"][rng.random(channels["actual_current"].shape) < 0.1] = np.nan
    return Log(np.arange(2 * BLOCK + 100) / 100.0, channels)


@pytest.fixture(scope="module")
def path(log: Log, tmp_path_factory: pytest.TempPathFactory) -> str:
    written = tmp_path_factory.mktemp("recording") / "log.parquet"
    write(log, written)
    return str(written)


@pytest.mark.parametrize(
    "first",
    [
        7,
        BLOCK,
        2 * BLOCK + 100,
        *(pytest.param(k, marks=pytest.mark.slow) for k in (0, BLOCK - 1, 2 * BLOCK + 99)),
    ],
)
def test_blocks_are_the_log_from_any_sample_on(log: Log, path: str, first: int) -> None:
    source = open_source(path)
    came = [arrival.sample for arrival in source.start(first)]
    assert len(came) == source.length - first
    for one, other in zip(came, samples(log.slice(first)), strict=True):
        assert one.t == other.t
        for name in ("q", "v", "current", "temperature"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_two_who_replay_do_not_disturb_each_other(log: Log, path: str) -> None:
    source = open_source(path)
    pairs = zip(source.start(0), source.start(100), strict=False)
    apart = [other.sample.t - one.sample.t for one, other in islice(pairs, BLOCK + 10)]
    np.testing.assert_allclose(apart, 1.0)


@pytest.mark.parametrize("text", ["192.168.0.10", "10.0.0.2:30004", "cell-3.local:30004"])
def test_a_robot_s_address_alone_is_no_log(text: str) -> None:
    with pytest.raises(InputError, match=f"write rtde://{text}"):
        open_source(text)


def test_who_tracks_a_recording_holds_nothing_that_reads_files(path: str) -> None:
    done = subprocess.run([sys.executable, "-c", ALONE, path], capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == ("", "")


def test_stamps_damage_and_lacking_speeds_are_told_as_they_were_read(log: Log, path: str) -> None:
    t = np.array(log.t)
    t[50:] += 1.0
    path = path.replace("log", "gap")
    write(replace(log, t=t), path)
    source = open_source(path, duration=2.0)
    assert source.length == 100
    assert source.period == pytest.approx(0.01)
    assert not source.velocities


def test_a_reader_that_is_gone_ends_the_run_with_a_word(
    path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Helper] = []
    monkeypatch.setattr(recording, "Helper", lambda *of: begun.append(Helper(*of)) or begun[-1])
    source = open_source(path)
    arrivals = source.start(0)
    next(arrivals)
    begun[0]._process.kill()
    with pytest.raises(UrdynError, match="log's reader was ended by SIGKILL; run again"):
        list(arrivals)


def test_what_is_closed_is_not_waited_for(path: str) -> None:
    source = open_source(path)
    source.close()
    with pytest.raises(UrdynError, match="let go of"):
        next(source.start(0))
