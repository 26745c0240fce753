"""Scores of a model on logs that it was not fitted to."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt
from scipy.stats import binom

from urdyn.cli.verdict import verdict
from urdyn.diagnose import diagnose
from urdyn.errors import UrdynError
from urdyn.identify import Fit, Noise, identify, validate
from urdyn.identify.enough import MIN_ROWS
from urdyn.identify.scoring import FLOOR_BAND, interval, noise_floor
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import KAPPA, KAPPA_SD
from urdyn.report.identify.doubts import another
from urdyn.report.identify.summary import validated
from urdyn.signal import condition
from urdyn.simulate import (
    Sensors,
    fourier,
    observe,
    perfect_sensors,
    point_to_point,
    typical_sensors,
    virtual_arm,
)
from urdyn.types import NORMAL90, STANDSTILL, Array, Gaussian, Log, Mask, Motion

CHANCE = 1e-3


@pytest.fixture(scope="module")
def truth(identified: Fit) -> Dynamics:
    """Another arm than the one that was identified; its terms and drives are known exactly."""
    return virtual_arm(identified.dynamics.arm, 5)


@pytest.fixture(scope="module")
def white(truth: Dynamics) -> Sensors:
    """Noise on the current alone."""
    noise = typical_sensors(truth.arm).current_noise
    return replace(perfect_sensors(truth.arm), current_noise=noise)


@pytest.fixture(scope="module")
def all_knowing(identified: Fit, truth: Dynamics, white: Sensors) -> Fit:
    """The fit of somebody who was told the arm and its noise."""
    sd = white.current_noise
    return replace(
        identified,
        dynamics=truth,
        belief=certain(identified),
        noise=Noise(sd, sd, np.full(6, 1e9), np.zeros((6, 0))),
    )


def certain(fit: Fit) -> Gaussian:
    """Its belief, of somebody who knows all parameters."""
    return Gaussian(fit.belief.mean, np.zeros_like(fit.belief.cov))


def observed(truth: Dynamics, sensors: Sensors) -> Log:
    rng = np.random.default_rng(0)
    return observe(truth, fourier(truth.arm, 20.0, 500.0, rng), sensors, rng)


@pytest.fixture(scope="module")
def noisy(truth: Dynamics, white: Sensors) -> Log:
    return observed(truth, white)


def holed(log: Log, channel: str, rows: slice) -> Log:
    """A log that lost some rows of a channel."""
    values = log.channels[channel].copy()
    values[rows] = np.nan
    return replace(log, channels=dict(log.channels) | {channel: values})


def test_the_truth_predicts_a_current_without_noise(all_knowing: Fit, truth: Dynamics) -> None:
    score = validate(all_knowing, observed(truth, perfect_sensors(truth.arm)))
    assert score.rre_percent.max() < 0.01  # what is left is that of polynomials through q and v


def test_what_the_truth_leaves_is_the_noise(all_knowing: Fit, noisy: Log, white: Sensors) -> None:
    score = validate(all_knowing, noisy)
    scatter = 4.0 / np.sqrt(2.0 * len(noisy))
    np.testing.assert_allclose(score.rmse, white.current_noise, rtol=scatter)
    size = np.sqrt(np.mean(noisy.channels["actual_current"] ** 2, axis=0))
    np.testing.assert_allclose(score.rre_percent, 100.0 * score.rmse / size, rtol=1e-12)


def test_nine_samples_of_ten_lie_in_the_interval_of_the_truth(all_knowing: Fit, noisy: Log) -> None:
    score = validate(all_knowing, noisy)
    rows = score.moves.sum(axis=0)
    low, high = binom.interval(1.0 - CHANCE, rows, 0.9)
    inside = rows * score.coverage90
    assert ((inside >= low) & (inside <= high)).all(), score.coverage90


def test_what_joints_did_in_gaps_is_no_fault_of_the_interval(
    all_knowing: Fit, noisy: Log, white: Sensors
) -> None:
    """Of the truth nine of ten lie in it once a joint has slid since, as in a whole log."""
    kept = np.flatnonzero(np.arange(len(noisy)) % 600 < 200)
    torn = replace(noisy, t=noisy.t[kept], channels={n: x[kept] for n, x in noisy.channels.items()})
    score = validate(all_knowing, torn)
    rows = score.moves.sum(axis=0)
    assert (rows > 0.5 * validate(all_knowing, noisy).moves[kept].sum(axis=0)).all()
    low, high = binom.interval(1.0 - CHANCE, rows, 0.9)
    inside = rows * score.coverage90
    assert ((inside >= low) & (inside <= high)).all(), score.coverage90


@pytest.fixture(scope="module")
def gripped(truth: Dynamics, white: Sensors) -> tuple[Log, Mask]:
    """Work with rests, in which stiction holds by as much as Coulomb's torque; and which rows."""
    rng = np.random.default_rng(3)
    log = observe(truth, point_to_point(truth.arm, 20.0, 500.0, rng, dwell=1.0), white, rng)
    rests = np.abs(log.joint("actual_qd")) < STANDSTILL
    grip = truth.drive.coulomb / truth.drive.gain * rng.choice([-1.0, 1.0], rests.shape)
    current = log.joint("actual_current") + grip * rests
    return replace(log, channels={**log.channels, "actual_current": current}), rests


