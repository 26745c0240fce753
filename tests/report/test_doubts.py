"""What is said of a fit whose log was no log of this arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from urdyn.errors import IdentifiabilityError, InputError
from urdyn.identify import Fit, Score, batch, identify, validate
from urdyn.identify.another_load import another_load
from urdyn.identify.scoring import amiss_in
from urdyn.model.arm import Arm
from urdyn.model.population import population
from urdyn.report.identify.doubts import (
    doubts,
    otherwise_warm,
    picked,
    slopes,
    smooth,
    unexplained,
    unlearnt,
)
from urdyn.report.identify.page import identify_page
from urdyn.signal import condition
from urdyn.simulate import Payload, simulate
from urdyn.types import Array, Gaussian, Log

SWAPPED = [2, 1, 0, 3, 4, 5]  # alphabetical order of the names: the elbow comes first


@pytest.fixture(scope="module")
def log(ur5e: Arm) -> Log:
    """As the fixture of the fit has it."""
    return simulate(ur5e, 12.0, 100.0, 1)[0]


@pytest.fixture(scope="module")
def score(identified: Fit, log: Log) -> Score:
    return validate(identified, log)


def currents(log: Log, i: Array) -> Log:
    return replace(log, channels={**log.channels, "actual_current": i})


def test_nothing_is_said_of_a_sound_log(identified: Fit, score: Score) -> None:
    assert doubts(identified, [score]) == []


@pytest.mark.parametrize(
    "wrong",
    [lambda i: i[:, SWAPPED], pytest.param(np.abs, marks=pytest.mark.slow)],
    ids=["order", "sign"],
)
def test_currents_of_other_joints_are_explained_by_no_model(ur5e: Arm, log: Log, wrong) -> None:
    odd = currents(log, wrong(log.channels["actual_current"]))
    fit = identify(ur5e, condition(odd))
    scores = [validate(fit, odd)]
    [said] = unexplained(fit, scores)
    assert said.startswith("no model of a ur5e explains the currents of") and "shoulder pan" in said
    assert "mounted otherwise than its URDF says" in said
    page = identify_page(fit, scores, "urdyn identify", 1.0, doubts=doubts(fit, scores))
    assert "N" + said[1:] in page.replace("&#x27;", "'")


def test_a_joint_that_the_controller_knows_much_better_is_none_of_this_arm(
    identified: Fit, score: Score
) -> None:
    """Its error is half of ours, whatever ours is."""
    for times, told in ((0.55, False), (0.45, True)):
        controller = np.where(np.arange(6) == 4, times, 2.0) * score.rre_percent
        said = unexplained(identified, [replace(score, target_rre_percent=controller)])
        assert bool(said) == told and ("of wrist 2 by" in "".join(said)) == told


@pytest.mark.parametrize("down", [False, True])
def test_a_piece_that_was_picked_up_or_put_down_in_a_log_is_told(
    ur5e: Arm, identified: Fit, log: Log, down: bool
) -> None:
    piece = Payload(2.0, np.array([0.0, 0.02, 0.06]))
    laden = simulate(ur5e, 12.0, 100.0, 1, payload=piece)[0]
    borne = (np.arange(len(log)) >= 700)[:, None] ^ down
    both = {name: (log.channels[name], laden.channels[name]) for name in log.channels}
    channels = {name: np.where(borne, b, a) for name, (a, b) in both.items() if a.ndim == 2}
    score = validate(identified, Log(log.t, channels))
    _, since = another_load(identified, score)
    assert abs(since - log.t[700]) < 1.0
    [said] = picked(identified, [score])
    assert f"from stamp {since:.1f} s on the tool seems to bear another load" in said
    assert said.endswith("worked in contact: commission on a free motion")
    assert said in doubts(identified, [score])
    no_model = replace(score, target_rre_percent=0.1 * score.rre_percent)
    assert said not in doubts(identified, [no_model])


@pytest.mark.parametrize("share", [0.2, 0.8])
def test_a_joint_of_which_most_is_prior_is_said_to_be_what_is_typical(
    identified: Fit, share: float
) -> None:
    at, cov = identified.names.index("elbow_joint.coulomb"), identified.belief.cov.copy()
    cov[at, at] = share * population(identified.dynamics.arm).drive["coulomb"].sd[2] ** 2
    fit = replace(identified, belief=Gaussian(identified.belief.mean, cov))
    said = doubts(fit, [])
    assert said == unlearnt(fit) and len(said) == (share > 0.5)
    assert all(one.startswith("the logs tell next to nothing of") for one in said)


def test_no_fit_is_made_to_a_current_that_never_changes(
    ur5e: Arm, identified: Fit, log: Log, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would be taken for friction, and other joints be blamed."""
    i = log.channels["actual_current"].copy()
    i[:, 2] = 0.5
    lost, dead = np.where(i == 0.5, np.nan, i), currents(log, i)
    score = validate(identified, dead)
    [left_out] = score.log.defects
    assert str(left_out).startswith(f"{len(log)} x current that never changes while its joint")
    monkeypatch.setattr(batch, "search", lambda _, runs, *rest: runs)
    [run] = identify(ur5e, condition(dead))
    assert np.array_equal(run.motion.current, lost, equal_nan=True)


