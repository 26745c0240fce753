"""A swing's amplitude, beside a slow motion and noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from realarm import with_current
from shop import Shop

from urdyn.diagnose import diagnose
from urdyn.diagnose.fast import ringing_line
from urdyn.diagnose.fast.lasting_line import CROWD, lasts, others
from urdyn.diagnose.fast.oscillation import GROWING, Oscillation, Ring
from urdyn.diagnose.fast.ringing_line import SEEN, WINDOWS, Line
from urdyn.diagnose.fast.swings import (
    SCATTER,
    amplitude,
    bridged,
    course,
    floor,
    going_on,
    growth,
    lines,
    neighbourhood,
    refined,
    spectrum,
)
from urdyn.diagnose.fast.weave import period, turns
from urdyn.diagnose.findings.ledger import entered, finding_of
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.residual.space import space
from urdyn.simulate import Trajectory, observe, typical_sensors

T = np.arange(90) / 100.0  # [s]


@pytest.mark.parametrize("frequency", [5.5, 8.0, 20.0])
def test_a_steady_swing_beside_a_slow_motion_has_one_amplitude(frequency: float) -> None:
    motion = 3.0 - 4.0 * T + 5.0 * T**3
    x = motion + 0.7 * np.sin(2.0 * np.pi * frequency * T + 0.4)
    assert np.allclose(course(x, T, frequency), 0.7, atol=1e-6)
    assert np.isclose(amplitude(x, T, frequency), 0.7)


@pytest.mark.parametrize("rate", [0.0, 0.3])
def test_a_swing_s_size_scatters_as_it_says_beside_what_the_gain_leaves_open(
    shop: Shop, rate: float
) -> None:
    """The median of a steady one, the end of a line through one that grows.

    Of 300 draws the scatter is known to 4 %; of 20 sizes a median's is 3 % less than of many.
    """
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)
    rng, long, told = np.random.default_rng(24), 0.25, []
    by_gain = ear.space.cov.diagonal()[ear.space.places["gain"]][3]
    ends = long * np.arange(1.0, 21.0)
    for _ in range(300):
        sizes = 50.0 * np.exp(rate * (ends - ends[-1]) + SCATTER * rng.standard_normal(20))
        course = tuple((float(t), float(size), long) for t, size in zip(ends, sizes, strict=True))
        event = ear._event(Ring(course=course, joint=3), 9.0, False)
        assert event.evidence["growing"] == (rate > 0.0)
        told.append((event.size, event.size_sd**2 - by_gain * event.size**2))
    size, own = np.transpose(told)
    assert own.mean() == pytest.approx(size.var(), rel=0.4)
    even = ear._event(Ring(course=tuple((t, 50.0, long) for t in ends), joint=3), 9.0, False)
    assert even.size_sd == pytest.approx(50.0 * np.sqrt(by_gain)) and by_gain > 0.0


def test_a_swing_of_which_a_few_sizes_rise_by_chance_is_not_said_to_grow(shop: Shop) -> None:
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)
    course = tuple((0.25 * k, size, 0.25) for k, size in enumerate((1.0, 1.6, 0.8, 1.7)))
    event = ear._event(Ring(course=course), 9.0, False)
    assert event.evidence["growth_per_s"] > GROWING
    assert not event.evidence["growing"] and event.size == pytest.approx(1.3)  # their median


@pytest.mark.parametrize("frequency", [13.0, pytest.param(22.0, marks=pytest.mark.slow), 36.8])
def test_a_swing_has_its_frequency_at_the_steps_of_its_recorder(
    shop: Shop, frequency: float
) -> None:
    """Steps of 10 and of 12 ms, as a real recorder has them, are 10 as a rule and 10.8 in mean."""
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)
    t = np.cumsum(np.resize([0.01, 0.012, 0.01, 0.01, 0.012], 90))
    sound = 0.05 * np.random.default_rng(23).standard_normal((3, 90, 6))
    usual, lines = ear.search.look(ear.init().usual[0], 0.9, t, sound)
    assert not lines
    rings = sound.copy()
    rings[:2, :, 3] += np.sin(2.0 * np.pi * frequency * t)[:, None].T
    [line] = ear.search.look(usual, 0.9, t, rings)[1]
    assert line.joint == 3 and np.allclose(line.sizes, 1.0, atol=0.1)
    assert np.isclose(line.frequency, frequency, atol=0.1)


def test_a_window_in_which_nothing_is_loud_is_not_looked_at_in_halves(
    shop: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nearly all are: what takes time is asked of the others."""
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)
    halves: list[object] = []
    monkeypatch.setattr(ringing_line, "lines", lambda *of: halves.append(of) or lines(*of))
    sound = 0.05 * np.random.default_rng(26).standard_normal((3, 90, 6))
    usual, _ = ear.search.look(ear.init().usual[0], 0.9, T, sound)
    assert not halves
    sound[:2, :, 3] += np.sin(2.0 * np.pi * 13.0 * T)
    assert len(ear.search.look(usual, 0.9, T, sound)[1]) == 1 and len(halves) == 2


