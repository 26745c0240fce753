"""What a stream lacked is counted, once."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.cli.watching import verdict
from urdyn.dbn import Edge, Network, Node, figure2
from urdyn.errors import InputError
from urdyn.estimate import EKF
from urdyn.io import write
from urdyn.signal import Sample, Touch, samples
from urdyn.tracking import Arrival, Tracker, open_source
from urdyn.tracking.belief.blocks import Blocks
from urdyn.tracking.belief.network import of_arm, tracked_network
from urdyn.tracking.modes import QUICKER, mode_of
from urdyn.tracking.sources.losses import as_plain, counted, no_losses, too_sparse
from urdyn.tracking.step.joint_motion import STANDING

PERIOD = 0.01


@pytest.fixture(scope="module")
def workshop(workshop, tmp_path_factory):
    """Its recording's first six seconds."""
    path, log = tmp_path_factory.mktemp("six") / "log.parquet", workshop.log.slice(0, 600)
    write(log, path)
    return replace(workshop, log=log, recording=path)


def sample(t: float, current: float = 1.0) -> Sample:
    one = np.ones(2)
    return Sample(t, one, one, np.array([1.0, current]), one)


def test_what_is_lost_repeated_and_set_back_is_told_apart():
    stamps = [0.0, 0.01, 0.03, 0.13, 0.13, 0.05, 0.06]  # 0.03: jitter, no gap
    losses, last = no_losses(2), np.nan
    for t in stamps:
        losses = counted(losses, sample(t, np.nan if t == 0.03 else 1.0), last, PERIOD, np.nan, 0)
        last = t
    found = as_plain(losses, 0, 2, ("a",), len(stamps))
    assert found == {
        "gaps": 1, "missing": 9, "longest_step_s": pytest.approx(0.1), "repeated": 1,
        "clock_set": 1, "refused": 0, "undrawn": 2, "undriven": 0, "in_contact": 0,
        "without_current": [0.0, pytest.approx(1 / 7)], "defects": ["a"],
    }  # fmt: skip


def test_who_begins_anew_on_the_way_still_tells_what_the_run_lacked(workshop, tmp_path):
    log = workshop.log.slice(0, 400)
    channels = {name: x.copy() for name, x in log.channels.items()}
    channels["actual_q"][100, 2] += 1.0  # torn
    channels["actual_current"][110, 1] = 500.0
    told = list(samples(replace(log, channels=channels)))
    recorded = open_source(str(workshop.recording))

    def quality(anew):
        def start(first):
            return (Arrival(s, np.nan, k == anew) for k, s in enumerate(told[first:], first))

        source = replace(recorded, length=len(told), start=start)
        return workshop.track(tmp_path / str(anew), source)["quality"]

    undisturbed, anew = quality(None), quality(200)
    assert anew["refused"] == undisturbed["refused"] > 0
    assert anew["undrawn"] == undisturbed["undrawn"] == 1


