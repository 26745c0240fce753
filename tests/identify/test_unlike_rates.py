"""Logs of one arm at several rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import butter, lfilter, sosfiltfilt

from urdyn.identify import Noise
from urdyn.identify.band import common_band
from urdyn.identify.search import Run, _start, _with_noise
from urdyn.model.dynamics import Dynamics
from urdyn.types import Motion


def noises_of(point: Dynamics, *motions: Motion) -> Sequence[Noise]:
    """What the arm itself leaves of these motions."""
    runs = [Run(motion) for motion in motions]
    start = _start(point.arm, runs, point.drive.gain, point.payload)
    there = replace(start, z=start.unknowns.score(point, ()))
    return _with_noise(there, runs).noises


def test_each_rate_has_the_noise_of_its_own_rows(point: Dynamics, motion: Motion) -> None:
    """Noise that is alike within 40 ms, which hardly shows in rows as far apart."""
    white = np.random.default_rng(0).standard_normal(motion.q.shape)
    noise = lfilter([0.02], [1.0, -0.8], white, axis=0)
    close = replace(motion, current=motion.current + noise)
    far = close.rows(np.arange(0, len(close), 4), ())
    both = noises_of(point, far, close, far)
    assert both[0] is both[2]
    for found, alone in ((both[0], (far, far)), (both[1], (close,))):
        expected = noises_of(point, *alone)[0]
        # All runs have a mean temperature together.
        np.testing.assert_allclose(found.scale, expected.scale, rtol=1e-3)
        np.testing.assert_allclose(found.ar, expected.ar, atol=1e-3)
    assert both[0].keep < both[1].keep


def test_each_rate_is_compared_in_the_band_of_its_own_recordings(
    point: Dynamics, motion: Motion
) -> None:
    """Else what was filtered out of the fast one is heard wherever a slow one goes along."""
    sos = butter(4, 0.05, output="sos")
    fast = replace(motion, current=sosfiltfilt(sos, motion.current, axis=0))
    slow = fast.rows(np.arange(0, len(fast), 4), ())
    bands = _start(point.arm, [Run(slow), Run(fast), Run(slow)], None, point.payload).bands
    assert bands == tuple(map(common_band, ([slow, slow], [fast], [slow, slow])))
    assert bands[1].every > bands[0].every