@pytest.mark.parametrize(
    ("sways", "before", "told"), [(0.04, False, 4.5), (0.004, False, 13.5), (0.04, True, 13.5)]
)
def test_a_swing_below_the_band_is_told_by_what_friction_makes_of_it_as_what_it_is(
    shop: Shop, sways: float, before: bool, told: float
) -> None:
    """Friction turns over with the joint and makes a line; one that hardly sways rings at that.

    So does one that swayed as much before, by its program.
    """
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)
    noise = 0.002 * np.random.default_rng(24).standard_normal((3, 90, 6))
    slow, third = (np.sin(2.0 * np.pi * of * T) for of in (4.5, 13.5))
    motion, rings = noise.copy(), noise.copy()
    motion[1:, :, 2] += np.array([2.0 * slow, sways * slow])
    rings[..., 2] = motion[..., 2] + np.array([third, third, 0.008 * third])
    usual, lines = ear.search.look(ear.init().usual[0], 0.9, T, motion if before else noise)
    assert not lines
    [line] = ear.search.look(usual, 0.9, T, rings)[1]
    assert line.joint == 2 and np.isclose(line.frequency, told, atol=0.1)
    assert np.allclose(line.sizes, 2.0 if told < 5.0 else 1.0, atol=0.3)


@pytest.mark.parametrize("rate", [50.0, 100.0, 125.0, 500.0])
def test_a_line_beyond_the_searched_spectrum_or_at_half_the_rate_is_none(
    shop: Shop, rate: float
) -> None:
    """Mains hum of 60 Hz, and what alternates from row to row."""
    ear = Oscillation(space(shop.fit), 1.0 / rate, read_rules().fast.controller_instability)
    t = np.arange(round(0.9 * rate)) / rate
    sound = 0.05 * np.random.default_rng(25).standard_normal((3, len(t), 6))
    usual, _ = ear.search.look(ear.init().usual[0], 0.9, t, sound)
    f = ear.search._frequencies(t)

    def told(frequency: float) -> bool:
        rings = sound.copy()
        sizes = np.linspace(6.0, 1.0, 6)  # the loudest drive is not always the clearest
        rings[:2] += np.cos(2.0 * np.pi * frequency * t)[:, None] * sizes
        return bool(ear.search.look(usual, 0.9, t, rings)[1])

    outside = f[-1] + f[1] * np.arange(-0.5, 2.1, 0.25)
    assert told(f[-3])
    assert not any(told(frequency) for frequency in outside if frequency <= 0.5 * rate)


def test_noise_is_blamed_for_what_it_does_to_a_quarter_and_for_no_more(shop: Shop) -> None:
    """A swing that fades by a third passes beside noise that does as much, and not beside less."""
    ear = Oscillation(space(shop.fit), 0.002, read_rules().fast.controller_instability)
    sizes = np.array([1.2, 1.2, 0.8, 0.8])
    row = ear.space.reference.drive.gain * ear.space.noise
    for joint in range(6):
        noise = ear.search.scatter(joint, 1.0, 450)
        assert np.isclose(noise, min(row[joint] * np.sqrt(8.0 / 450.0), SEEN))
        assert not lasts(sizes, 1.0, noise)
    assert lasts(np.array([1.1, 1.1, 0.8, 0.8]), 0.95, SEEN)
    assert not lasts(np.array([1.1, 1.1, 0.8, 0.8]), 0.95, 0.0)