def test_a_run_tells_what_its_recording_lacked(workshop, tmp_path):
    keep = np.ones(600, bool)
    keep[200:260] = False  # 0.6 s of 100 Hz
    rows = np.flatnonzero(keep)
    channels = {name: x[rows].copy() for name, x in workshop.log.channels.items()}
    channels["actual_current"][100:130, 3] = np.nan
    channels["actual_q"][400, 2] += 1.0  # torn
    channels["actual_current"][450, 1] = 500.0
    channels["robot_mode"] = np.where(rows // 20 == 26, 6.0, 7.0)  # backdrive
    channels["tool_works"] = (rows // 20 == 27) + 0.0
    write(replace(workshop.log, t=workshop.log.t[rows], channels=channels), tmp_path / "a.parquet")
    source = open_source(str(tmp_path / "a.parquet"), contact=Touch("tool_works"))
    summary = workshop.track(tmp_path / "out", source)
    quality = summary["quality"]
    assert (quality["gaps"], quality["missing"]) == (1, 60)
    assert quality["longest_step_s"] == pytest.approx(0.61)
    assert quality["without_current"][3] == pytest.approx(30 / len(rows))
    assert quality["refused"] > 0 and quality["undrawn"] == 1
    assert quality["undriven"] == quality["in_contact"] == 20
    assert not quality["without_current"][1]  # told once
    said = verdict(summary)
    assert "not whole: impossible angles or speeds" in said and "gap (kept)" in said
    assert "by hand or without power 20; currents that no motor draws 1;" in said
    assert "up to 5.6 % missing" in said
    assert f"in contact for 20 of {len(rows)} samples" in said
    assert quality["lost"] is None and not any(quality["stuck"])
    assert quality["too_sparse"] is None  # one gap is a gap
    whole = open_source(str(workshop.recording), rows=(0, 300))
    assert "not whole" not in verdict(workshop.track(tmp_path / "whole", whole))


@pytest.mark.parametrize("of", ["recording", "ros2"])
def test_a_stream_that_cannot_tell_contact_is_refused(workshop, of):
    name = {"recording": str(workshop.recording), "ros2": "ros2://joint_states"}[of]
    with pytest.raises(InputError, match="has no channel tool_works to say when the arm is in"):
        open_source(name, contact=Touch("tool_works"))


def changed(workshop, path, **columns):
    """The source that is the recording with other (rows, joint) of its channels."""
    channels = {name: x.copy() for name, x in workshop.log.channels.items()}
    for name, (rows, joint) in columns.items():
        channels[name][rows, joint] = channels[name][rows.start, joint]
    write(replace(workshop.log, channels=channels), path)
    return open_source(str(path))


def test_a_joint_that_ends_a_run_is_named_and_when_it_did(workshop, tmp_path):
    end = slice(300, None)
    source = changed(workshop, tmp_path / "a.parquet", actual_q=(end, 2), actual_qd=(end, 2))
    summary = workshop.track(tmp_path / "out", source)
    since = summary["quality"]["lost"]["since"]
    assert summary["quality"]["lost"]["joints"] == ["elbow_joint"]
    assert 0.0 < since - workshop.log.t[300] < 0.5
    assert f"since stamp {since:.1f} s: elbow_joint told no angle" in verdict(summary)


def test_samples_between_gaps_are_too_few_though_not_every_step_is_a_gap():
    """Steps about GAP periods long: of three in a row one is more."""
    losses, window, last = no_losses(2), [], np.nan
    for k, t in enumerate(np.cumsum([0.0] + [0.052, 0.049, 0.049] * 20)):
        few = len(window)
        losses = counted(losses, sample(t), last, PERIOD, window[0] if few else np.nan, few)
        window, last = ([*window, t] if k % 3 != 1 else [t]), t
    assert too_sparse(losses, PERIOD) == {
        "since": 0.0, "for_s": pytest.approx(19 * 0.15 + 0.052), "period_s": PERIOD,
        "step_s": pytest.approx((19 * 0.15 + 0.052) / 58),
    }  # fmt: skip


@pytest.mark.parametrize("seldom_first", [False, True])
def test_a_stream_whose_rate_changed_says_what_was_not_tracked(workshop, tmp_path, seldom_first):
    """Of 6 s at 100 Hz 2.4 s have every twelfth sample only, be it at the end or at the start."""
    rows = np.arange(600)
    seldom = rows < 240 if seldom_first else rows >= 360
    keep = rows[~seldom | (rows % 12 == 0)]
    channels = {name: x[keep] for name, x in workshop.log.channels.items()}
    write(replace(workshop.log, t=workshop.log.t[keep], channels=channels), tmp_path / "a.parquet")
    source = open_source(str(tmp_path / "a.parquet"))
    summary = workshop.track(tmp_path / "out", source)
    sparse = summary["quality"]["too_sparse"]
    assert sparse["step_s"] == pytest.approx(0.12) and sparse["period_s"] == pytest.approx(0.01)
    assert sparse["for_s"] == pytest.approx(2.4, abs=0.25)
    begin = workshop.log.t[0 if seldom_first else 360]
    assert sparse["since"] == pytest.approx(begin, abs=0.13)
    assert "samples came 0.12 s apart there, and the period of this run is 0.01 s" in verdict(
        summary
    )


def test_a_current_that_stays_while_its_joint_moves_is_counted(workshop, tmp_path):
    source = changed(workshop, tmp_path / "a.parquet", actual_current=(slice(200, None), 1))
    summary = workshop.track(tmp_path / "out", source)
    slid = np.abs(workshop.log.channels["actual_qd"][200:, 1]) > STANDING
    counts = np.array(summary["quality"]["stuck"])
    assert 0.8 * slid.sum() < counts[1] < slid.sum() and not counts[[0, 2, 3, 4, 5]].any()
    said = verdict(summary)
    assert f"currents of shoulder_lift_joint that stay while it moves {counts[1]}" in said


def test_a_velocity_that_stays_while_its_joint_moves_is_counted_and_since_when(workshop, tmp_path):
    source = changed(workshop, tmp_path / "a.parquet", actual_qd=(slice(200, None), 1))
    summary = workshop.track(tmp_path / "out", source)
    [frozen] = summary["quality"]["frozen"]
    assert frozen["joint"] == "shoulder_lift_joint" and summary["quality"]["refused"] == 0
    # A row of evidence takes 0.02 rad/s, and its first is the first that is left out.
    late = np.abs(
        workshop.log.channels["actual_qd"][:, 1] - workshop.log.channels["actual_qd"][200, 1]
    )
    begins = workshop.log.t[200 + np.argmax(late[200:] > 0.03)]
    assert workshop.log.t[200] <= frozen["since"] <= begins
    assert 0.9 * np.count_nonzero(workshop.log.t > frozen["since"]) <= frozen["samples"]
    assert f"speed of shoulder_lift_joint that stays while it moves {frozen['samples']}, since" in (
        verdict(summary)
    )


def test_a_joint_without_any_current_lacks_all_of_it(workshop, tmp_path):
    channels = {name: x.copy() for name, x in workshop.log.channels.items()}
    channels["actual_current"][:, 3] = np.nan
    write(replace(workshop.log, channels=channels), tmp_path / "a.parquet")
    source = open_source(str(tmp_path / "a.parquet"), rows=(0, 300))
    assert "up to 100 % missing" in verdict(workshop.track(tmp_path / "out", source))


def test_a_quicker_mode_says_where_its_loss_is_printed(workshop, tmp_path):
    source = open_source(str(workshop.recording), rows=(0, 100))
    summary = workshop.track(tmp_path, source)
    for mode, filter_ in [("full", EKF()), ("realtime", Blocks(8)), *QUICKER.items()]:
        assert mode_of(filter_) == mode
        said = verdict(summary | {"mode": mode_of(filter_)})
        assert ("`urdyn bench track` prints" in said) == (mode != "full")


def test_the_tracked_network_has_the_edges_that_the_filter_uses():
    network = tracked_network()
    assert network.slice.parents("curr") == frozenset(n.name for n in network.parameters)
    assert ("f", "alpha") in network.across
    assert ("m", "alpha") in network.across
    assert network.d_separated("o", "f")


@pytest.mark.parametrize(
    ("nodes", "edges", "said"),
    [
        (("g",), (), "no g to track; its parameters are k p m"),
        ((), (Edge("k", "f"),), "leads nothing: what strays"),
        (("o",), (Edge("o", "curr", 0.0),), r"^o -> curr \(\+0\): what shows there follows from"),
    ],
)
def test_a_network_that_would_lead_nothing_is_refused(
    nodes: tuple[str, ...], edges: tuple[Edge, ...], said: str
) -> None:
    paper = figure2()
    network = Network((*paper.nodes, *map(Node, nodes)), (*paper.edges, *edges))
    with pytest.raises(InputError, match=said):
        of_arm(network)
    assert of_arm(paper) is paper and of_arm(tracked_network())


@pytest.mark.parametrize(
    ("network", "shared", "said"),
    [
        (tracked_network().without("p", "curr"), "", "^p -> curr is missing: it tells what"),
        (figure2().without("k", "pos"), "k", "^k -> pos is missing, and a stream tells by it"),
        (figure2().without("m", "force"), "payload", "^m -> force is missing, and a stream"),
    ],
)
def test_a_network_without_an_edge_that_tells_is_refused(
    network: Network, shared: str, said: str
) -> None:
    """What no stream tells nobody sees: an edge to it is one to a leaf, and says nothing."""
    with pytest.raises(InputError, match=said):
        of_arm(network, (shared,))
    if shared:
        assert of_arm(network, ("",)) is network
    assert of_arm(figure2(), ("k", "payload")) == figure2()


def test_a_lost_current_costs_no_other(workshop):
    """Every fourth of a joint: never as many in a row as the whitening filter takes."""
    tracker = Tracker(workshop.fit, EKF(), PERIOD)

    def compared(lost):
        state, told = tracker.init(), []
        for k, one in enumerate(samples(workshop.log.slice(0, 100))):
            gone = (np.arange(6) == 1) & (k % 4 == 0) & lost
            state, reading = tracker.step(
                state, replace(one, current=np.where(gone, np.nan, one.current))
            )
            told += [np.isfinite(reading.innovation.residual)] if reading else []
        return np.array(told)

    whole, lossy = compared(False), compared(True)
    assert lossy[:, 1].sum() >= 3 * whole[:, 1].sum() // 4 > 30
    np.testing.assert_array_equal(np.delete(lossy, 1, axis=1), np.delete(whole, 1, axis=1))
