"""Logs that another process simulates."""

from multiprocessing import Pipe

import numpy as np
import pytest

from urdyn.cli import apart
from urdyn.errors import InputError, UrdynError
from urdyn.types import Log

LOG = Log(np.arange(1200) / 500.0, {})


def test_the_pieces_are_the_log_and_a_failure_is_raised_where_they_are_played(monkeypatch):
    monkeypatch.setattr(apart, "stand_back", lambda: None)

    def make():
        yield LOG
        raise InputError("is grown beyond what any arm has")

    heard, said = Pipe(duplex=False)
    apart._say(said, make)
    pieces = []
    with pytest.raises(InputError, match="beyond what any arm has"):
        pieces.extend(apart.ahead(apart._heard(heard)))
    np.testing.assert_array_equal(np.concatenate([piece.t for piece in pieces]), LOG.t)
    said.close()
    with pytest.raises(UrdynError, match="was killed"):
        next(apart._heard(heard))
