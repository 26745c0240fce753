"""Who is asked to end a process, and until when."""

from __future__ import annotations

import os
import pty
import signal
from collections.abc import Iterator

import pytest

from urdyn.cli.ending import ended_by


@pytest.fixture(autouse=True)
def _at_a_terminal() -> Iterator[None]:
    """These tests may themselves be run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_afterwards_signals_mean_what_they_did_before(number: signal.Signals) -> None:
    """Once they stayed a track's: whoever was interrupted later in that process waited for ever."""
    before, heard = signal.getsignal(number), []
    with pytest.raises(ValueError, match="meanwhile"), ended_by(lambda: heard.append(number)):
        signal.raise_signal(number)
        raise ValueError("meanwhile")
    assert heard == [number]
    assert signal.getsignal(number) is before


def test_a_terminal_that_is_closed_does_not_end_what_nohup_began() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with ended_by(lambda: pytest.fail("ended")):
        signal.raise_signal(signal.SIGHUP)


def test_who_is_ended_by_a_closed_terminal_may_still_speak() -> None:
    """Once a run's first words after it failed, and its report was not written."""
    terminal, output = pty.openpty()
    before = os.dup(2)
    os.dup2(output, 2)
    try:
        with ended_by(lambda: None):
            os.close(terminal)
            signal.raise_signal(signal.SIGHUP)
            assert os.write(2, b"written") == 7
    finally:
        os.dup2(before, 2)
        os.close(before)
        os.close(output)