@pytest.mark.parametrize("frequency", [5.5, 8.0, 20.0])
def test_noise_is_in_a_quarters_amplitude_what_its_rows_leave_of_it(frequency: float) -> None:
    """sd sqrt(2 / rows) of each of two components; a slow motion that is unknown adds little."""
    rng = np.random.default_rng(11)
    found = np.array([course(rng.standard_normal(len(T)), T, frequency) for _ in range(400)])
    expected = 2.0 * 2.0 / (len(T) / 4.0)  # E of the squared amplitude
    assert np.all(np.mean(found**2, axis=0) < 1.35 * expected)
    assert np.all(np.mean(found**2, axis=0) > 0.8 * expected)


def test_a_motion_of_seconds_is_no_swing() -> None:
    """What is left of it is what quartics of a second do: terms of the fifth order."""
    t = np.arange(1800) / 500.0
    motion = 0.8 * np.sin(2.0 * np.pi * 0.4 * t) + 0.3 * np.cos(2.0 * np.pi * 0.9 * t)
    assert amplitude(motion, t, 8.0) < 1e-3
    assert course(motion, t, 8.0).max() < 3e-3
    assert np.isclose(amplitude(motion + 0.01 * np.sin(50.0 * t), t, 25.0 / np.pi), 0.01, rtol=0.05)


def test_a_frequency_is_found_between_bins() -> None:
    x = np.cos(2.0 * np.pi * 7.3 * T)
    assert abs(refined(x, T, 1.0 / 0.9 * 7, 1.0 / 0.9) - 7.3) < 0.25


@pytest.mark.parametrize("rate", [-0.1, 0.0, 0.1])
def test_how_fast_a_swing_grows_is_known_as_well_as_it_is_said_to_be(rate: float) -> None:
    """Beside white noise: a look every quarter of a second for five, as windows of .9 s have it."""
    rng, t = np.random.default_rng(13), np.arange(2500) / 500.0
    noise = 0.5
    swing = np.exp(rate * (t - t[-1])) * np.sin(2.0 * np.pi * 9.0 * t)
    found = []
    for _ in range(60):
        x, seen = swing + noise * rng.standard_normal(len(t)), ()
        for end in range(450, len(t) + 1, 125):
            part = slice(end - 450, end)
            seen = going_on(seen, t[part], course(x[part], t[part], 9.0))
        found.append(growth(seen, noise * np.sqrt(2.0 / 500.0)))
    size, rates, sd = np.array(found).T
    assert np.allclose(size.mean(), 1.0, atol=0.05)
    assert np.abs(rates - rate).max() < 4.0 * sd.max() < 0.12
    assert np.std(rates) < 1.35 * sd.mean()


def test_no_stretch_of_a_swing_is_counted_twice() -> None:
    """Windows overlap, and a long one has what short ones had."""
    seen = going_on((), T, np.full(4, 1.0))
    assert going_on(seen, T, np.full(4, 2.0)) == seen
    assert len(going_on(seen, T + 0.125, np.full(4, 1.0))) == len(seen)
    assert len(going_on(seen, T + 0.25, np.full(4, 1.0))) == len(seen) + 1
    longer = T[-1] - 3.6 + np.arange(360) / 100.0
    assert going_on(seen, longer, np.full(4, 1.0)) == seen


def test_noise_stands_out_of_its_floor_as_rarely_as_noise_does() -> None:
    """exp(-8) of bins at 8 times it, by an average of two; quiet neighbours alone: twelve times."""
    rng, shape = np.random.default_rng(12), (4000, 200, 1)
    power, usual = rng.exponential(size=shape), rng.gamma(2.0, 0.5, size=shape)
    out = power > 8.0 * floor(neighbourhood(power), usual)
    assert np.mean(out) < 1.5 * np.exp(-8.0)
    assert np.mean(power > 8.0 * neighbourhood(power)) > 8.0 * np.exp(-8.0)