def test_what_stiction_draws_is_no_fault_of_the_interval(
    all_knowing: Fit, gripped: tuple[Log, Mask], white: Sensors
) -> None:
    """Of the truth nine samples of ten lie in it, however long its joints stand."""
    log, rests = gripped
    score = validate(all_knowing, log)
    np.testing.assert_array_equal(score.moves, ~rests)
    assert (score.standing > 0.2).all()
    np.testing.assert_allclose(score.standing, rests.mean(axis=0))
    rows = score.moves.sum(axis=0)
    low, high = binom.interval(1.0 - CHANCE, rows, 0.9)
    inside = rows * score.coverage90
    assert ((inside >= low) & (inside <= high)).all(), score.coverage90


def test_the_error_while_moving_is_that_of_the_rows_that_move(
    all_knowing: Fit, gripped: tuple[Log, Mask], white: Sensors
) -> None:
    log, rests = gripped
    score = validate(all_knowing, log)
    size = np.sqrt(np.nanmean(np.where(rests, np.nan, log.joint("actual_current")) ** 2, axis=0))
    scatter = 4.0 / np.sqrt(2.0 * score.moves.sum(axis=0).min())
    wanted = 100.0 * white.current_noise / size
    np.testing.assert_allclose(score.moving_rre_percent, wanted, rtol=scatter)
    assert (score.moving_rre_percent < score.rre_percent).all()


def test_a_joint_that_never_moves_has_no_interval_to_be_judged_by(
    all_knowing: Fit, gripped: tuple[Log, Mask]
) -> None:
    log, rests = gripped
    still = np.broadcast_to(log.joint("actual_q")[:1], rests.shape)
    channels = {**log.channels, "actual_q": still, "actual_qd": np.zeros(rests.shape)}
    score = validate(all_knowing, replace(log, channels=channels))
    assert np.isnan([score.coverage90, score.moving_rre_percent]).all()
    assert (score.standing == 1.0).all() and np.isfinite(score.rre_percent).all()
    assert not another(all_knowing, [score])  # nothing was shown that could be doubted
    assert "Joints stood in up to 100 % of the rows" in verdict(all_knowing, [score])


@pytest.mark.parametrize("dof", [4.5, 10.0, 1e9])
def test_the_interval_holds_its_share_of_noise_with_tails(
    dof: float, identified: Fit, motion: Motion
) -> None:
    rows, one = 40_000, np.ones(6)
    noise, sure = Noise(one, one, dof * one, np.zeros((6, 0))), certain(identified)
    fit = replace(identified, noise=noise, belief=sure)
    rng = np.random.default_rng(1)
    unit = rng.standard_t(dof, rows) * np.sqrt((dof - 2.0) / dof)  # sd 1
    low, high = binom.interval(1.0 - CHANCE, rows, 0.9)
    assert low <= np.sum(np.abs(unit) <= interval(fit, motion.slice(0, 1))[0, 0]) <= high


