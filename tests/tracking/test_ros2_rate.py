"""How often joint states come, as the first few of them tell."""

from __future__ import annotations

from queue import Empty, SimpleQueue
from threading import Event

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.io import Effort
from urdyn.io.ros2.listen import Heard
from urdyn.tracking.sources import ros2_source
from urdyn.tracking.sources.ros2_source import FIRST, SILENT, hearing
from urdyn.tracking.sources.source import LOOK, now

NOW = 1.7e9  # [s] since 1970: stamps are told to .2 µs


def told(stamps):
    """The period of a source that hears these stamps [s]."""
    inbox, joints = SimpleQueue(), np.zeros(6)
    for stamp in stamps:
        inbox.put(Heard(0.0, float(stamp), joints, joints, joints))
    return hearing("ros2://joint_states", inbox, Event(), Effort("A", np.ones(6))).period


@pytest.mark.parametrize("period", [0.002, 0.008])
def test_stamps_that_jitter_or_are_missing_tell_the_rate(period):
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(200):
        steps = np.delete(np.arange(FIRST + 1), rng.integers(1, FIRST))  # one never came
        jitter = 0.05 * period * rng.standard_normal(FIRST)
        errors.append(told(NOW + period * steps + jitter) / period - 1.0)
    # The slope of a line is known to jitter over the root of the steps' sum of squares about their
    # mean: 110 - 1.1 (k - 5)² without the k-th of 0 .. 10, so 92.4 at least. 200 tell an sd to 5 %.
    assert np.std(errors) < 1.2 * 0.05 / np.sqrt(92.4)
    assert abs(np.mean(errors)) < 3.0 * 0.05 / np.sqrt(92.4 * len(errors))


@pytest.mark.parametrize("v", [0.0, np.nan])
def test_joint_states_without_velocities_are_told_by_the_first(v):
    inbox, joints = SimpleQueue(), np.zeros(6)
    inbox.put(Heard(0.0, NOW, joints, joints + v, joints))
    source = hearing("ros2://joint_states", inbox, Event(), Effort("A", np.ones(6)), 100.0)
    assert source.velocities == (v == 0.0)


def test_stamps_that_stand_still_are_refused():
    with pytest.raises(InputError, match="do not run forward"):
        told(np.full(FIRST, NOW))


@pytest.mark.parametrize("anew", [0.0, NOW])
def test_a_clock_that_is_set_shortens_and_lengthens_no_run(anew):
    """As by a simulator that begins anew, or a computer that hears what time it is: 2 s of stamps,
    whichever they are.
    """
    inbox, joints = SimpleQueue(), np.zeros(6)
    for stamp in np.r_[np.arange(500.0, 501.0, 0.01), anew + np.arange(0.0, 5.0, 0.01)]:
        inbox.put(Heard(0.0, float(stamp), joints, joints, joints))
    source = hearing("ros2://joint_states", inbox, Event(), Effort("A", np.ones(6)), 100.0, 2.0)
    assert sum(1 for _ in source.start(0)) == pytest.approx(200, abs=2)


class Script:
    """An inbox into which messages come one after the other; None: a look in vain."""

    def __init__(self, told):
        self.left = list(told)

    def get(self, *, timeout):
        one = self.left.pop(0)
        if one is None:
            raise Empty
        return one

    def empty(self):
        return not self.left


def messages(first, count):
    joints, came = np.zeros(6), now()
    return [
        Heard(came, NOW + 0.01 * k, joints, joints, joints) for k in range(first, first + count)
    ]


def listened(inbox, **of):
    """How many samples came of it until it was empty, or its time was over; and what was said."""
    ended, said = Event(), []
    effort = Effort("A", np.ones(6))
    source = hearing("ros2://joint_states", inbox, ended, effort, 100.0, tell=said.append, **of)
    if not of:
        ended.set()
    return sum(1 for _ in source.start(0)), said


def test_a_driver_that_is_silent_is_told_of_and_so_is_its_return():
    looks = round(SILENT / LOOK)
    for vain, told in ((looks - 2, 0), (looks + 9, 2)):
        came, said = listened(Script([*messages(0, 5), *[None] * vain, *messages(5, 5)]))
        assert came == 10 and len(said) == told
    assert f"silent for {SILENT:g} s" in said[0] and said[1] == "is back"


def test_a_driver_that_is_gone_is_not_waited_for_beyond_the_time_that_was_asked(monkeypatch):
    inbox = SimpleQueue()
    for one in messages(0, 5):
        inbox.put(one)
    monkeypatch.setattr(ros2_source, "LATEST", 0.0)
    assert listened(inbox, duration=0.1) == (5, [])
    assert listened(Script([*messages(0, 5), None, *messages(5, 9)]), duration=0.1) == (10, [])