@pytest.mark.parametrize("bins", [4, 9, 40])
def test_a_neighbourhood_is_the_median_of_bins_beside(bins: int) -> None:
    """From three to eight bins to either side; a spectrum goes on beyond its ends as mirrored."""
    power = np.random.default_rng(4).exponential(size=(2, bins, 3))
    mirrored = np.pad(power, [(0, 0), (8, 8), (0, 0)], mode="reflect")
    beside = [k for k in range(17) if abs(k - 8) > 2]
    each = [np.median(mirrored[:, at : at + 17][:, beside], axis=1) for at in range(bins)]
    assert np.allclose(neighbourhood(power) * np.log(2.0), np.stack(each, axis=1), rtol=1e-15)


def test_a_wrist_that_swings_rings_whatever_torque_that_takes(shop: Shop) -> None:
    fault = "controller_instability:joint=4,onset=4,rate=1.6,shape=step"
    found = shop.report(fault, seconds=8.0)
    assert [(f.kind, f.joint) for f in found] == [("controller_instability", 4)]
    assert found.findings[0].size < 0.7  # [N·m], that a torque would have to have


@pytest.mark.parametrize(
    ("rate", "seconds", "since", "hidden", "told"),
    [
        (500.0, 14.0, 6.0, 0.9, 3.6 + 3 * 0.25 + 1e-6),
        pytest.param(100.0, 45.0, 20.0, 3.6, 1.5 * 14.4, marks=pytest.mark.slow),
    ],
)
def test_a_swing_that_a_window_hardly_shows_is_told_by_a_longer_one(
    shop: Shop, rate: float, seconds: float, since: float, hidden: float, told: float
) -> None:
    """.6 of its noise: quarters of a second tell little of what lasts, those of four enough.

    At 100 Hz four seconds tell as little, and a minute of it would be learnt as usual.
    """
    log = shop.log(seconds=seconds, rate=rate)
    noise = np.sqrt(shop.fit.noise.power[2]) * shop.dynamics.drive.gain[2]
    swing = np.where(log.t > since, 0.6 * noise * np.sin(60.0 * log.t), 0.0)
    [found] = shop.disturbed(log, 2, swing)
    assert (found.kind, found.joint) == ("controller_instability", 2)
    assert hidden < found.alarm_s - since < told
    assert np.isclose(found.evidence["frequency_Hz"], 30.0 / np.pi, atol=0.1)


