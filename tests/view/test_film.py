"""A film says what its history and its log say, and a live arm what its tracker does."""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pyarrow.parquet as pq
import pytest

from urdyn.cli.viewing import Asked, find
from urdyn.errors import LogError
from urdyn.io.ros2.listen import Heard
from urdyn.io.rtde import play as play_back
from urdyn.io.rtde import serve
from urdyn.report.track.history import find_history
from urdyn.signal import samples
from urdyn.tracking import open_source, run
from urdyn.tracking.belief.interest import nothing_yet
from urdyn.tracking.output.checkpoint import FILE, Checkpoint, flattened, write
from urdyn.tracking.sources import ros2_source
from urdyn.tracking.sources.losses import no_losses
from urdyn.tracking.sources.source import now
from urdyn.view.film import Film, film
from urdyn.view.live import RATE, address, followed, tracked, watched
from urdyn.view.paint import LESS, MORE, PAINTS, SAME, UNKNOWN
from urdyn.view.replay import angles, motion, replay
from urdyn.view.show import BACK, before


@pytest.fixture(scope="module")
def shown(tracked_run) -> Film:
    gain = tracked_run.fit.dynamics.drive.gain
    return replay(find_history(tracked_run.out), tracked_run.log, gain)


def test_a_replayed_arm_stands_where_it_stood(tracked_run, shown):
    """The history's moments are those of the log's rows, so that nothing is interpolated."""
    stamps = find_history(tracked_run.out).column("t")
    log = tracked_run.log
    rows = np.searchsorted(log.t, stamps - 1e-6)
    np.testing.assert_allclose(log.t[rows], stamps, atol=1e-9)
    np.testing.assert_allclose(shown.q, log.channels["actual_q"][rows], atol=1e-12)


def test_what_is_shown_is_what_was_believed(tracked_run, shown):
    run, gain = find_history(tracked_run.out), tracked_run.fit.dynamics.drive.gain
    friction, health = run.column("elbow_joint.friction"), run.column("elbow_joint.health")
    left = run.column("current_2") - run.column("predicted_2")
    np.testing.assert_allclose(shown.friction[:, 2], 100 * (friction / friction[0] - 1), atol=1e-9)
    np.testing.assert_allclose(shown.torque[:, 2], left * gain[2] * health)
    assert np.isfinite(shown.torque).mean() > 0.5


def test_without_a_twin_torque_is_unknown_and_nothing_else(tracked_run, shown):
    bare = replay(find_history(tracked_run.out), tracked_run.log, None)
    assert np.isnan(bare.torque).all()
    np.testing.assert_array_equal(bare.friction, shown.friction)


def test_another_log_is_refused(tracked_run):
    log, stamps = tracked_run.log, find_history(tracked_run.out).column("t")
    with pytest.raises(LogError, match="does not span"):
        angles(log.slice(0, 300), stamps, 6)
    with pytest.raises(LogError, match="angles of 7 joints"):
        angles(log, stamps, 7)
    with pytest.raises(LogError, match="no finite angle"):
        blind = {"actual_q": np.full((len(log), 6), np.nan)}
        angles(replace(log, channels=blind), stamps, 6)


def test_a_log_alone_shows_how_the_arm_moved(tracked_run):
    film = motion(tracked_run.log)
    assert np.median(np.diff(film.t)) == pytest.approx(1 / RATE)
    assert np.isfinite(film.q).all() and np.isnan(film.friction).all()


def test_a_moment_is_the_last_that_has_been(shown):
    for t in (0.0, 3.21, shown.end, shown.end + 9.0):
        moment = shown.at(t)
        assert moment.t == shown.t[shown.t <= t].max()
        np.testing.assert_array_equal(moment.q, shown.q[shown.t == moment.t][0])
    assert shown.at(-1.0).t == 0.0


def test_plots_end_now_and_reach_back_so_far(shown):
    long = replace(shown, t=shown.t * 20.0)
    led = before(long, 100.0)
    assert led.t[-1] <= 100.0 + 1.0 and led.t[0] >= 100.0 - BACK
    assert len(before(long, 0.0)) == 1


def test_moments_joined_are_the_film_they_were_of(shown):
    again = film([shown.moment(k) for k in range(20)])
    np.testing.assert_array_equal(again.torque, shown.slice(0, 20).torque)


def test_live_beliefs_are_those_of_a_tracked_recording(tracked_run, shown):
    source = open_source(str(tracked_run.recording))
    moments = film(list(tracked(tracked_run.tracker(), source)))
    assert np.diff(moments.t).min() >= 1 / RATE - 1e-9
    rows = np.searchsorted(shown.t, moments.t[-1] - 1.0)
    # Both change from the commissioned arm; the history's first row is one sample later.
    np.testing.assert_allclose(moments.friction[-1], shown.friction[-1], atol=1.0)
    assert rows > 0 and np.isfinite(moments.torque).any()


