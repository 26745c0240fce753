"""The load that is tracked, beside what the controller is set to carry."""

from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import MagicMock

import numpy as np
import pytest
from once import fitted
from rich.console import Console
from workshop import KilledError, killed_at

from urdyn.cli.announcing import hand
from urdyn.cli.watching import table, verdict
from urdyn.errors import InputError, TwinError
from urdyn.estimate import EKF
from urdyn.identify import identify
from urdyn.io import write
from urdyn.io.rtde import play, serve
from urdyn.model.arm import load_arm
from urdyn.report.digits import interval90
from urdyn.report.identify.tables import identify_table
from urdyn.signal import UNSET, condition
from urdyn.simulate import (
    Payload,
    fourier,
    observe,
    parse_fault,
    simulate,
    typical_sensors,
    virtual_arm,
)
from urdyn.tracking import Tracker, open_source, run
from urdyn.tracking.belief.payload_holds import LEAST
from urdyn.tracking.belief.payload_setting import (
    STOOD,
    Setting,
    agrees,
    at_the_end,
    compared,
)
from urdyn.tracking.belief.physical import KNOWN
from urdyn.tracking.offline import track
from urdyn.tracking.streams.of_source import beside
from urdyn.twin import Twin

TOOL = Payload(1.2, np.array([0.0, 0.0, 0.05]))
CARRIED = 2.8  # [kg] tool and piece, from the fourth second on
RATE = 100.0  # [Hz]


@cache
def tooled(told: bool):
    """An arm that bore its tool when it was identified, whether or not anybody said so."""
    arm = load_arm("ur10e")
    dynamics = virtual_arm(arm, 5, TOOL)
    motion = condition(at_work(dynamics, 0, 14.0))
    tool = TOOL.inertials() if told else None
    make = partial(identify, arm, motion, gain=dynamics.drive.gain, tool=tool)
    return dynamics, fitted(f"tooled_{told}", make)


def at_work(dynamics, number, duration, *faults):
    streams = [np.random.default_rng([5, number, k]) for k in range(2)]
    asked = fourier(dynamics.rigid, duration, RATE, streams[0])
    events = [parse_fault(fault, 6) for fault in faults]
    sensors = replace(typical_sensors(dynamics.arm), wrench_noise=(1.0, 0.02))
    return observe(dynamics, asked, sensors, streams[1], events)


@cache
def picked():
    """The log of a run in which a piece is picked up that the controller is not told of."""
    fault = f"payload_change:onset=4,mass={CARRIED},com=0/0/0.05"
    return at_work(tooled(True)[0], 1, 12.0, fault)


def set_to(log, mass):
    """The log of a controller that is set to a mass [kg], (N,) or one; None: it says nothing."""
    channels = {k: v for k, v in log.channels.items() if k not in ("payload", "payload_cog")}
    if mass is not None:
        channels["payload"] = np.broadcast_to(mass, len(log))
        channels["payload_cog"] = np.zeros((len(log), 3))
    return replace(log, channels=channels)


def source_of(log, folder, **options):
    write(log, folder / "log.parquet")
    return open_source(str(folder / "log.parquet"), **options)


def tracked(log, told, folder, **options):
    source = source_of(log, folder)
    tracker = Tracker(tooled(told)[1], EKF(), source.period)
    return run(tracker, source, folder / "out", **options)


@cache
def half_a_kilogram(told):
    """A run whose controller is set to that: its summary, and the last glance at it."""
    shown = []
    with TemporaryDirectory() as folder:
        summary = tracked(set_to(picked(), 0.5), told, Path(folder), watch=shown.append)
    return summary, shown[-1]


