"""A run that is killed goes on, and the history is that of a run that never was."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from workshop import KilledError, assert_same, killed_at

from urdyn.dbn import figure2
from urdyn.errors import InputError
from urdyn.estimate import UKF, InformationFilter
from urdyn.io import alone, write
from urdyn.signal import samples
from urdyn.tracking import Arrival, open_source
from urdyn.tracking.output.checkpoint import FILE

ROOT = Path(__file__).parents[2]
OFTEN = 100  # samples between checkpoints here, and 1000 of a recording elsewhere
# Before a checkpoint, at it, after it.
SAMPLES = (OFTEN, *(pytest.param(k, marks=pytest.mark.slow) for k in (3, 99, 101, 130)))


@pytest.fixture(scope="module", autouse=True)
def _often():
    with pytest.MonkeyPatch.context() as here:
        run = import_module("urdyn.tracking.run")
        here.setattr(run, "AGAIN", OFTEN)
        here.setattr(run, "PART", 0.01 * OFTEN)
        yield


@pytest.fixture(scope="module")
def workshop(workshop, tmp_path_factory):
    """Its recording's first three seconds: two checkpoints amid them."""
    path, log = tmp_path_factory.mktemp("short") / "log.parquet", workshop.log.slice(0, 300)
    write(log, path)
    return replace(workshop, log=log, recording=path)


@pytest.fixture(scope="module")
def undisturbed(workshop, tmp_path_factory):
    out = tmp_path_factory.mktemp("undisturbed")
    return out, workshop.track(out)


@pytest.fixture(scope="module")
def died(workshop, tmp_path_factory):
    out = tmp_path_factory.mktemp("died")
    with pytest.raises(KilledError):
        workshop.track(out, killed_at(workshop.source, OFTEN + 40))
    return out


@pytest.fixture
def dead(died, tmp_path):
    """A folder of a run that died after its first checkpoint."""
    return shutil.copytree(died, tmp_path, dirs_exist_ok=True)


@pytest.mark.parametrize(
    "filter_", [UKF(), pytest.param(InformationFilter(), marks=pytest.mark.slow)]
)
def test_a_resumed_run_is_the_undisturbed_one(workshop, filter_, tmp_path):
    source = open_source(str(workshop.recording), duration=1.5)
    whole = workshop.track(tmp_path / "whole", source, filter=filter_)
    for sample in (OFTEN + 5, OFTEN + 8):
        with pytest.raises(KilledError):
            workshop.track(tmp_path / "parts", killed_at(source, sample), filter=filter_)
    again = workshop.track(tmp_path / "parts", source, filter=filter_)
    assert_same(tmp_path / "parts", tmp_path / "whole")
    for name in ("samples", "data_s", "final", "payload_changes"):
        assert again[name] == whole[name]


@pytest.mark.parametrize("sample", SAMPLES)
def test_it_matters_not_when_a_run_dies(workshop, undisturbed, sample, tmp_path):
    source = workshop.source
    with pytest.raises(KilledError):
        workshop.track(tmp_path, killed_at(source, sample))
    assert workshop.track(tmp_path, source)["final"] == undisturbed[1]["final"]
    assert_same(tmp_path, undisturbed[0])


def test_a_resumed_run_does_not_begin_at_the_beginning(workshop, dead):
    source = workshop.source
    begun = []

    def start(first):
        begun.append(first)
        return source.start(first)

    workshop.track(dead, replace(source, start=start))
    assert begun == [OFTEN]


def test_what_a_killed_run_left_beyond_its_checkpoint_is_dropped(workshop, undisturbed, dead):
    parts = dead / "history.parts"
    (parts / "part-000001.parquet").write_bytes(b"half")
    (parts / ".part-000001.parquet.1.part").write_bytes(b"less")
    workshop.track(dead)
    assert_same(dead, undisturbed[0])


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 and no more"])
def test_a_broken_checkpoint_is_refused(workshop, dead, content):
    (dead / FILE).write_bytes(content)
    with pytest.raises(InputError, match="--fresh"):
        workshop.track(dead)


