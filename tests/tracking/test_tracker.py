"""A twin at work on virtual arms: honest where nothing changes, quick where something does."""

import numpy as np
import pytest
from realarm import with_current
from workshop import RATE, at_work, commissioned

from urdyn.estimate import EKF, UKF, ParticleFilter
from urdyn.model.consistency import is_consistent
from urdyn.signal import Sample, samples
from urdyn.tracking import QUICKER, Drift, Tracker, quantities


def tracked(fit, log, filter_, drift=None):
    """Readings of a whole log, and the quantities that their beliefs stand for."""
    tracker = Tracker(fit, filter_, float(np.median(np.diff(log.t))), drift)
    state, readings = tracker.init(), []
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        if reading is not None:
            readings.append(reading)
    return readings, quantities(fit, tracker.currents)


@pytest.mark.parametrize(
    "filter_", [EKF(), pytest.param(UKF(), marks=pytest.mark.slow)], ids=["ekf", "ukf"]
)
def test_a_healthy_arm_stays_what_it_is(filter_):
    dynamics, fit = commissioned(0)
    readings, physical = tracked(fit, at_work(dynamics, 0, 1, 14.0), filter_)
    assert not any(reading.widened for reading in readings)
    mean, sd = physical.of(readings[-1].belief)
    for field in ("coulomb", "viscous"):
        at = [physical.names.index(f"{j}.{field}") for j in dynamics.arm.joint_names]
        z = (mean[at] - getattr(dynamics.drive, field)) / sd[at]
        assert np.sum(z**2) < 22.5  # chi-square of six, once in a thousand
    told = [r.innovation for r in readings[200:] if r.innovation.measured]
    nis = np.array([innovation.nis / innovation.measured for innovation in told])
    # Six joints and some 1200 readings: the mean of chi-square over its degrees is known to 1.7 %,
    # and the noise's variance, as it is learnt, no better.
    assert abs(nis.mean() - 1.0) < 0.08
    each = np.nanmean([i.residual**2 / i.cov.diagonal() for i in told], axis=0)
    assert np.abs(each - 1.0).max() < 5.0 * np.sqrt(2.0 / len(told)), each
    assert (np.linalg.eigvalsh(readings[-1].belief.cov) > 0.0).all()


def test_a_cloud_of_one_opinion_goes_on_after_a_rest():
    """One particle, or copies of one, knows no covariance."""
    dynamics, fit = commissioned(0)
    rest = at_work(dynamics, 0, 1, 8.0, rate=20.0)
    readings, _ = tracked(fit, rest, ParticleFilter(1))
    widened = [reading.t for reading in readings if reading.widened]
    assert widened and widened[0] < readings[-20].t
    assert all(np.isfinite(reading.belief.mean).all() for reading in readings)


def test_friction_that_grows_is_followed_and_others_stay():
    dynamics, fit = commissioned(0)
    log = at_work(dynamics, 0, 1, 40.0, "friction_increase:joint=2,onset=10,rate=0.01", rate=50.0)
    # A third in half a minute is far more than an arm's wear, so it is told to be large.
    quick = Drift(friction=5e-3, rate_sd=1e-2, acceleration=1e-3)
    readings, physical = tracked(fit, log, EKF(), quick)
    mean, sd = physical.of(readings[-1].belief)
    at = [physical.names.index(f"{j}.coulomb") for j in dynamics.arm.joint_names]
    grown = dynamics.drive.coulomb * np.where(np.arange(6) == 2, 1.3, 1.0)
    assert abs(mean[at][2] / grown[2] - 1.0) < 0.05
    others = [0, 1, 3, 4, 5]
    z = (mean[at] - grown)[others] / sd[at][others]
    assert np.sum(z**2) < 25.0


@pytest.mark.parametrize(
    "filter_",
    [EKF(), pytest.param(QUICKER["simplified"], marks=pytest.mark.slow)],
    ids=["ekf", "simplified"],
)
def test_a_sensor_that_is_stuck_tells_of_nothing(filter_):
    """But for the fifth of a second in which nobody can know."""
    dynamics, fit = commissioned(0)
    log = at_work(dynamics, 0, 1, 20.0, rate=50.0)
    current = log.joint("actual_current").copy()
    current[500:, 2] = current[500, 2]
    (sound, physical), (stuck, _) = (
        tracked(fit, x, filter_) for x in (log, with_current(log, current))
    )
    assert not any(reading.widened for reading in stuck)
    at = [physical.names.index(f"{j}.coulomb") for j in dynamics.arm.joint_names]
    both = (physical.of(of[-1].belief) for of in (sound, stuck))
    (mean, sd), (other, doubt) = ((x[at], s[at]) for x, s in both)
    # What ten seconds more of a sound sensor told, and no more than a quarter of an sd besides.
    more = np.sqrt(np.maximum(doubt**2 - sd**2, 0.0))
    assert (np.abs(other - mean) < 0.25 * sd + 2.0 * np.minimum(more, sd)).all()
    told = [np.isfinite(reading.innovation.residual[2]) for reading in stuck[520:]]
    assert not any(told)


def test_a_payload_that_is_picked_up_is_weighed():
    dynamics, fit = commissioned(0)
    log = at_work(dynamics, 0, 2, 20.0, "payload_change:mass=2.5,com=0/0/0.08,onset=10")
    readings, physical = tracked(fit, log, EKF())
    changes = [reading.t for reading in readings if reading.widened]
    assert changes and 10.0 < changes[0] < 11.5
    at = physical.names.index("payload.mass")
    later = next(reading for reading in readings if reading.t > 15.0)
    for reading in (later, readings[-1]):
        mean, sd = physical.of(reading.belief)
        assert abs(mean[at] - 2.5) < max(0.03 * 2.5, 3.0 * sd[at])