def test_links_are_told_without_a_tool_that_is_named():
    """All else is the same arm: what the last bodies weigh together is what the data tell."""
    (dynamics, apart), (_, within) = tooled(True), tooled(False)
    np.testing.assert_array_equal(apart.dynamics.payload, TOOL.inertials())
    assert apart.tool_known and not within.tool_known and not within.dynamics.payload.any()
    wrists = [f"{link}.mass" for link in dynamics.arm.link_names[-3:]]
    true = float(dynamics.inertials[-3:, 0].sum())
    for fit, tool in ((apart, 0.0), (within, TOOL.mass)):
        found = sum(fit.value(name) for name in wrists)
        sd = np.hypot.reduce([fit.spread(name) for name in wrists])
        assert abs(found - true - tool) < 3.0 * sd
    at_first = sum(apart.prior[apart.parameters.names.index(name)] for name in wrists)
    assert abs(sum(map(apart.value, wrists)) - at_first) < TOOL.mass / 2.0
    assert abs(sum(map(within.value, wrists)) - at_first) > TOOL.mass / 2.0


def test_a_twin_keeps_its_tool(tmp_path):
    for told in (True, False):
        _, fit = tooled(told)
        Twin(fit.dynamics.arm, fit).save(tmp_path / "twin.toml")
        back = Twin.load(tmp_path / "twin.toml").fit
        assert back.tool_known == told
        np.testing.assert_array_equal(back.dynamics.payload, fit.dynamics.payload)
    _, fit = tooled(True)
    fit = replace(fit, dynamics=replace(fit.dynamics, payload=-TOOL.inertials()))
    Twin(fit.dynamics.arm, fit).save(tmp_path / "twin.toml")
    with pytest.raises(TwinError, match="no solid body"):
        Twin.load(tmp_path / "twin.toml")


@pytest.mark.parametrize("told", [True, False])
def test_a_setting_that_is_too_little_is_told(told):
    """Of an arm whose tool nobody named, what is borne beside it is the least that it is off by."""
    summary, _ = half_a_kilogram(told)
    load, setting = summary["final"]["payload.mass"], summary["payload_setting"]
    borne = CARRIED - (0.0 if told else TOOL.mass)
    assert abs(load["mean"] - borne) < 3.0 * load["sd"]
    assert setting["off_kg"] == pytest.approx(load["mean"] - 0.5)
    assert (setting["mass_kg"], setting["tool_known"]) == (0.5, told)
    least = "" if told else "at least "
    assert f"(the controller is set to 0.50 kg: {least}{setting['off_kg']:.2f} kg too little)" in (
        verdict(summary)
    )


def test_a_load_is_told_once_the_motion_has_told_it():
    """Before a joint has borne it, whatever is believed of it is the prior's."""
    standing = track(tooled(True)[1], set_to(picked().slice(0, 50), 0.5), EKF())
    assert not standing.payload_known and standing.payload_setting["off_kg"] is None
    summary, _ = half_a_kilogram(True)
    assert summary["payload_known"] and "kg" in verdict(summary)
    unknown = verdict(summary | {"payload_known": False, "payload_setting": None})
    assert "payload not known" in unknown and "kg" not in unknown


def test_a_load_is_not_told_while_a_current_sensor_is_at_fault(tmp_path):
    """A bias of one joint's current passes for a load, however small the load's sd is."""
    ill = {"kind": "sensor_fault", "name": "shoulder_lift_joint", "gone": False}
    looking = MagicMock(findings=())
    looking.finish.return_value = {"findings": [ill]}
    summary = tracked(picked().slice(0, 200), True, tmp_path, observer=looking)
    assert summary["final"]["payload.mass"]["sd"] < KNOWN and not summary["payload_known"]
    fit, (well, _) = tooled(True)[1], half_a_kilogram(True)
    with pytest.raises(InputError, match="current sensor of shoulder_lift_joint is at fault"):
        hand(fit, well | {"findings": [ill]}, ["payload"], tmp_path)
    assert hand(fit, well | {"findings": [ill | {"gone": True}]}, ["payload"], tmp_path)


