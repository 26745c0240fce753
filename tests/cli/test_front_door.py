"""How the package and its command line present themselves."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from story import ROOT, urdyn
from typer.testing import CliRunner

import urdyn as ud
from urdyn.cli import failure
from urdyn.cli.app import app

VERBS = (
    *("identify", "validate", "calibrate", "excite", "simulate", "record", "track", "acknowledge"),
    *("fleet", "view", "convert", "demo", "bench identify", "bench faults"),
)
HEAVY = ("numpy", "casadi", "plotly", "matplotlib", "pinocchio", "scipy", "pyarrow")


def test_import_is_light() -> None:
    look = f"import sys, urdyn; print([m for m in {HEAVY} if m in sys.modules])"
    told = subprocess.run(
        (sys.executable, "-c", look), cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert told.stdout == "[]\n"


def test_every_public_name_is_there() -> None:
    for name in ud.__all__:
        assert getattr(ud, name) is not None
    assert set(ud.__all__) <= set(dir(ud))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        ud.nothing  # noqa: B018


@pytest.mark.parametrize("first", ["import urdyn.identify.fit", "from urdyn import Twin", "pass"])
def test_a_verb_is_called_whatever_was_imported_before(first: str) -> None:
    look = (
        f"{first}\nimport urdyn as ud\nassert callable(ud.identify) and ud.identify.Fit is ud.Fit"
    )
    subprocess.run((sys.executable, "-c", look), cwd=ROOT, check=True)


def test_a_room_is_called_like_its_function() -> None:
    from urdyn.simulate import simulate

    assert inspect.signature(ud.simulate) == inspect.signature(simulate)


def test_version() -> None:
    done = urdyn("--version")
    assert (done.returncode, done.stdout) == (0, f"urdyn {ud.__version__}\n")


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help_with_an_example(verb: str) -> None:
    done = CliRunner().invoke(app, [*verb.split(), "--help"])
    assert done.exit_code == 0
    assert f"Example: urdyn {verb}" in done.stdout


@pytest.mark.parametrize(
    ("error", "status", "told"),
    [
        (KeyboardInterrupt(), 130, "urdyn: interrupted\n"),
        (MemoryError(), 1, "urdyn: not enough memory; ask for less, of a log with --rows\n"),
        (PermissionError(13, "Permission denied", "/x"), 1, "urdyn: /x: Permission denied\n"),
        (ud.UrdynError("two\nlines"), 1, "urdyn: two lines\n"),
        (ud.UrdynError("a\x1b]0;b\x07.csv"), 1, "urdyn: a\ufffd]0;b\ufffd.csv\n"),
    ],
)
def test_a_failure_is_one_line(
    error: BaseException, status: int, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path) -> None:
        raise error

    monkeypatch.setattr(ud.Twin, "load", fail)
    done = CliRunner().invoke(app, ["validate", __file__, "log.csv"])
    assert (done.exit_code, done.stdout, done.stderr) == (status, "", told)


def test_an_error_of_ours_asks_to_be_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(path: Path) -> None:
        raise ZeroDivisionError("ours")

    monkeypatch.setattr(ud.Twin, "load", fail)
    done = CliRunner().invoke(app, ["validate", __file__, "log.csv"])
    assert done.exit_code == 1 and done.stderr.count("\n") == 1
    assert "unexpected ZeroDivisionError: ours" in done.stderr and "report it" in done.stderr
    monkeypatch.setenv(failure.DEBUG, "1")
    assert "Traceback" in CliRunner().invoke(app, ["validate", __file__, "log.csv"]).stderr