@pytest.fixture
def controller(tracked_run):
    with serve(play_back(tracked_run.log, loop=True), port=0) as server:
        yield f"rtde://127.0.0.1:{server.port}"


def test_a_live_robot_is_watched_and_moves_as_it_was_recorded(tracked_run, controller):
    source = open_source(controller, duration=1.0)
    moments = film(list(watched(source)))
    source.close()
    assert moments.end > 0.5 and np.isnan(moments.friction).all()
    recorded = tracked_run.log.channels["actual_q"]
    near = np.abs(recorded[:, None] - moments.q).max(axis=2).min(axis=0)
    assert near.max() < 1e-6


def test_a_run_beside_gives_the_colours_of_what_it_has_written(
    tracked_run, controller, shown, tmp_path
):
    """Of its parts: the first says what was commissioned, the last what is now."""
    parts = tmp_path / "history.parts"
    parts.mkdir()
    whole = pq.read_table(tracked_run.out / "history.parquet")
    third = len(whole) // 3
    thirds = (whole[:third], whole[third : 2 * third], whole[2 * third :])
    for k, rows in enumerate(thirds):
        pq.write_table(rows, parts / f"part-{k:06d}.parquet")
    source = open_source(controller, duration=0.5)
    moments = list(followed(tmp_path, source))
    source.close()
    for moment in moments:
        np.testing.assert_allclose(moment.friction, shown.friction[-1])
        assert np.isnan(moment.torque).all()  # it is of another moment
    assert not np.array_equal(moments[0].q, moments[-1].q)


@pytest.mark.parametrize("calibrated", ["", f" {'ab' * 32}"])
def test_a_run_says_which_robot_it_tracks(tracked_run, controller, tmp_path, calibrated):
    """By the checkpoint that the tracker wrote: it is left where a live run ends."""
    assert address(tmp_path) == ""
    source = open_source(controller, duration=1.0)
    source = replace(source, identity=f"{source.identity}{calibrated}")
    run(tracked_run.tracker(), source, tmp_path)
    source.close()
    assert address(tmp_path) == controller
    (tmp_path / "history.parquet").unlink()  # that is written at its end
    found = find(Asked(str(tmp_path), tracked_run.twin))
    assert found.moments is not None
    assert np.isfinite(next(found.moments).friction).all()
    found.moments.close()
    found.close()
    (tmp_path / FILE).write_bytes(b"torn")
    assert address(tmp_path) == ""


class Topic:
    """Joint states of the recording, on a graph that is not there."""

    def __init__(self, log, *_):
        self.told = samples(log)

    def get(self, *, timeout):
        sample = next(self.told)
        return Heard(now(), sample.t, sample.q, sample.v, np.full(6, np.nan))

    def empty(self):
        return False


def test_a_run_of_a_topic_is_shown_there_and_one_of_a_log_nowhere(
    tracked_run, tmp_path, monkeypatch
):
    start = Checkpoint(tracked_run.tracker().init(), nothing_yet(6), no_losses(6))
    layout, numbers = flattened(start)
    log = open_source(str(tracked_run.recording)).identity
    for source, robot in ((log, ""), ("ros2://joint_states", "ros2://joint_states")):
        write(layout, numbers, {"source": source}, tmp_path)
        assert address(tmp_path) == robot
    (parts := tmp_path / "history.parts").mkdir()
    shutil.copy(tracked_run.out / "history.parquet", parts / "part-000000.parquet")
    monkeypatch.setattr(ros2_source, "participant", lambda: None)
    monkeypatch.setattr(ros2_source, "Listener", partial(Topic, tracked_run.log))
    found = find(Asked(str(tmp_path), tracked_run.twin))
    np.testing.assert_array_equal(next(found.moments).q, tracked_run.log.channels["actual_q"][0])
    found.close()


@pytest.mark.parametrize("name", PAINTS)
def test_colours_run_from_blue_over_grey_to_vermilion_as_things_grow_worse(name):
    paint = PAINTS[name]
    worse = paint.worse * paint.span
    ends = {worse: MORE, 9 * worse: MORE, 0.0: SAME, -worse: LESS}
    for value, colour in ends.items():
        assert paint.colour(value) == tuple(colour.astype(int))
    assert paint.colour(np.nan) == UNKNOWN
    reds = [
        paint.colour(share * worse)[0] - paint.colour(share * worse)[2] for share in (0.1, 0.5, 1)
    ]
    assert sorted(reds) == reds
