"""Who is asked to end a process, and until when."""

from __future__ import annotations

import signal

import pytest

from urdyn.cli.ending import ended_by


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_afterwards_signals_mean_what_they_did_before(number: signal.Signals) -> None:
    """Once they stayed a track's: whoever was interrupted later in that process waited for ever."""
    before, heard = signal.getsignal(number), []
    with pytest.raises(ValueError, match="meanwhile"), ended_by(lambda: heard.append(number)):
        signal.raise_signal(number)
        raise ValueError("meanwhile")
    assert heard == [number]
    assert signal.getsignal(number) is before