@cache
def in_one_call():
    """A recording tracked at once, whose controller is set to half a kilogram."""
    return track(tooled(True)[1], set_to(picked().slice(300), 0.5), EKF())


@pytest.mark.parametrize("told", [True, False])
def test_a_controller_that_is_set_to_the_load_knows_it_whether_or_not_a_tool_was_named(told):
    tracker = Tracker(tooled(told)[1], EKF(), 1.0 / RATE)
    went = replace(in_one_call(), tracker=tracker)
    for mass, as_set in ((0.5, False), (went["payload.mass"][-1], True)):
        setting = Setting(np.r_[mass, 0.0, 0.0, 0.0], STOOD)
        assert replace(went, setting=setting).load_as_set is as_set


def test_a_recording_tracked_in_one_call_tells_the_setting_too():
    went = in_one_call()
    setting = went.payload_setting
    assert setting["off_kg"] == went["payload.mass"][-1] - 0.5 > 2.0
    assert setting["holds"]["too_little"]["holds"] == 1
    assert (
        track(tooled(True)[1], set_to(picked().slice(0, 50), None), EKF()).payload_setting is None
    )


def test_a_raw_wrench_weighs_the_tool_that_currents_know_of(tmp_path):
    dynamics, fit = tooled(True)
    source = source_of(picked(), tmp_path, beside=("raw_wrench",))
    streams = beside(dynamics.arm, source, tool=fit.dynamics.payload)
    tracker = Tracker(fit, EKF(), source.period, streams=streams)
    load = run(tracker, source, tmp_path / "out")["final"]["payload.mass"]
    assert abs(load["mean"] - CARRIED) < 3.0 * load["sd"]
    assert load["sd"] < 0.75 * half_a_kilogram(True)[0]["final"]["payload.mass"]["sd"]


@pytest.mark.parametrize("mass", [CARRIED + 0.05, pytest.param(None, marks=pytest.mark.slow)])
def test_a_setting_that_is_right_is_not_complained_of(mass, tmp_path):
    looking = MagicMock(findings=())
    looking.finish.return_value = {}
    summary = tracked(set_to(picked(), mass), True, tmp_path, observer=looking)
    setting = summary["payload_setting"]
    assert setting is None if mass is None else setting["off_kg"] is None
    # who diagnoses takes such a load for known
    heard = [name for name, _, _ in looking.method_calls]
    assert looking.note.call_args.args == (0, mass is not None) and "note" not in heard[-4:]
    assert "too" not in verdict(summary)


@pytest.mark.parametrize(
    ("mass", "sd", "as_set"),
    [(2.1, 0.1, True), (1.0, 0.1, False), (np.nan, 0.1, False), (2.1, 2.0, True), (0, 2.0, False)],
)
def test_a_controller_is_set_to_a_load_within_what_is_known_of_it(mass, sd, as_set):
    """An arm that sets off may have let go of it; until that shows, it is set to what it was."""
    final = {"payload.mass": {"mean": 2.0, "sd": sd}}
    assert agrees(Setting(np.array([mass, 0.0, 0.0, 0.0])), final) is as_set


def set_instead(told, mass):
    """That run's summary, had the controller been set to another mass: it moves no belief."""
    summary, _ = half_a_kilogram(told)
    setting = Setting(np.r_[mass, 0.0, 0.0, 0.0], STOOD)
    return summary | {"payload_setting": at_the_end(setting, summary["final"], told, True)}


def test_too_much_is_told_only_where_the_tool_is_known():
    for told, off in ((True, CARRIED - 4.0), (False, None)):
        summary = set_instead(told, 4.0)
        found = summary["payload_setting"]["off_kg"]
        assert found is None if off is None else found == pytest.approx(off, abs=0.3)
        assert ("kg too much" in verdict(summary)) == told


