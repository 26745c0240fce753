"""urdyn excite, ended before its time: soon, in one line, and with all that it had begun."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(
    (os.cpu_count() or 1) < 2 or not Path("/proc/self/task").exists(),
    reason="workers are begun where there are processors for them, and found in /proc",
)
SEARCH = "excite --robot ur10e --duration 20 --processes 2 --out"
# As in a terminal, though a script may have begun the tests in the background, deaf to Ctrl-C.
CODE = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from urdyn.cli.app import app
app(sys.argv[1:])
"""


@pytest.fixture
def search(tmp_path):
    """A search with both of its workers at it, and the numbers of all processes that it began."""
    command = (sys.executable, "-c", CODE, *SEARCH.split(), str(tmp_path / "out"))
    with subprocess.Popen(command, stderr=-1, text=True, start_new_session=True) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        until(lambda: len(children.read_text().split()) == 3)  # one looks after semaphores
        time.sleep(1.0)
        yield process, children.read_text().split()
        process.kill()


def until(so, patience=60.0):
    deadline = time.monotonic() + patience
    while not so() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert so()


def is_over(child):
    """Gone, or dead and nobody's."""
    stat = Path(f"/proc/{child}/stat")
    return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z"


def test_ctrl_c_ends_a_search_with_its_workers(search):
    process, children = search
    os.killpg(process.pid, signal.SIGINT)  # a terminal tells the whole group
    assert process.communicate(timeout=15)[1] == "urdyn: interrupted\n"
    assert process.returncode == 130
    until(lambda: all(map(is_over, children)))


def test_a_worker_that_is_killed_ends_a_search_in_one_line(search):
    process, children = search
    os.kill(int(children[-1]), signal.SIGKILL)
    told = process.communicate(timeout=15)[1]
    assert told.startswith("urdyn: a worker was killed") and told.count("\n") == 1
    until(lambda: all(map(is_over, children)))


def test_workers_end_with_a_search_that_is_killed(search):
    process, children = search
    process.kill()
    until(lambda: all(map(is_over, children)), 15.0)
