"""Numbers and words through a pipe."""

from __future__ import annotations

import numpy as np

from urdyn.io.frames import Frames, numbers_frame, words_frame


def test_frames_are_whole_however_they_come() -> None:
    rows = np.random.default_rng(0).standard_normal((3, 49))
    sent = words_frame({"keep": 1, "list": np.arange(3)}) + numbers_frame(rows) + words_frame({})
    for piece in (1, 7, len(sent)):
        frames = Frames()
        pieces = [sent[k : k + piece] for k in range(0, len(sent), piece)]
        words, numbers, empty = (frame for data in pieces for frame in frames.take(data))
        assert words == {"keep": 1, "list": [0, 1, 2]} and empty == {}
        np.testing.assert_array_equal(numbers, rows.ravel())
