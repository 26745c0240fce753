"""An arm that works in contact has no currents meanwhile: a channel of its stream says when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import urdyn as ud
from urdyn.errors import InputError, LogError
from urdyn.model.arm import load_arm
from urdyn.signal import Touch, measured, samples, touch_of
from urdyn.signal.channels import IN_CONTACT, ever_in_contact
from urdyn.types import Log

WORK = slice(40, 70)
BITS = "actual_digital_output_bits"


@pytest.fixture(scope="module")
def log() -> Log:
    return ud.simulate(load_arm("ur5e"), 2.0, 50.0, 3)[0]


def _with(log: Log, usual: float, at_work: float) -> Log:
    """With a channel that has one value, and another while the arm works."""
    channel = np.full(len(log), usual)
    channel[WORK] = at_work
    return replace(log, channels={**log.channels, BITS: channel})


@pytest.mark.parametrize(
    ("where", "usual", "at_work"),
    [
        (BITS, 0.0, 1.0),
        (BITS, np.nan, -3.0),
        (f"{BITS}:0", 6.0, 7.0),
        (f"{BITS}:3", 16.0 + 4.0, 8.0),
        (f"{BITS}:52", 2.0**52 - 1.0, 2.0**52),
        (f"{BITS}:31", np.nan, -1.0),  # a register of 32 bits, all set
        (BITS, np.inf, 2.0),
        (f"{BITS}:1", -np.inf, 2.0),
    ],
)
def test_rows_in_contact_are_without_currents_and_counted(log, where, usual, at_work) -> None:
    marked = ud.in_contact(_with(log, usual, at_work), where)
    (defect,) = measured(marked).defects
    assert defect.count == 30 and "in contact" in defect.kind
    told = list(samples(marked))
    for currents in (ud.condition(marked).current, [s.current for s in told]):
        assert np.isnan(currents[WORK]).all() and np.isfinite(currents).sum() == 6 * (len(log) - 30)
    assert [s.in_contact for s in told] == np.isnan([s.current[0] for s in told]).tolist()
    assert not any(s.undriven for s in told)
    np.testing.assert_array_equal(ud.condition(marked).q, ud.condition(log).q)


def test_a_stream_that_never_tells_contact_keeps_its_currents(log) -> None:
    marked = ud.in_contact(_with(log, 8.0, np.nan), f"{BITS}:2")
    assert measured(marked) is marked and not any(s.in_contact for s in samples(marked))


@pytest.mark.parametrize(
    ("channel", "value", "why"),
    [(IN_CONTACT, 1.0, "in contact"), ("robot_mode", 3.0, "moved by hand or without power")],
)
def test_a_log_that_keeps_no_current_is_refused_by_what_took_them(log, channel, value, why) -> None:
    marked = replace(log, channels={**log.channels, channel: np.full(len(log), value)})
    with pytest.raises(LogError, match=f"^no current is left without those of an arm {why}"):
        ud.condition(marked)


def test_what_a_log_says_of_contact_and_every_call_count_together(log) -> None:
    own = np.zeros(len(log))
    own[:2], own[2:4] = -1.0, np.inf
    log = replace(log, channels={**log.channels, IN_CONTACT: own})
    twice = ud.in_contact(ud.in_contact(_with(log, 1.0, 4.0), f"{BITS}:2"), f"{BITS}:7")
    told = np.flatnonzero(ever_in_contact(twice)).tolist()
    assert told == [0, 1, *range(WORK.start, WORK.stop)]


def test_a_channel_that_cannot_tell_contact_is_refused(log) -> None:
    with pytest.raises(LogError, match="has no channel tool_touches to say when the arm is in"):
        ud.in_contact(log, "tool_touches")
    with pytest.raises(LogError, match="actual_q has 6 numbers a row"):
        ud.in_contact(log, "actual_q:1")


@pytest.mark.parametrize(
    "text", ["", ":3", "bits:", "bits:x", "bits:-1", "bits:53", "two words", None, 3]
)
def test_what_names_no_channel_is_refused(text: object) -> None:
    with pytest.raises(InputError, match=r"^contact\b"):
        touch_of(text)


@pytest.mark.parametrize("touch", [Touch("robot_mode"), Touch(BITS, 0), Touch(BITS, 52)])
def test_a_touch_is_named_as_it_is_read(touch: Touch) -> None:
    assert touch_of(str(touch)) == touch