@pytest.mark.parametrize("name", ["coulomb", "viscous", "gain", "rotor_inertia"])
def test_the_interval_has_in_it_what_is_not_known_of_a_parameter(
    name: str, identified: Fit, all_knowing: Fit, motion: Motion
) -> None:
    """As far as it moves the predicted current, by finite differences of its logarithm."""
    here, part, step, sd = identified.dynamics, motion.slice(0, 200), 1e-5, 0.3
    at, cov = identified.names.index(f"elbow_joint.{name}"), certain(identified).cov.copy()
    cov[at, at] = sd**2
    belief = Gaussian(identified.belief.mean, cov)
    fit = replace(identified, noise=all_knowing.noise, belief=belief)
    more = getattr(here.drive, name) * np.where(np.arange(6) == 2, np.exp(step), 1.0)
    other = replace(here, drive=replace(here.drive, **{name: more}))
    slope = (other.current(part) - here.current(part)) / step
    expected = NORMAL90 * np.hypot(fit.noise.sd, sd * slope)
    np.testing.assert_allclose(interval(fit, part), expected, atol=1e-3)


def test_a_warmer_joint_is_predicted_with_the_usual_effect_of_warmth(
    all_knowing: Fit, noisy: Log
) -> None:
    """Where the twin does not know its own, and where temperatures were measured."""
    drive = all_knowing.dynamics.drive
    knows = np.arange(6) == 1
    drive = replace(drive, thermal=np.where(knows, -0.1, 0.0))
    fit = replace(all_knowing, dynamics=replace(all_knowing.dynamics, drive=drive))
    warm = np.tile(drive.temperature + 12.0, (len(noisy), 1))
    warm[:, 5] = np.nan
    log = replace(noisy, channels={**noisy.channels, "joint_temperatures": warm})
    motion, usual = condition(log), np.where(knows, -0.1, -KAPPA * drive.viscous)
    due = replace(fit.dynamics, drive=replace(drive, thermal=usual)).current(motion)
    np.testing.assert_allclose(validate(fit, log).predicted, due, atol=1e-9)
    plain = fit.dynamics.current(motion)
    unsure = NORMAL90 * np.hypot(fit.noise.sd, KAPPA_SD / KAPPA * np.where(knows, 0.0, due - plain))
    np.testing.assert_allclose(interval(fit, motion), unsure, rtol=1e-3)


@pytest.mark.parametrize("rate", [100.0, 125.0, 500.0])
def test_the_floor_of_white_noise_is_its_share_above_the_band(rate: float) -> None:
    """sd sqrt(1 - band / Nyquist); the filter of order 4, run twice, cuts at 1.1545 of its band:

    ∫ 1 - (x⁸ / (1 + x⁸))² dx = 2 G - 7/8 G,    G = (pi/8) / sin(pi/8)
    """
    rows, sd = 50_000, 0.2
    e = sd * np.random.default_rng(2).standard_normal((rows, 2))
    edge = 9.0 / 8.0 * (np.pi / 8.0) / np.sin(np.pi / 8.0)
    wanted = sd * np.sqrt(1.0 - edge * FLOOR_BAND / (rate / 2.0))
    floor = noise_floor(np.arange(rows) / rate, e)
    np.testing.assert_allclose(floor, wanted, rtol=4.0 / np.sqrt(2.0 * rows))