def test_a_torn_checkpoint_is_refused(workshop, dead):
    whole = (dead / FILE).read_bytes()
    for share in (0.1, 0.5, 0.99):
        (dead / FILE).write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match="--fresh"):
            workshop.track(dead)


def test_a_checkpoint_that_lacks_a_part_is_refused(workshop, dead):
    (dead / "history.parts" / "part-000000.parquet").unlink()
    with pytest.raises(InputError, match="part-000000"):
        workshop.track(dead)


def test_a_part_that_is_damaged_is_told_by_its_name(workshop, dead):
    """One that is cut short at once; one whose bits flipped when it is read, and not before."""
    part = dead / "history.parts" / "part-000000.parquet"
    whole = part.read_bytes()
    flipped = bytes(b ^ 0x40 if 4 <= k < len(whole) - 4 else b for k, b in enumerate(whole))
    for damaged in (whole[: len(whole) // 2], flipped):
        part.write_bytes(damaged)
        with pytest.raises(InputError, match=r"part-000000.parquet: is damaged; .* --fresh"):
            workshop.track(dead)


def test_a_checkpoint_with_nothing_in_it_is_refused(workshop, dead):
    with np.load(dead / FILE) as archive:
        about = json.loads(str(archive["about"]))
    np.savez(dead / FILE, about=json.dumps(about | {"layout": {}}), numbers=np.zeros(0))
    with pytest.raises(InputError, match="lacks"):
        workshop.track(dead)


def test_a_checkpoint_of_another_run_is_refused(workshop, dead):
    with pytest.raises(InputError, match="another twin;"):
        workshop.track(dead, twin_sha256="other")
    with pytest.raises(InputError, match="another source;"):
        workshop.track(dead, open_source(str(workshop.recording), rows=(5, None)))
    with pytest.raises(InputError, match="another filter;"):
        workshop.track(dead, filter=UKF())
    with pytest.raises(InputError, match="another network;"):
        workshop.track(dead, network=figure2().without("f", "alpha"))
    with pytest.raises(InputError, match="another period;"):
        workshop.track(dead, replace(workshop.source, period=0.02))


def test_a_live_run_that_is_resumed_knows_what_it_lost_and_what_is_to_come(workshop, tmp_path):
    """One of eight samples in the first half is lost; between the two parts nobody listened."""
    told = [sample for k, sample in enumerate(samples(workshop.log)) if k % 8 != 4 or k > OFTEN]
    dies, shares = OFTEN + 20, []

    def heard(begin, end):
        def start(_):
            return (Arrival(sample, sample.t) for sample in told[begin:end])

        return replace(workshop.source, live=True, length=end - begin, start=start)

    with pytest.raises(KilledError):
        workshop.track(tmp_path, killed_at(heard(0, 200), dies))
    again = workshop.track(
        tmp_path, heard(dies, len(told)), watch=lambda at: shares.append(at.share)
    )
    assert again["lost"] == len(range(4, OFTEN + 1, 8))
    assert 0.0 < shares[0] < 0.2 and shares[-1] == 1.0


def test_a_live_run_goes_on_with_the_period_that_it_began_with(workshop, tmp_path):
    """On a ROS 2 graph the first few stamps tell it, at every start another."""
    told = list(samples(workshop.log))

    def heard(begin, end, period):
        def start(_):
            return (Arrival(sample, sample.t) for sample in told[begin:end])

        return replace(workshop.source, live=True, length=0, period=period, start=start)

    whole, parted = tmp_path / "whole", tmp_path / "parted"
    workshop.track(whole, heard(0, 200, 0.01))
    workshop.track(parted, heard(0, 100, 0.01))
    with pytest.raises(InputError, match="another period;"):
        workshop.track(parted, heard(100, 200, 0.011))
    workshop.track(parted, heard(100, 200, 0.010003))
    assert_same(whole, parted)


class Slow:
    """An observer that takes 45 samples to keep anything, unless it is waited for."""

    findings, doubt = (), ""

    def __init__(self):
        self.samples, self.asked, self.waited = 0, [], []
        self.begin = self.note = self.close = self.forget = lambda *of: None
        self.finish = dict

    def take(self, *reading):
        self.samples += 1

    miss = take

    def keep(self, index):
        self.asked.append(index)

    def kept(self, wait):
        if wait:
            self.waited.append(self.samples)
        return wait or self.samples > 45


def test_a_robot_does_not_wait_for_the_observer_but_its_next_checkpoint_does(
    workshop, tmp_path, monkeypatch
):
    monkeypatch.setattr(import_module("urdyn.tracking.run"), "PART", 0.2)  # [s] 20 samples
    arrivals, slow = (Arrival(s, s.t) for s in samples(workshop.log.slice(0, 60))), Slow()
    workshop.track(
        tmp_path, replace(workshop.source, live=True, start=lambda _: arrivals), observer=slow
    )
    first, second, *_ = slow.asked
    assert set(slow.waited) <= {60} and first == 20 and second > 45


def test_a_checkpoint_that_does_not_say_whose_it_is_is_refused(workshop, dead):
    with np.load(dead / FILE) as archive:
        about, numbers = json.loads(str(archive["about"])), archive["numbers"]
    del about["identity"]["period"]
    np.savez(dead / FILE, about=json.dumps(about), numbers=numbers)
    with pytest.raises(InputError, match=r"does not say its period; .* --fresh"):
        workshop.track(dead)


def test_a_folder_that_another_run_writes_to_is_left_to_it(workshop, dead):
    before = {path: path.read_bytes() for path in dead.rglob("*") if path.is_file()}
    with alone(dead), pytest.raises(InputError, match="another urdyn is writing there"):
        workshop.track(dead, fresh=True)
    assert {path: path.read_bytes() for path in dead.rglob("*") if path.is_file()} == before


def test_a_run_can_begin_anew(workshop, undisturbed, dead):
    workshop.track(dead, twin_sha256="", fresh=True)
    assert_same(dead, undisturbed[0])


# Checkpoints come often, and nobody looks at the page.
HERE = f"""
from importlib import import_module
run = import_module("urdyn.tracking.run")
run.AGAIN, run.PART = {OFTEN}, {0.01 * OFTEN}
import_module("urdyn.report.track.apart").draw = lambda *of: 1.0
import_module("urdyn.cli").main()
"""


def killed_after(workshop, out, seconds, *options):
    """Exit status of the command line, killed if it takes longer."""
    command = (sys.executable, "-c", HERE, "track", workshop.twin, workshop.recording)
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.Popen(
        (*command, "--out", out, "-q", "--filter", "ekf", *options), env=environment
    )
    try:
        return run.wait(seconds)
    except subprocess.TimeoutExpired:
        run.send_signal(signal.SIGKILL)
        return run.wait()


ENOUGH = 140.0  # [s] for a whole run, on a busy machine
QUICK = (1, ("--no-diagnosis",))
MANY = pytest.param(50, (), marks=[pytest.mark.slow, pytest.mark.timeout(1200)])


@pytest.mark.parametrize(("kills", "options"), [QUICK, MANY])
def test_a_run_that_is_killed_at_any_moment_loses_nothing(workshop, kills, options, tmp_path):
    begin = time.monotonic()
    assert killed_after(workshop, tmp_path / "timed", ENOUGH, *options) == 0
    took = time.monotonic() - begin
    for seconds in np.random.default_rng(kills).uniform(0.5 * took, took, kills):
        killed_after(workshop, tmp_path / "killed", seconds, *options)
    assert killed_after(workshop, tmp_path / "killed", ENOUGH, *options) == 0
    assert_same(tmp_path / "killed", tmp_path / "timed")
