"""A robot at work, tracked over RTDE; the controller is ours."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from workshop import rows

from urdyn.errors import InputError, LogError, UrdynError
from urdyn.estimate import EKF
from urdyn.io.rtde import play, serve
from urdyn.signal import Touch, samples
from urdyn.simulate import simulate
from urdyn.tracking import Arrival, open_source
from urdyn.tracking.sources import rtde_source
from urdyn.tracking.sources.another_robot import of_this_arm

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once


# [Hz] that a busy machine keeps; at 500 Hz it is measured, and tried among the long tests.
RATE = 125.0
LATE = 0.5  # [s] after which such a machine may read a package


@pytest.fixture(scope="module")
def controller(ur5e):
    log = simulate(ur5e, 8.0, 500.0, seed=1)[0]
    with serve(play(log, loop=True), port=0) as server:
        yield f"rtde://127.0.0.1:{server.port}"


@pytest.mark.parametrize("rate", [RATE, pytest.param(500.0, marks=pytest.mark.slow)])
def test_a_live_robot_is_tracked_at_its_own_pace(workshop, controller, rate, tmp_path):
    source = open_source(controller, duration=2.0, rate=rate)
    summary = workshop.track(tmp_path, source, filter=EKF())
    source.close()
    assert summary["samples"] == 2.0 * rate
    assert summary["lost"] == 0
    assert summary["data_s"] == pytest.approx(2.0 - 1.0 / rate)
    assert len(rows(tmp_path)) > 15


@pytest.mark.parametrize("stamp", [np.nan, pytest.param(np.inf, marks=pytest.mark.slow), 1e300])
def test_a_package_whose_stamp_is_none_is_missed_and_the_run_goes_on(
    workshop, ur5e, tmp_path, stamp
):
    sent = enumerate(play(simulate(ur5e, 3.0, 500.0, seed=1)[0]))
    # One in four is asked for, whichever that is.
    torn = ({**row, "timestamp": stamp} if 300 <= k < 304 else row for k, row in sent)
    with serve(torn, port=0) as server:
        source = open_source(f"rtde://127.0.0.1:{server.port}", duration=1.0, rate=RATE)
        summary = workshop.track(tmp_path, source, filter=EKF())
        source.close()
    assert (summary["samples"], summary["lost"]) == (125, 1)


def test_a_clock_that_is_set_loses_nothing_and_a_run_lasts_as_long_as_it_did(
    workshop, ur5e, tmp_path
):
    sent = enumerate(play(simulate(ur5e, 3.0, 500.0, seed=1)[0]))
    off = 900.0  # [s] for a while
    jumped = ({**row, "timestamp": row["timestamp"] - off * (300 <= k < 450)} for k, row in sent)
    with serve(jumped, port=0) as server:
        source = open_source(f"rtde://127.0.0.1:{server.port}", duration=1.0, rate=RATE)
        summary = workshop.track(tmp_path, source, filter=EKF())
        source.close()
    # When the clock was set is known by when that package was read: late, on a busy machine.
    assert summary["lost"] < LATE * RATE
    assert summary["data_s"] == pytest.approx(0.992, abs=LATE)
    assert summary["quality"]["clock_set"] == 2
    assert (np.diff(rows(tmp_path)["t"].to_numpy()) > 0.0).all()


def test_a_robot_that_is_gone_is_not_waited_for_beyond_the_time_that_was_asked(
    workshop, ur5e, tmp_path
):
    with serve(play(simulate(ur5e, 1.0, 500.0, seed=1)[0]), port=0) as server:
        source = open_source(f"rtde://127.0.0.1:{server.port}", duration=2.0, rate=RATE)
        summary = workshop.track(tmp_path, source, filter=EKF())
    assert summary["samples"] == 125 and summary["wall_s"] < 4.0


def test_a_robot_that_is_another_arm_is_refused_by_its_first_movements(workshop, ur10e, tmp_path):
    with serve(play(simulate(ur10e, 20.0, 100.0, seed=1)[0]), port=0) as server:  # in 4 s
        source = open_source(f"rtde://127.0.0.1:{server.port}", duration=3.0)
        said = f"{source.name}: is of another arm.* where a ur10e has its tool"
        with pytest.raises(LogError, match=said):
            workshop.track(tmp_path, source, filter=EKF())
        source.close()


def test_an_arm_is_never_taken_for_another_and_one_that_stands_is_not_asked(ur5e, ur10e):
    """However far it has moved; whose calibration is in doubt is tested where that is told."""
    log = simulate(ur5e, 20.0, 100.0, seed=1)[0]
    moving = [Arrival(sample, np.nan) for sample in samples(log)]
    assert list(of_this_arm(ur5e, iter(moving), "robot")) == moving
    assert list(of_this_arm(ur10e, iter(moving[:1] * 300), "robot")) == moving[:1] * 300
    with pytest.raises(LogError, match="where a ur5e has its tool"):
        list(of_this_arm(ur10e, iter(moving[:1] * 300 + moving), "robot"))


def test_what_a_robot_has_sent_in_time_is_read_however_late(controller, monkeypatch):
    """By a computer that did something else meanwhile: six looks long."""
    monkeypatch.setattr(rtde_source, "LATEST", 0.1)
    source = open_source(controller, duration=0.4, rate=RATE)
    stream = source.start(0)
    next(stream)
    time.sleep(0.5 + 6 * rtde_source.LOOK)
    assert 1 + sum(1 for _ in stream) == 0.4 * RATE
    source.close()


@pytest.mark.parametrize("duration", [0.0, -1.0, float("inf"), float("nan")])
def test_a_run_has_a_length_or_none_is_named(controller, duration):
    with pytest.raises(InputError, match="above 0, and finite"):
        open_source(controller, duration=duration)


def test_a_robot_that_hardly_sends_is_told_of():
    def seldom():
        for k in range(60):
            time.sleep(0.1)
            yield {"timestamp": k / 500.0}

    said = []
    with serve(seldom(), port=0) as server:
        address = f"rtde://127.0.0.1:{server.port}"
        source = open_source(address, duration=3.5, tell=said.append)
        heard = list(source.start(0))
        source.close()
    assert 20 < len(heard) < 50
    assert "samples a second where 500 were agreed" in said[0] and "--rate" in said[0]


def test_a_live_run_that_is_ended_can_be_taken_up_again(workshop, controller, tmp_path):
    first = open_source(controller, rate=RATE)

    def until(sample):
        for k, arrival in enumerate(first.start(0)):
            if k == sample:  # from another thread, as an interrupt does
                threading.Thread(target=first.close, daemon=True).start()
            yield arrival

    ended = workshop.track(tmp_path, replace(first, start=lambda _: until(200)))
    assert ended["samples"] > 200
    source = open_source(controller, duration=0.5, rate=RATE)
    again = workshop.track(tmp_path, source)
    source.close()
    assert again["samples"] == ended["samples"] + 62
    t = rows(tmp_path)["t"].to_numpy()
    assert len(t) > 10


def test_a_robot_says_that_a_hand_moves_it_and_that_it_works_in_contact(ur5e):
    rows = enumerate(play(simulate(ur5e, 1.0, 500.0, seed=1)[0]))
    teaching, outputs = "robot_status_bits", "actual_digital_output_bits"
    # The teach button, in 100 of 500 rows, and then a tool that works, in 40.
    told = (
        {**row, teaching: 3 + 4 * (100 <= k < 200), outputs: 1 + 8 * (200 <= k < 240)}
        for k, row in rows
    )
    with serve(told, port=0) as server:
        name, contact = f"rtde://127.0.0.1:{server.port}", Touch(outputs, 3)
        source = open_source(name, duration=0.6, rate=RATE, contact=contact)
        came = [arrival.sample for arrival in source.start(0)]
        source.close()
    by_hand, at_work = ([getattr(s, of) for s in came] for of in ("undriven", "in_contact"))
    assert (sum(by_hand), sum(at_work)) == (25, 10)  # one in four is asked for
    either = [hand or work for hand, work in zip(by_hand, at_work, strict=True)]
    assert [bool(np.isnan(sample.current).all()) for sample in came] == either


@pytest.mark.parametrize("channel", ["tool_works", "target_q"])
def test_a_robot_that_cannot_tell_contact_is_refused(controller, channel):
    with pytest.raises(UrdynError, match=channel):
        open_source(controller, contact=Touch(channel))