def broken(log):
    """What may befall a stream: bursts of NaN, wild values, a gap, and a controller that restarts.

    Its clock begins at zero again; the arm is the same.
    """
    names = ("actual_q", "actual_qd", "actual_current", "joint_temperatures")
    values = {name: log.joint(name).copy() for name in names}
    values["actual_current"][300:340] = np.nan
    values["actual_current"][500] = 1e6
    values["actual_current"][520, 3] = -np.inf
    values["actual_q"][560] = 400.0
    values["actual_qd"][600, 2] = np.nan
    values["joint_temperatures"][640:700] = np.nan
    t = np.where(np.arange(len(log)) < 950, log.t, log.t - log.t[950])
    for k in (*range(700), *range(900, len(log))):
        yield Sample(float(t[k]), *(values[name][k] for name in names))


@pytest.mark.parametrize("filter_", [EKF(), QUICKER["realtime"]], ids=["full", "realtime"])
def test_gaps_and_nonsense_do_not_derail_it(filter_):
    dynamics, fit = commissioned(0)
    tracker = Tracker(fit, filter_, 1.0 / RATE)
    state, physical = tracker.init(), quantities(fit, tracker.currents)
    for k, sample in enumerate(broken(at_work(dynamics, 0, 3, 16.0))):
        state, reading = tracker.step(state, sample)
        if reading is not None and k % 20 == 0:
            assert np.linalg.eigvalsh(reading.belief.cov)[0] > 0.0
            assert is_consistent(physical.links(reading.belief)).all()
            assert physical.payload(reading.belief)[0] >= 0.0
    mean, sd = physical.of(reading.belief)
    assert np.isfinite(mean).all() and (sd > 0.0).all()
    assert state.widened == -np.inf and state.rest.left == np.inf
    for field in ("coulomb", "viscous"):
        at = [physical.names.index(f"{j}.{field}") for j in dynamics.arm.joint_names]
        z = (mean[at] - getattr(dynamics.drive, field)) / sd[at]
        assert np.sum(z**2) < 25.0


@pytest.mark.slow
def test_intervals_hold_after_a_minute():
    """Nine in ten; so few arms tell it to three standard deviations of a binomial."""
    z = {name: [] for name in ("coulomb", "viscous", "structural", "mass")}
    nis = []
    for seed in range(4):
        dynamics, fit = commissioned(seed)
        readings, physical = tracked(fit, at_work(dynamics, seed, 1, 60.0), EKF())
        mean, sd = physical.of(readings[-1].belief)
        truth = {f: getattr(dynamics.drive, f) for f in ("coulomb", "viscous", "structural")}
        truth["mass"] = dynamics.inertials[:, 0]
        for name, actual in truth.items():
            owners = dynamics.arm.link_names if name == "mass" else dynamics.arm.joint_names
            at = [physical.names.index(f"{owner}.{name}") for owner in owners]
            z[name] += ((mean[at] - actual) / sd[at]).tolist()
        told = [r.innovation for r in readings[500:]]
        nis.append(sum(i.nis for i in told) / sum(i.measured for i in told))
    for name, scores in z.items():
        inside = np.abs(scores) < 1.645
        print(name, "covered", inside.mean())
        assert inside.mean() > 0.9 - 3.0 * np.sqrt(0.09 / inside.size), name
    # The noise's variance is learnt to a percent or two, in so many samples.
    assert np.abs(np.array(nis) - 1.0).max() < 0.08, nis


def test_parameters_may_move_every_few_samples_only(monkeypatch):
    dynamics, fit = commissioned(0)
    log, found = at_work(dynamics, 0, 1, 10.0), []
    for stride in (0.0, 0.075):  # [s] every sample, every eighth
        monkeypatch.setattr("urdyn.tracking.step.tracker.STRIDE", stride)
        readings, physical = tracked(fit, log, EKF())
        spans = [reading.inputs.span for reading in readings]
        assert sum(spans) == pytest.approx(readings[-1].t - readings[0].t, abs=0.08)
        assert np.mean(np.array(spans) > 0.0) == pytest.approx(0.125 if stride else 1.0, abs=0.01)
        found.append(physical.of(readings[-1].belief))
    (mean, sd), (other, other_sd) = found
    known = sd > 0.0
    # What is held back is the noise of less than a stride: of the whole run's, 8 in a thousand.
    np.testing.assert_allclose(other_sd[known], sd[known], rtol=8e-3)
    assert np.abs((other - mean)[known] / sd[known]).max() < 0.05


@pytest.mark.parametrize("filter_", [UKF(), QUICKER["realtime"]], ids=["full", "realtime"])
def test_what_breaks_joints_away_is_no_load(filter_):
    """As recorded as a program begins: for a degree or two, torques that no rigid body makes."""
    dynamics, fit = commissioned(0)
    log = at_work(dynamics, 0, 1, 4.0)
    way = np.cumsum(np.abs(np.diff(log.joint("actual_q"), axis=0, prepend=0.0)), axis=0)
    stiff = np.where(way - way[0] < 0.05, 57.0, 0.0) / dynamics.drive.gain
    snaps = with_current(log, log.joint("actual_current") + stiff)
    (sound, physical), (stuck, _) = (tracked(fit, x, filter_) for x in (log, snaps))
    at = physical.names.index("payload.mass")
    for reading in stuck:
        mean, sd = physical.of(reading.belief)
        assert abs(mean[at]) < 4.0 * sd[at]
    np.testing.assert_allclose(stuck[-1].belief.mean, sound[-1].belief.mean, atol=1e-9)