@pytest.mark.parametrize("joint", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_swing_in_a_runs_first_seconds_is_not_learnt_as_usual(shop: Shop, joint: int) -> None:
    """It is in the first spectrum of a joint already that a second fills."""
    log = shop.log(seconds=9.0, rate=500.0)
    since = log.t - log.t[0] - 1.2
    noise = np.sqrt(shop.fit.noise.power[joint]) * shop.dynamics.drive.gain[joint]
    swing = np.where(since > 0.0, 0.8 * noise * np.sin(71.0 * since), 0.0)
    [found] = shop.disturbed(log, joint, swing)
    assert (found.kind, found.joint) == ("controller_instability", joint)


def test_what_every_period_of_a_motion_makes_is_no_loop_that_rings(shop: Shop) -> None:
    """Teeth that meet on every way to and fro have lines at its multiples; a loop has one."""
    log = shop.log(seconds=10.0, rate=500.0)
    since, line = log.t - log.t[0] - 5.0, 2.0 * np.pi * 1.5
    noise = np.sqrt(shop.fit.noise.power[2]) * shop.dynamics.drive.gain[2]

    def told(*multiples: int) -> list[str]:
        swing = 0.6 * noise * sum(np.sin(line * k * since) for k in multiples)
        return [f.kind for f in shop.disturbed(log, 2, np.where(since > 0.0, swing, 0.0))]

    assert told(5, 8, 12, 15, 18, 22) == []
    assert told(12) == told(6, 12) == ["controller_instability"]


@pytest.mark.parametrize("rows", [112, 450, 1800])
def test_noise_is_no_crowd_of_lines_however_many_bins_it_has(rows: int) -> None:
    """Of windows of .9, 3.6 and 14.4 s at 125 Hz: 2 in a hundred, of 400 joints."""
    rng = np.random.default_rng(21)
    count = int(np.count_nonzero(np.fft.rfftfreq(rows, 0.008) <= 60.0))
    power = spectrum(rng.standard_normal((2, rows, 400)), count)
    ratio = (power / neighbourhood(power)).max(axis=0)
    crowded = [others(ratio[:, j], count / 3.0 + 0.37) >= CROWD[0] for j in range(400)]
    assert np.mean(crowded) < 0.06


@pytest.mark.parametrize("drift", [0.0, 0.04, 0.15])
def test_the_period_of_a_weave_is_known_beside_its_drift_and_a_loop_that_rings(
    drift: float,
) -> None:
    rng, t = np.random.default_rng(22), np.arange(500) / 125.0
    weave = 0.08 * np.cos(2.0 * np.pi * 1.7 * t) + drift * (1.0 + 0.1 * t)
    rings = 0.05 * np.sin(2.0 * np.pi * 12.0 * t) + 2e-3 * rng.standard_normal(len(t))
    assert np.isclose(1.0 / period(turns(t, weave + rings, 25)), 1.7, rtol=3e-3)
    assert not len(turns(t, drift + rings, 25))
    assert period(np.array([0.1, 0.3, 0.7, 0.9, 1.4, 1.6])) == np.inf


@pytest.mark.parametrize("rate", [125.0, pytest.param(1000.0, marks=pytest.mark.slow)])
def test_what_a_weave_makes_is_no_loop_that_rings_and_a_line_beside_its_multiples_is(
    shop: Shop, rate: float
) -> None:
    """A weld's weave: corners of its path, and friction that turns over, are at its multiples."""
    arm, n = shop.dynamics.arm, round(14.4 * rate)
    t, weave = np.arange(n) / rate, 2.0 * np.pi * 1.7
    rest, of = np.array([0.2, -1.4, 1.2, -0.8, 0.5, 0.1]), np.array([0.5, -0.3, 1.0, 0, 0, 0.7])
    sway = np.outer(0.012 * np.sin(weave * t), of)
    speed = np.outer(0.012 * weave * np.cos(weave * t), of)
    go = Trajectory(t, rest + sway, speed, -(weave**2) * sway)
    sensors = replace(typical_sensors(arm), cycle=0.001)
    log = observe(shop.dynamics, go, sensors, np.random.default_rng(4))
    friction, since = shop.dynamics.drive.coulomb[2], log.t - log.t[0] - 6.0

    def told(times: float, share: float) -> list[str]:
        swing = share * friction * np.sin(times * weave * since)
        return [f.kind for f in shop.disturbed(log, 2, np.where(since > 0.0, swing, 0.0))]

    assert told(5.0, 0.6) == told(6.0, 0.6) == []  # on the path, of any size
    assert told(6.5, 0.15) == []  # less than friction makes: 8 / (pi 6.5)
    assert told(6.5, 0.6) == ["controller_instability"]


@pytest.mark.parametrize("joint", [pytest.param(0, marks=pytest.mark.slow), 3])
def test_friction_that_turns_with_a_motion_to_and_fro_is_no_loop_that_rings(
    shop: Shop, joint: int
) -> None:
    """A square wave has lines at its odd multiples, and the model leaves nothing of them."""
    arm, n, rate = shop.dynamics.arm, 1500, 100.0
    t, line = np.arange(n) / rate, 2.0 * np.pi * 0.9
    of = np.eye(6)[joint]
    rest = np.array([0.2, -1.4, 1.2, -0.8, 0.5, 0.1])
    q, v, a = (
        np.outer(wave, of)
        for wave in (
            0.3 * np.sin(line * t),
            0.3 * line * np.cos(line * t),
            -0.3 * line**2 * np.sin(line * t),
        )
    )
    go = Trajectory(t, rest + q, v, a)
    log = observe(shop.dynamics, go, typical_sensors(arm), np.random.default_rng(4))
    assert not diagnose(shop.fit, log).findings


@pytest.mark.parametrize(
    ("ratio", "sizes", "looks"),
    [(30.0, [2.5, 2.6, 2.6, 2.7], 2), (30.0, [1.2, 2.1, 2.6, 2.7], 5), (15.1, [2.6] * 4, 5)],
)
def test_one_look_at_a_line_tells_nothing(
    shop: Shop, ratio: float, sizes: list[float], looks: int
) -> None:
    """Of real healthy motion, seen from any row on, one second in a thousand has such a line."""
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)
    state, told = ear.init(), 0
    for look in range(looks):
        assert not told
        line, t = Line(1, 6.4, ratio, np.array(sizes)), T + 0.125 * look
        state, events = ear._told(state, line, t, 0.9, known=True, doubted=False)
        told = len(events)
    assert told == 1


