"""A recording, tracked."""

import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from workshop import rows

from urdyn.errors import InputError, LogError
from urdyn.estimate import EKF, UKF
from urdyn.io import sha256, write
from urdyn.model.arm import load_arm
from urdyn.simulate import simulate
from urdyn.tracking import Tracker, open_source, quantities
from urdyn.tracking.output.latency import Latency

ROWS = 600


@pytest.fixture(scope="module")
def tracked(workshop, tmp_path_factory):
    out = tmp_path_factory.mktemp("tracked")
    source = open_source(str(workshop.recording), rows=(0, ROWS))
    return out, workshop.track(out, source, twin_sha256=sha256(workshop.twin))


def test_history_ends_where_the_filter_does(workshop, tracked):
    out, summary = tracked
    table = rows(out)
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    of = quantities(workshop.fit, tracker.currents)
    named = [name for quantity in of.names for name in (quantity, f"{quantity}.sd")]
    assert table.column_names[: 1 + len(named)] == ["t", *named]
    assert table.column_names[-3:] == ["nis", "measured", "widened"]
    assert set(summary["final"]) == set(of.names)
    for name, told in summary["final"].items():
        last = table[name][-1].as_py()
        assert abs(told["mean"] - last) <= told["sd"], name
    assert summary["samples"] == ROWS
    assert summary["data_s"] == pytest.approx(np.ptp(workshop.log.t[:ROWS]))


def test_history_has_at_most_ten_rows_a_second(tracked):
    steps = np.diff(rows(tracked[0])["t"].to_numpy())
    assert np.median(steps) == pytest.approx(0.1)


def test_a_history_says_where_it_is_from(workshop, tracked):
    metadata = pq.read_schema(tracked[0] / "history.parquet").metadata
    origin = json.loads(metadata[b"urdyn.provenance"])
    assert origin["twin.sha256"] == sha256(workshop.twin)
    assert origin["source.sha256"] == sha256(workshop.recording)


def test_a_finished_recording_leaves_the_history_alone(tracked):
    assert [path.name for path in tracked[0].iterdir()] == ["history.parquet"]


def test_an_arm_that_does_not_change_keeps_its_friction(workshop, tracked):
    final = tracked[1]["final"]
    for joint in workshop.fit.dynamics.arm.joint_names:
        told = final[f"{joint}.coulomb"]
        assert abs(told["mean"] - workshop.fit.parameters[f"{joint}.coulomb"]) < 5 * told["sd"]


def test_a_folder_whose_name_is_no_text_is_tracked_into(workshop, tmp_path):
    out = tmp_path / b"l\xe4uf".decode(errors="surrogateescape")  # as Python has its name
    summary = workshop.track(out, open_source(str(workshop.recording), rows=(0, 100)))
    assert summary["samples"] == 100 and (out / "history.parquet").exists()


def test_a_duration_ends_a_recording(workshop, tmp_path):
    source = open_source(str(workshop.recording), duration=3.0)
    assert workshop.track(tmp_path, source, filter=UKF())["samples"] == 300


def test_rows_that_were_tracked_are_told_apart(workshop):
    parts = [(0, 700), (700, 1400)]
    assert len({open_source(str(workshop.recording), rows=r).identity for r in parts}) == 2


@pytest.mark.parametrize("text", ["absent.csv", "ros9://topic", "rtde://"])
def test_a_source_that_is_none_is_refused(text):
    with pytest.raises(InputError):
        open_source(text)


def test_a_source_with_other_joints_is_refused(workshop, tmp_path):
    source = replace(open_source(str(workshop.recording)), joints=7)
    with pytest.raises(InputError, match="7 joints"):
        workshop.track(tmp_path, source)


def test_a_log_without_currents_is_refused(workshop, tmp_path):
    channels = {k: v for k, v in workshop.log.channels.items() if k != "actual_current"}
    write(replace(workshop.log, channels=channels), tmp_path / "log.parquet")
    with pytest.raises(InputError, match="actual_current"):
        open_source(str(tmp_path / "log.parquet"))


def test_a_log_too_short_to_be_tracked_is_refused(workshop, tmp_path):
    with pytest.raises(InputError, match="too short"):
        workshop.track(tmp_path, open_source(str(workshop.recording), rows=(0, 5)))


def test_quantiles_of_a_latency_are_right_to_a_percent():
    durations = np.random.default_rng(0).exponential(1e-3, 20_000)
    latency = Latency()
    for duration in durations:
        latency.take(duration)
    for share in (0.5, 0.99):
        assert latency.quantile(share) == pytest.approx(np.quantile(durations, share), rel=0.0105)
    assert latency.longest == durations.max()


def test_nothing_of_another_arm_is_needed_to_open_a_source(tmp_path):
    log = simulate(load_arm("ur10e"), 2.0, 100.0, seed=2)[0]
    write(log, tmp_path / "log.csv")
    assert open_source(str(tmp_path / "log.csv")).period == pytest.approx(0.01)


def test_a_history_is_as_fine_as_it_is_known(workshop, tmp_path):
    glances = {}
    part = open_source(str(workshop.recording), rows=(0, 300))
    workshop.track(tmp_path, part, watch=lambda one: glances.update({one.reading.t: one}))
    table = rows(tmp_path)
    assert len(table) > 25
    for t, *kept in zip(*(table[name].to_pylist() for name in table.column_names), strict=True):
        told, count = glances[t], 2 * len(glances[t].mean)
        kept = np.array(kept[:count])
        assert (abs(kept[::2] - told.mean) <= told.sd / 256).all()
        assert (abs(kept[1::2] - told.sd) <= told.sd / 256).all()


def test_a_joint_without_angles_is_named_and_nothing_is_written(workshop, tmp_path):
    log = workshop.log.slice(0, 100)
    q = log.channels["actual_q"].copy()
    q[:, 2] = np.nan
    path = tmp_path / "half.parquet"
    write(replace(log, channels={**log.channels, "actual_q": q}), path)
    with pytest.raises(LogError, match="no finite value of joint 2 in actual_q"):
        open_source(str(path))