def test_a_current_may_be_the_same_while_its_joint_stands(identified: Fit, log: Log) -> None:
    q, i = (log.channels[name].copy() for name in ("actual_q", "actual_current"))
    q[:, 2], i[:, 2] = q[0, 2], i[0, 2]
    assert amiss_in(identified.dynamics, q, i) == ()


@pytest.mark.parametrize(("offset", "told"), [(0.0376, "38 ms early"), (-0.023, "23 ms late")])
def test_streams_that_no_recorder_puts_that_far_apart_are_doubted(
    identified: Fit, score: Score, offset: float, told: str
) -> None:
    drive = replace(identified.dynamics.drive, time_offset=offset)
    apart = replace(identified, dynamics=replace(identified.dynamics, drive=drive))
    [said] = doubts(apart, [score])
    assert said.startswith(f"currents are {told} beside the motion")


def test_a_log_without_velocities_is_said_to_be_one(identified: Fit, log: Log) -> None:
    channels = {name: x for name, x in log.channels.items() if name != "actual_qd"}
    bare = [validate(identified, replace(log, channels=channels))]
    [said] = slopes(bare)
    assert said.startswith("no velocities are in") and said in doubts(identified, bare)


def test_currents_that_were_low_passed_are_said_to_be(identified: Fit, log: Log) -> None:
    low_pass = butter(8, 3.0, fs=100.0, output="sos")
    smoothed = sosfiltfilt(low_pass, log.channels["actual_current"], axis=0)
    score = validate(identified, currents(log, smoothed))
    said = [why for why in doubts(identified, [score]) if "low-passed" in why]
    assert said == smooth([score]) and np.isnan(score.floor_percent).all()


@pytest.mark.parametrize("velocities", [0.0, 1e-3, None])
def test_an_arm_that_stands_is_no_motion_whatever_its_encoders_say(
    ur5e: Arm, log: Log, velocities: float | None
) -> None:
    rng, still = np.random.default_rng(5), np.zeros((len(log), 6))
    q, i = (log.channels[name][:1] for name in ("actual_q", "actual_current"))
    channels = {
        "actual_q": q + rng.normal(0.0, 1e-3, still.shape),
        "actual_current": i + rng.normal(0.0, 0.05, still.shape),
    }
    if velocities is not None:
        channels["actual_qd"] = rng.normal(0.0, velocities, still.shape)
    with pytest.raises(IdentifiabilityError, match="no joint moves far enough"):
        identify(ur5e, condition(Log(log.t, channels)))


def test_no_motion_at_all_is_told_as_such(ur5e: Arm) -> None:
    with pytest.raises(InputError, match="no motion to identify from"):
        identify(ur5e)


def test_currents_that_are_all_zero_are_refused(ur5e: Arm, log: Log) -> None:
    nothing = currents(log, np.zeros((len(log), 6)))
    with pytest.raises(IdentifiabilityError, match="all currents are zero"):
        identify(ur5e, condition(nothing))


@pytest.mark.parametrize(
    ("warmer", "said"), [(4.0, ""), (-12.0, "12 K colder"), (12.0, "12 K warmer"), (np.nan, "")]
)
def test_an_arm_of_another_warmth_is_doubted_where_the_twin_does_not_know_that(
    identified: Fit, score: Score, warmer: float, said: str
) -> None:
    drive = identified.dynamics.drive
    warm = np.tile(drive.temperature + warmer, (len(score.log), 1))
    log = replace(score.log, channels={**score.log.channels, "joint_temperatures": warm})
    knows = replace(drive, thermal=np.where(np.arange(6) < 5, -0.1, 0.0))
    fit = replace(identified, dynamics=replace(identified.dynamics, drive=knows))
    told = otherwise_warm(fit, [replace(score, log=log)])
    assert [said in why and "wrist 3" in why and "elbow" not in why for why in told] == (
        [True] * bool(said)
    )
