"""A process that helps: what it says, what it fails at, and its end."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from urdyn.errors import InputError, UrdynError
from urdyn.io.frames import numbers_frame, words_frame
from urdyn.io.helper import Helper

ECHO = """
import os
from urdyn.errors import InputError
from urdyn.io.frames import words_of
from urdyn.io.helping import helping

def answers(heard):
    first = words_of(next(heard))
    for frame in heard:
        if isinstance(frame, dict):
            match frame["do"]:
                case "refuse": raise InputError("no such thing")
                case "break": raise ValueError("broken")
                case "die": os._exit(7)
        else:
            yield {"sum": float(frame.sum()), "first": first, "nice": os.nice(0)}

helping(answers)
"""

WORKER = """
import os
import signal
import time
from urdyn.io.helping import helping

given, armed = 0, []

def give() -> None:
    global given
    given += 1
    time.sleep(1e-3)  # somebody had waited for the processor

def waiting(call):
    def called(*of):
        armed.append(signal.getitimer(signal.ITIMER_REAL)[0])
        return call(*of)
    return called

os.sched_yield, os.read, os.write = give, waiting(os.read), waiting(os.write)

def answers(heard):
    for frame in heard:
        begun, before = time.perf_counter(), given
        while given < before + 10 and time.perf_counter() < begun + 30.0:
            pass
        yield {"ways": given - before, "took": time.perf_counter() - begun, "armed": armed}

helping(answers)
"""


@pytest.fixture
def echo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "echo_of_tests.py").write_text(ECHO)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with closing(Helper("echo_of_tests", "the echo", "shout again")) as helper:
        yield helper


def test_it_hears_in_order_and_stands_back(echo: Helper) -> None:
    echo.send(words_frame({"a": 1}), numbers_frame(np.arange(4.0)))
    said: list = []
    while not said:
        said = echo.listen()
    assert said == [{"sum": 6.0, "first": {"a": 1}, "nice": min(19, os.nice(0) + 5)}]


def test_one_can_wait_until_it_is_there(tmp_path, monkeypatch, echo: Helper) -> None:
    echo.await_ready()
    assert echo.ask(words_frame({}), numbers_frame(np.ones(1)))
    echo.await_ready()
    (tmp_path / "absent_of_tests.py").write_text("import nothing_of_that_name")
    gone = pytest.raises(UrdynError, match="the absent ended with status 1; look for it")
    with closing(Helper("absent_of_tests", "the absent", "look for it")) as absent, gone:
        absent.await_ready()


def test_while_it_works_it_gives_way_and_while_it_waits_it_sleeps(tmp_path, monkeypatch) -> None:
    """However busy the machine is: again and again, and one after the other."""
    (tmp_path / "worker_of_tests.py").write_text(WORKER)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with closing(Helper("worker_of_tests", "the worker", "rest")) as worker:
        for _ in range(2):
            told = worker.ask(numbers_frame(np.zeros(1)))
            assert told["ways"] >= 10 and told["took"] >= 1e-3 * told["ways"]
    assert len(told["armed"]) >= 4 and not any(told["armed"])  # as it reads and writes


def test_more_than_a_pipe_holds_waits_until_it_is_taken(echo: Helper) -> None:
    echo.send(words_frame({}), *(numbers_frame(np.full(1 << 17, k)) for k in range(8)))
    assert echo.waiting > 0
    said: list = []
    while len(said) < 8:
        said += echo.listen()
    assert [words["sum"] for words in said] == [float(k << 17) for k in range(8)]
    assert not echo.waiting


@pytest.mark.parametrize(
    "do, error, told",
    [
        ("refuse", InputError, "no such thing"),
        ("break", RuntimeError, "ValueError: broken"),
        ("die", UrdynError, "the echo ended with status 7; shout again"),
    ],
)
def test_what_it_fails_at_is_raised_where_one_listens(echo: Helper, do, error, told) -> None:
    echo.send(words_frame({}), words_frame({"do": do}))
    with pytest.raises(error, match=told):
        while True:
            echo.listen()
    assert isinstance(echo.failed, error)
    echo.send(words_frame({}))  # nobody hears it, and nobody minds
    assert echo.exchange() == []


def test_one_that_is_not_needed_ends_in_silence(tmp_path: Path) -> None:
    (tmp_path / "echo_of_tests.py").write_text(ECHO)
    left = subprocess.Popen(
        [sys.executable, "-m", "echo_of_tests"],
        cwd=tmp_path,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    left.stdout.close()
    left.stdin.close()
    assert (left.wait(60.0), left.stderr.read()) == (0, b"")
    left.stderr.close()