def test_a_setting_is_called_wrong_once_it_has_stood_and_moves_no_belief(tmp_path):
    log = picked()
    late = np.where(log.t < log.t[-1] - 0.5 * STOOD, CARRIED, 0.5)
    summary = tracked(set_to(log, late), True, tmp_path)
    assert summary["payload_setting"]["off_kg"] is None
    assert summary["final"] == half_a_kilogram(True)[0]["final"]


def test_a_run_that_goes_on_says_of_the_setting_what_it_would_have(tmp_path):
    log, whole = set_to(picked(), 0.5), half_a_kilogram(True)[0]["payload_setting"]
    source = killed_at(source_of(log, tmp_path), 1050)
    with pytest.raises(KilledError):
        run(Tracker(tooled(True)[1], EKF(), source.period), source, tmp_path / "out")
    assert tracked(log, True, tmp_path)["payload_setting"] == whole
    assert whole["off_kg"] is not None
    assert whole["holds"]["too_little"]["holds"] == 2  # the tool, then with the piece


def test_who_watches_is_shown_friction_as_identification_prints_it():
    glance, (dynamics, fit) = half_a_kilogram(True)[1], tooled(True)
    _, friction, _ = table(glance, dynamics.arm.joint_names).columns
    printed = identify_table(fit).columns[1]
    heads = [" ".join(str(column.header).split()) for column in (friction, printed)]
    assert heads == ["friction at 0.5 rad/s [N·m]"] * 2
    at = glance.names.index("elbow_joint.friction")
    assert str(list(friction.cells)[2]) == interval90(glance.mean[at], glance.sd[at])


def test_who_watches_is_shown_the_setting_and_how_late_that_is():
    console = Console(width=200)
    with console.capture() as heard:
        for delay in (0.9, 2.34):
            glance = replace(half_a_kilogram(True)[1], delay=delay, ended=False)
            console.print(table(glance, load_arm("ur10e").joint_names))
    said = " ".join(heard.get().split())  # however narrow the table
    assert "the controller is set to 0.50 kg" in said
    assert said.count("behind by") == said.count("behind by 2.3 s") == 1


@pytest.mark.parametrize(
    ("told", "stood", "whole", "off"),
    [
        (1.0, STOOD, True, 1.0),
        (3.0, STOOD, True, -1.0),
        (3.0, STOOD, False, None),
        (1.0, 0.9 * STOOD, True, None),
        (2.0 - 0.9 * LEAST, STOOD, True, None),
        (1.8, STOOD, True, None),  # within 3 sd
    ],
)
def test_only_what_the_interval_excludes_is_wrong(told, stood, whole, off):
    setting = Setting(np.r_[told, 0.0, 0.0, 0.05], stood)
    sd = 0.1 if told == 1.8 else 0.01
    found = compared(setting, 2.0, sd, whole, True)
    assert found["off_kg"] == (None if off is None else pytest.approx(off))
    assert compared(Setting(), 2.0, 0.01, whole, True) is None
    assert compared(setting, 2.0, sd, whole, False)["off_kg"] is None  # the motion did not tell it


def test_a_setting_stands_from_when_it_was_made():
    one, other = np.r_[1.0, 0.0, 0.0, 0.0], np.r_[2.0, 0.0, 0.0, 0.0]
    setting = Setting()
    for told, stood in ((UNSET, 0.0), (one, 0.0), (one, 0.5), (UNSET, 0.5), (other, 0.0)):
        setting = setting.heard(told, 0.5)
        assert setting.stood == stood
    assert setting.mass == 2.0


@pytest.mark.flaky(reruns=2)
def test_a_controller_tells_its_setting(ur5e):
    log = simulate(ur5e, 2.0, 500.0, seed=1, payload=TOOL)[0]
    with serve(play(log, loop=True), port=0) as server:
        source = open_source(f"rtde://127.0.0.1:{server.port}", duration=0.2, rate=125.0)
        heard = [arrival.sample.setting for arrival in source.start(0)]
        source.close()
    np.testing.assert_allclose(heard[-1], [TOOL.mass, *TOOL.com])
