"""Whoever waits beside long work hears what it is at, on a terminal or not."""

from __future__ import annotations

import sys
import threading
import time
from types import SimpleNamespace

import pytest

from urdyn.cli import now_and_then
from urdyn.cli.voice import Voice
from urdyn.cli.watching import watching

EVERY = 0.02  # [s]


def at_work(voice: Voice) -> None:
    with voice.progress("first") as progress:
        time.sleep(10 * EVERY)
        progress("second", 0.5)
        time.sleep(10 * EVERY)


def test_elsewhere_than_on_a_terminal_lines_say_what_is_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(now_and_then, "FIRST", EVERY)
    at_work(Voice())
    said = capsys.readouterr()
    assert not said.out
    assert all(f"0 s: {what}\n" in said.err for what in ("first", "second"))
    assert said.err.rindex("first") < said.err.index("second")
    time.sleep(10 * EVERY)
    assert not capsys.readouterr().err  # it is over, and nobody speaks


@pytest.mark.parametrize(("terminal", "told"), [("dumb", True), ("xterm", False)])
def test_so_they_do_on_a_terminal_that_cannot_redraw(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], terminal: str, told: bool
) -> None:
    monkeypatch.setattr(now_and_then, "FIRST", EVERY)
    monkeypatch.setenv("TERM", terminal)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    at_work(Voice())
    assert ("0 s: second\n" in capfd.readouterr().err) == told


def test_a_run_that_is_tracked_says_how_far_it_has_come(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(now_and_then, "FIRST", EVERY)
    glance = SimpleNamespace(t=12.34, share=0.47, rate=221.0, behind="", ended=False)
    with watching([], Voice()) as told:
        told(glance)
        time.sleep(10 * EVERY)
        told(SimpleNamespace(**vars(glance) | {"ended": True}))
        time.sleep(10 * EVERY)
    said = capsys.readouterr().err
    assert "0 s: tracked 12.3 s, 47 %; quick enough for 221 Hz\n" in said
    assert "0 s: tracked 12.3 s, ending; quick enough for 221 Hz\n" in said


def test_who_wants_no_word_gets_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(now_and_then, "FIRST", EVERY)
    before = threading.active_count()
    with Voice(quiet=True).progress("first"):
        assert threading.active_count() == before  # nobody waits to say nothing
    at_work(Voice(quiet=True))
    assert capsys.readouterr() == ("", "")