def test_what_a_joint_lacks_and_what_passed_in_a_gap_is_no_floor() -> None:
    t = np.arange(3000) / 100.0
    e = np.random.default_rng(3).standard_normal((len(t), 3))
    whole, stepped = noise_floor(t, e), e + 60.0 * (t > 15.0)[:, None]
    stepped[:, 2] = np.nan
    apart = np.abs(t - 15.0) > 5.0
    floor = noise_floor(t[apart], stepped[apart])
    chance = 4.0 / np.sqrt(2.0 * np.count_nonzero(apart))
    np.testing.assert_allclose(floor[:2], whole[:2], rtol=chance)
    assert np.isnan(floor[2])
    holes = np.where(np.arange(len(t))[:, None] % 40 == 7, np.nan, e)
    np.testing.assert_allclose(noise_floor(t, holes), whole, rtol=chance)


@pytest.mark.parametrize(("rate", "rows"), [(20.0, 5000), (500.0, 100)])
def test_who_samples_too_little_is_told_no_floor(rate: float, rows: int) -> None:
    assert np.isnan(noise_floor(np.arange(rows) / rate, np.ones((rows, 6)))).all()


@pytest.mark.parametrize("channel", ["actual_current", "actual_q", "target_current"])
def test_rows_that_nobody_measured_count_for_nothing(
    channel: str, all_knowing: Fit, noisy: Log
) -> None:
    """A score of the first half is that of a log whose second half lost a channel."""
    half = len(noisy) // 2
    score = validate(all_knowing, holed(noisy, channel, slice(half, None)))
    alone = validate(all_knowing, noisy.slice(0, half))
    percent = "target_rre_percent" if channel == "target_current" else "rre_percent"
    wanted: Array = getattr(alone, percent)
    # Polynomials through velocities reach a few rows into the hole of the angles.
    np.testing.assert_allclose(getattr(score, percent), wanted, rtol=20 / half)
    if channel == "actual_current":
        np.testing.assert_allclose(score.floor_percent, alone.floor_percent, rtol=1e-12)


def test_a_current_that_no_motor_draws_counts_for_nothing_and_is_told(
    all_knowing: Fit, noisy: Log
) -> None:
    current = noisy.joint("actual_current").copy()
    current[100:103, 2] = -500.0
    wild = replace(noisy, channels={**noisy.channels, "actual_current": current})
    score, sound = validate(all_knowing, wild), validate(all_knowing, noisy)
    np.testing.assert_allclose(score.rre_percent, sound.rre_percent, rtol=3e-3)
    assert [*map(str, score.log.defects)] == ["3 x current that no motor draws (left out)"]
    assert not sound.log.defects


def test_an_encoder_that_is_stuck_counts_for_nothing_and_is_told(
    all_knowing: Fit, noisy: Log
) -> None:
    """Without a word the report would praise a model for a log of which it saw a part."""
    q = noisy.joint("actual_q").copy()
    q[100:200, 1] = q[100, 1]
    ill = replace(noisy, channels={**noisy.channels, "actual_q": q})
    score, sound = validate(all_knowing, ill), validate(all_knowing, noisy)
    np.testing.assert_allclose(score.rre_percent, sound.rre_percent, rtol=0.05)
    (told,) = score.log.defects
    assert told.kind == "angle or velocity that is the same while its joint moves"
    assert 80 < told.count <= 100


def test_a_channel_that_was_not_recorded_has_no_score(all_knowing: Fit, noisy: Log) -> None:
    kept = {name: noisy.channels[name] for name in ("actual_q", "actual_qd", "actual_current")}
    score = validate(all_knowing, Log(noisy.t, kept))
    assert np.isnan(score.target_rre_percent).all() and np.isfinite(score.rre_percent).all()


def test_a_few_rows_with_a_current_are_no_score(all_knowing: Fit, noisy: Log) -> None:
    few = slice(MIN_ROWS - 1, None)
    with pytest.raises(UrdynError, match="199 rows with a current are too few; record at least"):
        validate(all_knowing, holed(noisy, "actual_current", few))


def test_a_log_without_currents_is_told_so(all_knowing: Fit, noisy: Log) -> None:
    kept = {name: noisy.channels[name] for name in ("actual_q", "actual_qd")}
    said = "no channel actual_current; there is actual_q, actual_qd: name the columns or record it"
    with pytest.raises(UrdynError, match=said):
        validate(all_knowing, Log(noisy.t, kept))


