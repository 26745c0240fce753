"""Whoever waits beside long work hears what it is at, on a terminal or not."""

from __future__ import annotations

import threading
import time

import pytest

from urdyn.cli import now_and_then
from urdyn.cli.voice import Voice

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


def test_who_wants_no_word_gets_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(now_and_then, "FIRST", EVERY)
    before = threading.active_count()
    with Voice(quiet=True).progress("first"):
        assert threading.active_count() == before  # nobody waits to say nothing
    at_work(Voice(quiet=True))
    assert capsys.readouterr() == ("", "")
