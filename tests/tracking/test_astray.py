"""Currents that no arm has: the belief stays one in an arm, and comes back with the data."""

from dataclasses import replace

import numpy as np
import pytest
from workshop import RATE, at_work, commissioned

from urdyn.cli.diagnosing import summed
from urdyn.cli.watching import verdict
from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.tracking import Tracker, open_source
from urdyn.tracking.belief.blocks import Blocks
from urdyn.tracking.sources.losses import as_plain, no_losses
from urdyn.tracking.step.state import restarted

HALF = 0.5 * RATE  # [Hz] most of it is told by half as many samples
WRONG = 8.0, 16.0  # [s]
LENGTH = 30.0  # [s] after which a belief is back

WRONGS = {
    "the other sign": lambda current: -current,
    "five times as much": lambda current: 5.0 * current,
    "next to nothing": lambda current: 1e-3 * current,
}
STUCK = {"nothing": lambda current: 0.0 * current}


def other(wrong, since, sample):
    """A sample, as somebody who has mistaken a column sends it."""
    if not WRONG[0] <= since < WRONG[1]:
        return sample
    return replace(sample, current=(WRONGS | STUCK)[wrong](sample.current))


def passed_through(wrong, filter_, rate=HALF, length=LENGTH):
    """Tracker, and state and belief after data that were no arm's for a while."""
    dynamics, fit = commissioned(0)
    tracker = Tracker(fit, filter_, 1.0 / rate)
    state, at = tracker.init(), tracker.currents.places
    for k, sample in enumerate(samples(at_work(dynamics, 0, 5, length, rate=rate))):
        state, reading = tracker.step(state, other(wrong, k / rate, sample))
        if reading is not None:
            belief = reading.belief
            assert np.isfinite(belief.mean).all() and (belief.cov.diagonal() > 0.0).all()
    return at, state, belief


@pytest.mark.parametrize(
    ("wrong", "rate"),
    [
        ("five times as much", HALF),
        *(
            pytest.param(wrong, RATE, marks=pytest.mark.slow)
            for wrong in ("the other sign", "next to nothing")
        ),
    ],
)
def test_a_belief_gone_astray_is_begun_anew(wrong, rate):
    at, state, belief = passed_through(wrong, EKF(), rate)
    assert state.restarts > 0
    drive = commissioned(0)[0].drive
    for group, truth in {"f": np.log(drive.coulomb), "z": np.zeros(6)}.items():
        off, sd = belief.mean[at[group]] - truth, belief.sd[at[group]]
        assert (np.abs(off) < 4.0 * sd + 0.05).all(), group
    assert abs(belief.mean[at["payload"]][0]) < 0.15


def test_a_belief_that_begins_anew_knows_of_no_drive_that_changed(workshop):
    """It is of the commissioned arm, whose drives are all alike again."""
    first = Tracker(workshop.fit, EKF(), 0.01).init()
    changed = replace(first, changed_drives=np.ones(6, dtype=bool))
    assert not restarted(changed, first).changed_drives.any()


def test_sensors_that_are_all_stuck_tell_of_nothing():
    _, state, _ = passed_through("nothing", EKF(), length=20.0)
    assert state.restarts == 0


FIRST, *OTHERS = (*WRONGS, *STUCK)


@pytest.mark.parametrize(
    "wrong", [FIRST, *(pytest.param(wrong, marks=pytest.mark.slow) for wrong in OTHERS)]
)
def test_a_quicker_mode_stays_a_belief_too(wrong):
    passed_through(wrong, Blocks(8), length=20.0)


def test_a_run_tells_of_it(workshop, tmp_path):
    """A log whose currents have the other sign."""
    source = open_source(str(workshop.recording), rows=(0, 600))

    def start(first):
        for arrival in source.start(first):
            sample = replace(arrival.sample, current=-arrival.sample.current)
            yield replace(arrival, sample=sample)

    anew = []

    def watch(at):
        anew.extend([at.reading.t] if at.reading.restarted else [])

    summary = workshop.track(tmp_path / "out", replace(source, start=start), watch=watch)
    assert summary["quality"]["restarts"] == len(anew) > 0
    assert not {*anew} & {*summary["payload_changes"]}
    assert "this arm's twin" in verdict(summary)


def test_a_sound_run_has_nothing_of_it(workshop, tmp_path):
    summary = workshop.track(tmp_path / "out", open_source(str(workshop.recording), rows=(0, 600)))
    assert summary["quality"]["restarts"] == 0
    assert "twin" not in verdict(summary)


def ended(**of):
    """A run of five samples a second that is over."""
    return {
        "samples": 1000, "data_s": 200.0, "rate_hz": 900.0, "payload_changes": [],
        "payload_known": True,
        "latency_ms": {"p99": 2.0},
        "quality": as_plain(no_losses(6), 0, 0, (), 1)
        | {"restarts": 0, "stuck": [], "frozen": [], "lost": None, "too_sparse": None},
        "mode": "full", "quantities": {"joints": []},
        "final": {"payload.mass": {"mean": 1.0, "sd": 0.1}},
    } | of  # fmt: skip


@pytest.mark.parametrize(("rate", "why"), [(4.9, "fell behind the robot"), (5.1, "quick enough")])
def test_who_waits_for_samples_is_told_why_they_came_late(rate, why):
    said = verdict(ended(rate_hz=rate, latency_ms={"p99": 1500.0}))
    assert why in said.splitlines()[1] and "\n" not in verdict(ended(rate_hz=rate))


@pytest.mark.parametrize(
    ("surprise", "restarts", "told"),
    [(None, 0, False), (1.4, 0, False), (67.0, 0, True), (67.0, 1, False)],
)
def test_who_cannot_trust_intervals_is_told_so(surprise, restarts, told):
    quality = ended()["quality"] | {"restarts": restarts}
    said = verdict(ended(surprise=surprise, quality=quality))
    assert ("average surprise is 67" in said) == told
    assert ("begun anew" in said) == bool(restarts)  # which says why they are not


@pytest.mark.parametrize(
    ("count", "words"), [(1, "at stamp 0.5 s"), (3, "2.5 s"), (190, "190 times")]
)
def test_a_sentence_has_room_for_a_few_changes(count, words):
    changes = [0.5 + k for k in range(count)]
    said = verdict(ended(payload_changes=changes))
    assert f"{changes[-1]:.1f} s" in said and words in said and len(said) < 200


def test_nothing_is_found_where_nothing_was_compared():
    run = {"findings": [], "quality": {"compared": [0] * 6}}
    assert "not judged" in summed(run) and "joints that move and their currents" in summed(run)
    some = run | {"quality": {"compared": [0, 3, 0, 0, 0, 0]}}
    assert summed(some) == "nothing found"
    joints = [{"name": "lift", "judged": True}, {"name": "elbow", "judged": False}]
    assert "\nnot judged: elbow: too little was seen" in summed(some | {"joints": joints})
