"""A robot that begins anew while it is tracked: no stamp comes twice."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from workshop import rows

from urdyn.estimate import EKF
from urdyn.io import read
from urdyn.io.clock import GAP, PAUSE
from urdyn.io.rtde import play, serve
from urdyn.signal import Sample
from urdyn.simulate import simulate
from urdyn.tracking import Arrival, Source, open_source
from urdyn.tracking.sources import source as source_module
from urdyn.tracking.sources.restarts import arrivals

PERIOD = 0.01


def heard(stamps, received=None, **of):
    """What is made of such stamps, and what was said."""
    nothing, said = np.zeros(6), []
    received = np.full(len(stamps), np.nan) if received is None else received

    def start(first):
        for t, came in zip(stamps[first:], received[first:], strict=True):
            wrench = np.concatenate([[t], nothing])[None]
            yield Arrival(Sample(t, nothing, nothing, nothing, nothing, {"wrench": wrench}), came)

    source = Source("robot", "robot", "", PERIOD, 6, True, 0, start, lambda: None, tell=said.append)
    return list(arrivals(replace(source, live=of.pop("live", True)), **of)), said


def stamps_of(came):
    return np.array([arrival.sample.t for arrival in came])


def test_stamps_go_on_by_the_pause_as_it_was_here_and_so_does_what_they_bring() -> None:
    came, said = heard([7.0, 7.01, 0.5, 0.51], np.array([100.0, 100.01, 104.01, 104.02]))
    assert stamps_of(came) == pytest.approx([7.0, 7.01, 11.01, 11.02])
    assert [a.sample.beside["wrench"][0, 0] for a in came] == pytest.approx(stamps_of(came))
    assert [a.ahead for a in came] == pytest.approx([0.0, 0.0, 10.51, 10.51])
    assert len(said) == 1 and "set back by 6.5 s" in said[0] and "from 11.0 s" in said[0]


def test_a_run_that_goes_on_knows_how_far_ahead_it_was_and_of_a_life_that_began_meanwhile() -> None:
    on, said = heard([0.60, 0.61], np.array([3.0, 3.01]), last=11.02, ahead=10.51)
    assert stamps_of(on) == pytest.approx([11.11, 11.12]) and not said
    anew, said = heard([0.1, 0.11], np.array([3.0, 3.01]), last=11.02, ahead=10.51)
    assert stamps_of(anew) == pytest.approx([11.02 + PAUSE, 11.03 + PAUSE]) and len(said) == 1


def test_a_clock_that_is_set_back_by_a_trifle_is_counted_on_in_silence() -> None:
    """Far enough that nothing is estimated from both sides of it together."""
    came, said = heard([1.0, 1.01, 0.9, 0.91], np.array([5.0, 5.01, 5.02, 5.03]))
    steps = np.diff(stamps_of(came))
    assert steps[[0, 2]] == pytest.approx(PERIOD) and steps[1] > GAP * PERIOD and not said


@pytest.mark.parametrize("asked", [None, ("actual_q",)])
@pytest.mark.parametrize("pause", [7.2, 0.004])
def test_a_recording_that_was_made_beside_a_run_has_its_stamps(tmp_path, pause, asked) -> None:
    """So that each can be laid over the other; whatever else is read of it."""
    k = PERIOD * np.arange(40)
    stamps, received = np.concatenate([7.0 + k, 0.5 + k]), np.concatenate([k, k[-1] + pause + k])
    path = tmp_path / "beside.csv"
    table = np.column_stack([stamps, received, stamps])
    np.savetxt(path, table, "%.6f", ",", header="timestamp,received,actual_q_0", comments="")
    log = read(path, channels=asked)
    assert log.t == pytest.approx(stamps_of(heard(stamps, received)[0]))
    assert set(log.channels) == {"actual_q"} | (set() if asked else {"received"})
    (told,) = {defect.remedy for defect in log.defects if defect.kind == "clock set back"}
    assert told == f"counted on {max(pause, 5.5 * PERIOD):g} s later"


def test_a_clock_that_is_set_forwards_is_counted_on_and_what_was_lost_or_read_late_is_not(
    monkeypatch,
) -> None:
    """Whose next life begins in 1970 until it hears what time it is, as a computer's does."""
    at = np.array([100.0, 100.01, 100.02, 100.03])
    monkeypatch.setattr(source_module, "now", lambda: at[-1])
    came, said = heard([1000.0, 1000.01, 1.7e9, 1.7e9 + 0.01], at)
    steps = np.diff(stamps_of(came))
    assert steps == pytest.approx([PERIOD, (GAP + 0.5) * PERIOD, PERIOD], abs=1e-6)
    assert [a.sample.beside["wrench"][0, 0] for a in came] == pytest.approx(stamps_of(came))
    assert len(said) == 1 and "set forwards by 16999989" in said[0] and "from 1000.1 s" in said[0]
    late = [1.0, 1.01, 9.0, 9.01]
    for seen in (at + np.repeat([0.0, 7.98], 2), at):  # packages of 8 s are lost, and read at once
        monkeypatch.setattr(source_module, "now", lambda: 108.0)
        came, said = heard(late, seen)
        assert stamps_of(came).tolist() == late and not said


def test_stamps_that_come_twice_and_those_of_a_log_are_as_they_are() -> None:
    assert stamps_of(heard([1.0, 1.0, 1.01])[0]).tolist() == [1.0, 1.0, 1.01]
    assert stamps_of(heard([1.0, 0.5], live=False)[0]).tolist() == [1.0, 0.5]


@pytest.mark.flaky(reruns=2)  # in real time
def test_a_controller_that_is_killed_and_begins_anew_leaves_no_stamp_twice(
    workshop, ur5e, tmp_path
) -> None:
    log, said, port, lived = simulate(ur5e, 3.0, 500.0, seed=1)[0], [], 0, 1.5

    def life(first_stamp, seconds=3.0):
        """Whose clock is behind that of the life before, however late one joins."""
        part = log.slice(0, int(500 * seconds))
        return serve(play(replace(part, t=part.t + first_stamp)), port=port)

    first = life(20.0, lived)
    port = first.port
    source = open_source(f"rtde://127.0.0.1:{port}", duration=2.5, rate=125.0, tell=said.append)
    began = time.monotonic()

    def again():
        first.join()
        first.close()
        time.sleep(0.3)
        servers.append(life(10.0))

    servers: list = []
    threading.Thread(target=again, daemon=True).start()
    summary = workshop.track(tmp_path, source, filter=EKF())
    source.close()
    took = time.monotonic() - began
    t = rows(tmp_path)["t"].to_numpy()
    assert (np.diff(t) > 0.0).all() and np.diff(t).max() > 0.3
    assert t[-1] - t[0] < took
    assert summary["quality"]["clock_set"] == 1
    assert sum("set back" in line for line in said) == 1
    servers[0].close()
    with life(0.0):  # its third life begins while nobody looks
        source = open_source(f"rtde://127.0.0.1:{port}", duration=1.0, rate=125.0)
        workshop.track(tmp_path, source, filter=EKF())
        source.close()
    later = rows(tmp_path)["t"].to_numpy()
    assert (np.diff(later) > 0.0).all() and later[: len(t)] == pytest.approx(t)
    assert later[len(t)] - t[-1] > PAUSE
