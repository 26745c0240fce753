"""A diagnosis in a process of its own says what it would say in ours, and ends with us."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from found import FOUND
from shop import Shop
from test_diagnosis_resumed import looking_on, readings

from urdyn.cli.diagnosing import summed
from urdyn.diagnose import onlooker
from urdyn.diagnose.findings.document import ORIGIN
from urdyn.diagnose.job import Job, job_of
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.onlooker import Onlooker
from urdyn.diagnose.reading_row import row
from urdyn.diagnose.session import Session
from urdyn.errors import InputError, UrdynError
from urdyn.io.frames import Frames, words_frame
from urdyn.io.run_folder import FINDINGS
from urdyn.twin import Twin

STUCK = "sensor_fault:joint=3,mode=stuck,onset=1"
TIMEOUT = 60.0  # [s]


def child_of(looking) -> int:
    return looking._helper._process.pid


def gone(pid: int) -> bool:
    """Whether a process has ended; one that nobody has waited for is a zombie."""
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def until(true) -> None:
    deadline = time.monotonic() + TIMEOUT
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture
def begun(shop: Shop, tmp_path: Path):
    looking = looking_on(shop, shop.log(seconds=2.0))
    looking.begin(tmp_path, 0, {"twin": "a"})
    yield looking
    looking.close()


def overheard(shop: Shop, **hears) -> Onlooker:
    """Whoever looks on, before it begins; by their names those whom it tells."""
    return Onlooker(shop.fit, 0.01, read_rules(), {}, **hears)


def test_what_is_taken_back_is_told_once(shop: Shop) -> None:
    heard: list[str] = []
    looking = overheard(
        shop,
        tell=lambda finding: heard.append(f"{finding['id']} told"),
        retract=lambda finding: heard.append(f"{finding['id']} taken back"),
    )
    one, other = {"id": "one"}, {"id": "other"}
    looking._hear([{"findings": [one], "told": [one]}])
    looking._hear([{"findings": [other], "told": [other]}, {"findings": [other]}])
    assert heard == ["one told", "other told", "one taken back"]
    assert looking.findings == (other,)


def test_a_doubt_is_told_as_it_arises_before_the_findings_that_it_is_of(shop: Shop) -> None:
    heard: list[str] = []
    looking = overheard(shop, tell=lambda finding: heard.append(finding["id"]), warn=heard.append)
    for doubt, finding in (("", "a"), ("no twin", "b"), ("no twin", "c")):
        found = {"id": finding}
        looking._hear([{"told": [found], "findings": [found], "doubt": doubt}])
    looking._hear([{"kept": 1}])
    assert heard == ["a", "no twin", "b", "c"] and looking.doubt == "no twin"


def test_a_task_is_the_same_once_it_was_words(shop: Shop) -> None:
    job = Job(shop.fit, 0.01, read_rules(), Path("/here"), 7, {"twin": "a"}, {"source": "b"})
    (told,) = Frames().take(words_frame(job.plain()))
    again = job_of(shop.fit, told)
    assert again.rules == job.rules
    assert json.dumps(told) == json.dumps(next(Frames().take(words_frame(again.plain()))))
    assert (again.folder, again.index, again.period) == (job.folder, 7, 0.01)


def test_another_process_says_what_this_one_would(shop: Shop, tmp_path: Path) -> None:
    log, told = shop.log(STUCK, seconds=3.0), []
    apart, here = looking_on(shop, log), tmp_path / "here"
    apart.tell = told.append
    here.mkdir()
    apart.begin(tmp_path, 0, {"twin": "a"})
    job = Job(apart.fit, apart.period, apart.rules, here, 0, {"twin": "a"}, {})
    session = Session(job_of(apart.fit, next(Frames().take(words_frame(job.plain())))))
    for reading in readings(shop, log):
        apart.take(reading)
        session.take(row(reading))
    summary = apart.finish()
    apart.close()
    session.finish()
    ours = session.write()
    written = json.loads((tmp_path / FINDINGS).read_text())
    assert written["findings"] == ours["findings"] == summary["findings"]
    assert [finding["id"] for finding in told] == ["sensor_fault.wrist_1_joint"]
    assert list(apart.findings) == ours["findings"]
    assert 20.0 < summary["diagnosis_rss_mb"] < 1000.0


def test_a_run_is_told_all_that_its_findings_say(shop: Shop, tmp_path: Path) -> None:
    """What speaks against them all, too, once: sensors of four joints do not fail at once."""
    log = shop.log(*(f"sensor_fault:joint={j},mode=stuck,onset=1" for j in range(4)), seconds=3.0)
    apart, warned = looking_on(shop, log), list[str]()
    apart.warn = warned.append
    apart.begin(tmp_path, 0, {"twin": "a"})
    for reading in readings(shop, log):
        apart.take(reading)
    apart.note(1, False)
    summary = dict(apart.finish())
    apart.close()
    assert warned == [summary["doubt"]] == [apart.doubt]
    written = json.loads((tmp_path / FINDINGS).read_text())
    assert summary.pop("diagnosis_rss_mb") > 0.0
    assert summary == {name: of for name, of in written.items() if name not in ORIGIN}
    run = summary | {"quality": {"compared": [9] * 6}}
    told = summed(run)
    assert told.startswith("current sensors of 4 of 6 joints do not fail at once")
    assert told.count("make sure that this is this arm's twin") == 1


def test_a_load_is_told_until_the_controller_is_set_to_it(shop: Shop, tmp_path: Path) -> None:
    session = Session(Job(shop.fit, 0.01, read_rules(), tmp_path, 0, {}, {}))
    load = replace(FOUND, kind="payload_change", joint=None, name="tool", severity="warning")
    told = [load, replace(load, severity="critical"), FOUND]
    for as_set in (False, True):
        session.note(0, as_set)
        assert session.untold(told) == [finding.plain() for finding in told[as_set:]]


def test_who_interrupts_a_run_does_not_interrupt_its_diagnosis(begun, tmp_path: Path) -> None:
    until((tmp_path / FINDINGS).exists)  # it is at work
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(child_of(begun), number)
    begun.note(2, False)
    begun.keep(5)
    assert begun.kept(wait=True)
    assert "this arm's twin" in (tmp_path / FINDINGS).read_text()  # it has heard of what is noted
    assert begun.finish()["findings"] == []
    assert os.getpgid(child_of(begun)) != os.getpgid(0)


def test_a_diagnosis_that_is_killed_is_told_of_where_the_run_is_kept(begun) -> None:
    os.kill(child_of(begun), signal.SIGKILL)
    begun.keep(5)
    for _ in range(2):
        with pytest.raises(UrdynError, match=r"SIGKILL.*--no-diagnosis"):
            begun.kept(wait=True)
        begun.keep(6)  # which nobody hears any more


def test_what_cannot_be_read_there_is_one_line_here(begun, tmp_path: Path) -> None:
    until((tmp_path / FINDINGS).exists)
    (tmp_path / "acknowledged.json").write_text("{")
    begun.keep(5)
    with pytest.raises(InputError, match="is no JSON"):
        begun.kept(wait=True)


class Stopped:
    """A diagnosis that takes nothing until it has caught up; one that is waited for never does."""

    def __init__(self):
        self.waiting, self.failed, self.stamps = 0, None, []

    def send(self, frame):
        (rows,) = Frames().take(frame)
        self.stamps.append(rows.ravel()[0])
        self.waiting += len(frame)

    def exchange(self, patience=0.0):
        assert patience == 0.0, "a sample waits"
        return []


def test_a_robot_does_not_wait_for_a_diagnosis_that_has_one_gap_instead(shop, monkeypatch) -> None:
    monkeypatch.setattr(onlooker, "WAITING", 10_000)  # [bytes]
    monkeypatch.setattr(onlooker, "BATCH", 0.01)  # [s] one by one
    warned: list[str] = []
    looking, none = overheard(shop, live=True, warn=warned.append), np.full(6, np.nan)
    looking._helper = there = Stopped()
    for k in range(400):
        there.waiting = {250: 1, 300: 0}.get(k, there.waiting)
        looking.miss(float(k), np.ones(6, dtype=bool), none)
    early = [t for t in there.stamps if t < 300]
    assert early == [*range(len(early))] and 10 < len(early) < 50
    assert there.stamps[len(early)] == 300.0 and warned[:1] == [onlooker.BEHIND]
    assert len(warned) == 2  # once each time


def test_a_memory_of_another_run_is_refused_at_once(shop: Shop, begun, tmp_path: Path) -> None:
    begun.keep(5)
    assert begun.kept(wait=True)
    again = looking_on(shop, shop.log(seconds=2.0))
    with pytest.raises(InputError, match="another run"):
        again.begin(tmp_path, 5, {"twin": "b"})
    again.close()


ORPHAN = """
import os, sys, time
from pathlib import Path
from urdyn.diagnose.onlooker import Onlooker
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.twin import Twin
looking = Onlooker(Twin.load(sys.argv[1]).fit, 0.01, read_rules(), {})
looking.begin(Path(sys.argv[2]), 0, {})
print(looking._helper._process.pid, flush=True)
time.sleep(60)
"""


def test_a_diagnosis_ends_with_its_run_even_one_that_is_killed(shop: Shop, tmp_path: Path) -> None:
    Twin(shop.dynamics.arm, shop.fit).save(tmp_path / "twin.toml")
    command = [sys.executable, "-c", ORPHAN, str(tmp_path / "twin.toml"), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as run:
        child = int(run.stdout.readline())
        until((tmp_path / FINDINGS).exists)
        assert not gone(child)
        run.kill()
    until(lambda: gone(child))