@pytest.mark.parametrize("ratio", [15.1, 30.0])
def test_a_line_that_most_looks_do_not_see_is_not_one_that_lasts(shop: Shop, ratio: float) -> None:
    """A move that begins briskly makes a line, and where it ends the like of it again."""
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)
    state = ear.init()
    for look in range(0, 30, 5):
        line, t = Line(1, 6.4, ratio, np.full(4, 2.6)), T + 0.125 * look
        state, events = ear._told(state, line, t, 0.9, known=True, doubted=False)
        assert not events


def test_a_swing_began_before_any_window_that_shows_it_throughout(shop: Shop) -> None:
    """A weak one may first show in a lucky second, long after it began."""
    ear = Oscillation(space(shop.fit), 0.01, read_rules().fast.controller_instability)

    def first(now: float) -> tuple[float, float]:
        """When the swing began, by windows that end then, the shortest first, and within what."""
        state = ear.init()
        for window in WINDOWS:
            t = now - window + np.arange(round(100.0 * window)) / 100.0
            line = Line(1, 6.4, 30.0, np.full(4, 2.6))
            state, _ = ear._told(state, line, t, window, known=True, doubted=False)
            now += 2.0
        return state.ring.first, state.ring.within

    assert np.allclose(first(20.0), (20.0 + 4.0 - 14.4, 0.25 * 14.4))


@pytest.mark.parametrize(("since", "within"), [(27.9, 3.6), (40.0, 0.2)])
def test_a_swing_found_again_after_a_silence_began_when_it_was_first_found(
    shop: Shop, since: float, within: float
) -> None:
    """Which is known no better, and no worse, by the window that finds it again."""
    where, rules = space(shop.fit), read_rules()
    evidence = {"frequency_Hz": 13.0, "amplitude_Nm": 1.5, "growing": False, "fading": False}
    swing = Event("controller_instability", 1, 13.0, 28.5, 1.5, evidence=evidence, within=3.6)
    book, _ = entered((), [finding_of(swing, (), where, rules)])
    again = replace(swing, onset=since, alarm=48.5, within=within)
    [found], _ = entered(book, [finding_of(again, book, where, rules)])
    assert (found.onset_s, found.alarm_s) == (13.0, 28.5)
    assert np.allclose(found.onset_interval_s, (9.4, 16.6)) and "stamp 13.0 s" in found.text


@pytest.mark.parametrize(
    ("since", "joint", "frequency"),
    [
        (4.07, 5, 17.0),
        (4.13, 4, 6.0),
        *(pytest.param(*of, marks=pytest.mark.slow) for of in ((4.0, 3, 9.0), (4.2, 3, 23.0))),
    ],
)
def test_a_swing_of_one_newton_metre_is_told_within_a_second_and_a_quarter(
    shop: Shop, since: float, joint: int, frequency: float
) -> None:
    """Whenever in a beat it begins, on joints whose noise is small beside it."""
    log = shop.log(seconds=7.0, rate=500.0)
    swing = np.sin(2.0 * np.pi * frequency * (log.t - log.t[0] - since))
    [found] = shop.disturbed(log, joint, np.where(log.t - log.t[0] > since, swing, 0.0))
    assert (found.kind, found.joint) == ("controller_instability", joint)
    assert found.alarm_s - log.t[0] - since < 1.25