def test_what_a_filter_left_is_no_floor_of_a_sensor(all_knowing: Fit, noisy: Log) -> None:
    low_pass = butter(8, 3.0, fs=1.0 / np.median(np.diff(noisy.t)), output="sos")
    through = sosfiltfilt(low_pass, noisy.joint("actual_current"), axis=0)
    filtered = replace(noisy, channels={**noisy.channels, "actual_current": through})
    scores = [validate(all_knowing, each) for each in (noisy, filtered)]
    assert np.isfinite(scores[0].floor_percent).all() and np.isnan(scores[1].floor_percent).all()
    assert np.isfinite(scores[1].rre_percent).all()


@pytest.mark.filterwarnings("error")
def test_a_current_that_is_nothing_has_no_share(all_knowing: Fit, noisy: Log) -> None:
    dead = {**noisy.channels, "actual_current": np.zeros_like(noisy.joint("actual_current"))}
    score = validate(all_knowing, Log(noisy.t, dead))
    assert np.isnan([score.rre_percent, score.floor_percent]).all() and (score.rmse > 0.0).all()


def test_scores_are_json_with_null_where_there_is_none(all_knowing: Fit, noisy: Log) -> None:
    kept = {name: noisy.channels[name] for name in ("actual_q", "actual_qd", "actual_current")}
    score = validate(all_knowing, Log(noisy.t, kept))
    text = json.dumps(validated([score]), allow_nan=False)
    (log,) = json.loads(text)["logs"]
    assert log["target_current_rre_percent"] is None and log["n"] == len(noisy)
    assert log["rre_percent"] == pytest.approx(score.rre_percent.tolist())
    assert log["standing"] == pytest.approx(score.standing.tolist())
    assert log["moving_rre_percent"] == pytest.approx(score.moving_rre_percent.tolist())


@pytest.mark.parametrize(
    ("channel", "of", "said"),
    [
        ("actual_q", np.rad2deg, "angles are to be in rad"),
        ("actual_current", lambda amperes: 1e3 * amperes, "currents are to be in A"),
        ("actual_current", lambda amperes: amperes[:, :5], "has 5 joints"),
    ],
)
def test_a_log_in_other_units_or_of_another_arm_is_no_log_of_this_one(
    channel, of, said, identified: Fit, truth: Dynamics, noisy: Log
) -> None:
    """Validated, identified or diagnosed: it is said what is wrong."""
    channels = dict(noisy.channels)
    channels[channel] = of(channels[channel])
    if "joints" in said:
        channels = {name: values[:, :5] for name, values in channels.items() if values.ndim == 2}
    log = Log(noisy.t, channels)
    for judge in (validate, diagnose, lambda fit, log: identify(fit.dynamics.arm, condition(log))):
        with pytest.raises(UrdynError, match=said):
            judge(identified, log)


def test_currents_of_the_opposite_sign_are_doubted_as_that(all_knowing: Fit, noisy: Log) -> None:
    reversed_ = {**noisy.channels, "actual_current": -noisy.joint("actual_current")}
    doubt = another(all_knowing, [validate(all_knowing, Log(noisy.t, reversed_))])
    assert doubt.startswith("In 6 of 6 joints") and doubt.endswith("or of the opposite sign")
    assert "worked in contact" in doubt


def test_one_joint_whose_columns_are_anothers_is_doubted_by_name(
    all_knowing: Fit, noisy: Log
) -> None:
    assert not another(all_knowing, [validate(all_knowing, noisy)])
    current = noisy.joint("actual_current").copy()
    current[:, 2] = current[:, 1]
    log = Log(noisy.t, {**noisy.channels, "actual_current": current})
    doubt = another(all_knowing, [validate(all_knowing, log)])
    assert doubt.startswith("In elbow intervals") and "columns are another joint's" in doubt
    assert "or something pushed or pulled at the arm" in doubt
