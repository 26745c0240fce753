"""Laws of conditioning: nothing measured is touched, and a stream is its batch."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from urdyn.errors import InputError, LogError
from urdyn.signal import condition, measured, stream
from urdyn.types import Log, Motion

FIELDS = ("t", "q", "v", "a", "jerk", "current", "temperature")


def polled(rows: int = 700, joints: int = 3) -> Log:
    """A log with every trouble: uneven stamps and even ones, gaps, rows and joints missing."""
    rng = np.random.default_rng(11)
    step = np.where(np.arange(rows) % 200 < 100, 0.01, rng.choice([0.008, 0.012], rows))
    step[[150, 155, 400]] = 1.0
    q, v, current = rng.normal(size=(3, rows, joints))
    for values in (q, v, current):
        values[rng.integers(rows, size=6)] = np.nan
        values[rng.integers(rows, size=6), 0] = np.nan
    channels = {"actual_q": q, "actual_qd": v, "actual_current": current}
    return Log(np.cumsum(step), channels)


def without(log: Log, name: str) -> Log:
    return replace(log, channels={key: x for key, x in log.channels.items() if key != name})


def joined(parts: list[Motion], name: str) -> np.ndarray:
    return np.concatenate([getattr(part, name) for part in parts])


@pytest.mark.parametrize("rows", [1, 64, 155, 1000])
@pytest.mark.parametrize("half", [None, 7])
def test_streaming_is_batch(rows: int, half: int | None) -> None:
    log = polled()
    whole = condition(log, offset=0.004, half_window=half)
    parts = list(stream(log, rows, offset=0.004, half_window=half))
    for name in FIELDS:
        assert np.array_equal(joined(parts, name), getattr(whole, name), equal_nan=True)
    begins = [rows * k for k in range(len(parts))]
    found = {b + begin for part, begin in zip(parts, begins, strict=True) for b in part.breaks}
    assert found == set(whole.breaks) - set(begins)
    assert [part.source.rows for part in parts][-1] == (begins[-1], len(log))


def test_current_and_stamps_pass_untouched() -> None:
    log = polled()
    motion = condition(log, offset=0.006)
    assert np.array_equal(motion.t, log.t)
    assert np.array_equal(motion.current, log.channels["actual_current"], equal_nan=True)
    assert np.isnan(motion.temperature).all()


def test_gaps_begin_stretches() -> None:
    motion = condition(polled())
    assert motion.breaks == (150, 155, 400)
    assert (motion.step[[0, 150, 155, 400]] == 0).all()


def test_an_offset_is_what_taylor_says() -> None:
    log = polled()
    moved = condition(log, offset=0.006, degree=3, half_window=4)
    expanded = condition(log, degree=3, half_window=4).ahead(0.006)
    for name in ("q", "v", "a"):  # of a cubic the series ends with the jerk
        np.testing.assert_allclose(
            getattr(moved, name), getattr(expanded, name), rtol=1e-9, atol=1e-9
        )


def test_infinities_are_not_measured() -> None:
    log = polled()
    q = log.channels["actual_q"].copy()
    q[20] = np.inf
    broken = condition(replace(log, channels={**log.channels, "actual_q": q}))
    assert np.isfinite(broken.q[20]).all()


@pytest.mark.parametrize("name", ["actual_q", "actual_current"])
def test_a_log_that_lacks_a_channel_is_told_what_it_has(name: str) -> None:
    with pytest.raises(LogError, match=rf"no channel {name}; there is .*actual_qd") as caught:
        condition(without(polled(), name))
    assert caught.value.column == name


def test_an_empty_channel_is_as_good_as_none() -> None:
    log = polled()
    nothing = np.full_like(log.channels["actual_q"], np.nan)
    with pytest.raises(LogError, match="no finite value actual_current"):
        condition(replace(log, channels={**log.channels, "actual_current": nothing}))


def test_one_row_is_no_motion() -> None:
    with pytest.raises(LogError, match="one row only"):
        condition(polled().slice(0, 1))


def test_what_no_motion_is_made_of_is_told() -> None:
    log = polled()
    with pytest.raises(LogError, match="that of row 1 does not"):
        replace(log, t=log.t[::-1].copy())


@pytest.mark.parametrize("times", [2, 3])
def test_rows_of_one_stamp_each_are_asked_for(times: int) -> None:
    log = polled()
    channels = {n: np.repeat(x, times, axis=0) for n, x in log.channels.items()}
    channels["actual_q"][31, 0] += 1.0  # a glitch within no time
    with pytest.raises(LogError, match="keep one row a stamp"):
        condition(Log(np.repeat(log.t, times), channels))


def test_a_stamp_that_was_written_again_is_as_good_as_once() -> None:
    log = polled()
    again = np.sort(np.r_[np.arange(len(log)), 7, 31, 31, 60])
    rows = {n: x[again] for n, x in log.channels.items()}
    once, twice = condition(log), condition(Log(log.t[again], rows))
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(twice, name), getattr(once, name))
    defect, *_ = measured(Log(log.t[again], rows)).defects
    assert (defect.kind, defect.count) == ("repeated stamp", 4)


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"half_window": 0}, "half_window 0"),
        ({"half_window": 701}, "half_window 701: takes a whole number from 1 to 700"),
        ({"half_window": 2.5}, "half_window 2.5: takes a whole number"),
        ({"degree": 2}, "degree 2: takes a whole number from 3"),
        ({"degree": 40}, "from 3, .* to 12"),
        ({"half_window": 1, "degree": 6}, "3 angles and velocities tell 5 at the most"),
        ({"offset": np.nan}, "offset nan"),
        ({"offset": [0.0, 0.0]}, "offset: 2 for 3"),
    ],
)
def test_a_window_that_determines_nothing_is_refused(settings: dict[str, Any], why: str) -> None:
    with pytest.raises(InputError, match=why):
        condition(polled(), **settings)


def test_without_velocities_the_angles_do() -> None:
    motion = condition(without(polled(), "actual_qd"), half_window=6)
    assert np.isfinite(motion.a).mean() > 0.95