@pytest.mark.parametrize(
    ("joint", "grows", "how", "severity"),
    [
        pytest.param(5, lambda s: 0.5 + 0.15 * s, "growing", "warning", marks=pytest.mark.slow),
        (2, lambda s: 4.0 + 1.2 * s, "growing", "critical"),
        pytest.param(4, lambda s: 1.0 + 0.0 * s, "steady", "warning", marks=pytest.mark.slow),
        (3, lambda s: 2.4 * np.exp(-0.1 * s), "fading", "warning"),
    ],
)
def test_a_swing_is_told_as_large_as_it_is_by_now_and_where_that_goes(
    shop: Shop, joint: int, grows, how: str, severity: str
) -> None:
    log = shop.log(seconds=12.0, rate=500.0)
    since = log.t - log.t[0] - 4.0
    size = grows(np.maximum(since, 0.0))
    swing = np.where(since > 0.0, size * np.sin(2.0 * np.pi * 14.0 * since), 0.0)
    [found] = shop.disturbed(log, joint, swing)
    assert (found.kind, found.joint, found.severity) == ("controller_instability", joint, severity)
    assert np.isclose(found.size, size[-1], rtol=0.15) and how in found.text
    assert abs(found.size - size[-1]) < 3.0 * found.size_sd < 0.3 * found.size
    assert found.alarm_s - log.t[0] < 4.0 + 1.75 and abs(found.onset_s - log.t[0] - 4.0) < 0.9


def test_a_drive_that_holds_its_joint_against_another_is_not_the_one_that_rings(
    shop: Shop,
) -> None:
    """It may have more to do than the one whose joint swings, and does not move its own."""
    how = {"seconds": 8.0, "rate": 100.0}
    log = shop.log("controller_instability:joint=3,onset=4,rate=2,shape=step", **how)
    moves = log.joint("actual_qd")[:, 3] - shop.log(**how).joint("actual_qd")[:, 3]
    [alone] = diagnose(shop.fit, log)
    reaction = 3.0 * alone.size * moves / np.abs(moves).max()
    [found] = shop.disturbed(log, 2, reaction)
    assert (alone.joint, found.joint) == (3, 3)


def test_a_row_that_is_missing_lies_between_those_beside_it() -> None:
    x = np.array([0.0, 1.0, np.nan, 3.0, np.nan, np.nan, 6.0, np.nan])[None, :, None]
    mended = bridged(x.copy())[0, :, 0]
    assert np.array_equal(mended[:4], [0.0, 1.0, 2.0, 3.0])
    assert np.isnan(mended[[4, 5, 7]]).all() and mended[6] == 6.0


def test_a_swing_that_goes_on_takes_no_more_back_of_what_others_told(shop: Shop) -> None:
    """It is told again and again while it lasts; the joint is not believed as long as that."""
    fault = "friction_increase:joint=0,onset=0,rate=0.6,shape=step"
    log = shop.log(fault, seconds=40.0)
    since = log.t - log.t[0] - 3.0
    swing = 6.0 * np.sin(2.0 * np.pi * 12.0 * since)
    told = [(f.kind, f.joint) for f in shop.disturbed(log, 3, np.where(since > 0.0, swing, 0.0))]
    assert sorted(told) == [("controller_instability", 3), ("friction_increase", 0)]


def test_a_loop_that_rings_while_a_sensor_is_silent_is_told_when_it_speaks(shop: Shop) -> None:
    log = shop.log(seconds=14.0)
    swing = 6.0 * np.sin(2.0 * np.pi * 12.0 * log.t) / shop.dynamics.drive.gain[2]
    current = log.joint("actual_current").copy()
    current[:, 2] += np.where(log.t > 6.0, swing, 0.0)
    current[(log.t > 5.0) & (log.t < 8.0), 0] = np.nan
    told = {f.kind: f for f in diagnose(shop.fit, with_current(log, current))}
    assert told.keys() == {"sensor_fault", "controller_instability"}
    assert told["controller_instability"].joint == 2
