"""What is asked, what is known before, and what a motion is expected to add to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.identify import identify
from urdyn.identify.excite import Ask, excite, expected, question
from urdyn.identify.excite.criterion import judge
from urdyn.identify.excite.interest import interesting
from urdyn.identify.excite.rating import scale
from urdyn.identify.unknowns import PayloadPrior
from urdyn.model.arm import load_arm
from urdyn.signal import condition
from urdyn.simulate import Payload, fourier, observe, real_sensors, virtual_arm
from urdyn.simulate.trajectory import Trajectory


def names_of(asked, phrases):
    names = asked.unknowns.names
    return {names[k] for k in interesting(names, phrases)}


def test_interests_are_found_by_what_people_call_them(ur10e):
    asked = question(ur10e, Payload(2.0))
    assert names_of(asked, ["elbow friction"]) == {
        "elbow_joint.coulomb",
        "elbow_joint.viscous",
        "elbow_joint.structural",
    }
    assert names_of(asked, ["Payload mass", "wrist 1 gain"]) == {
        "payload_0.alpha",
        "wrist_1_joint.gain",
    }
    assert len(names_of(asked, ["gains"])) == 6
    assert len(names_of(asked, ["payload"])) == 10


@pytest.mark.parametrize(
    ("phrase", "hint"),
    [
        ("elbo friction", "did you mean 'elbow'"),
        ("elbow mass", "elbow has only friction"),
        ("", "known are"),
    ],
)
def test_an_interest_that_nobody_knows_is_told(ur10e, phrase, hint):
    with pytest.raises(InputError, match=hint):
        interesting(question(ur10e).unknowns.names, [phrase])


def test_a_payload_is_of_interest_however_it_is_written(ur10e):
    asked = question(ur10e, Payload(2.0), None, ["Payload mass"])
    assert asked.unknowns.payloads == (PayloadPrior(None),)


def test_a_payload_of_interest_is_unknown_until_the_run(ur10e):
    known, sought = question(ur10e, Payload(2.0)), question(ur10e, Payload(2.0), None, ["payload"])
    run = fourier(ur10e, 8.0, 50.0, np.random.default_rng(0))
    spreads = []
    for asked in (known, sought):
        told = expected(asked, run)
        k = told.parameters.names.index("payload_0.mass")
        spreads.append((told.before[k], told.after[k]))
    assert spreads[0][0] < 1e-3 * spreads[1][0]
    assert spreads[1][1] < 0.2 * spreads[1][0]


def test_a_run_never_takes_knowledge_away(found):
    told = found.expected
    assert (told.after <= told.before * (1.0 + 1e-9)).all()
    gained = dict(zip(told.parameters.names, told.gained(), strict=True))
    assert gained["elbow_joint.coulomb"] > 0.9
    # No motion of a fixed base tells the first link's mass.
    assert gained["shoulder_link.mass"] < 0.01


def test_the_next_run_begins_where_the_twin_stands(identified):
    arm = identified.dynamics.arm
    run = fourier(arm, 8.0, 100.0, np.random.default_rng(0))
    told = expected(question(arm, twin=identified), run)
    for joint in arm.joint_names:
        k = told.parameters.names.index(f"{joint}.coulomb")
        np.testing.assert_allclose(told.before[k], identified.spread(f"{joint}.coulomb"), rtol=1e-6)
        assert told.after[k] < told.before[k]


def test_rows_closer_than_those_of_the_twin_tell_no_more(identified):
    """Its noise is known at 100 Hz alone: five rows in the place of one are not five times it."""
    arm = identified.dynamics.arm
    close = fourier(arm, 8.0, 500.0, np.random.default_rng(0))
    far = Trajectory(*(x[::5] for x in (close.t, close.q, close.v, close.a)))
    asked = question(arm, twin=identified, rate=500.0)
    assert asked.rate == pytest.approx(100.0)
    sds = [expected(asked, run).after for run in (close, far)]
    np.testing.assert_allclose(*sds, rtol=1e-3)


@pytest.mark.parametrize("rate", [50.0, 125.0, 500.0])
def test_without_a_twin_noise_has_the_colour_of_recordings(ur10e, rate):
    noise, sensors = question(ur10e, rate=rate).noise, real_sensors(ur10e)
    lags = np.arange(9) / rate
    told = noise.autocovariance(8, 1.0 / rate) + np.outer(noise.keep ** np.arange(9), noise.slow**2)
    true = sum(band.correlation(lags) for band in sensors.bands)
    true[0] = 1.0
    np.testing.assert_allclose(told, true * sensors.current_noise**2, atol=1e-9)


def test_what_is_known_is_not_asked_again(identified):
    """Beside a twin, a run tells less than beside nothing, and what it adds is what is left."""
    arm = identified.dynamics.arm
    run = fourier(arm, 8.0, 100.0, np.random.default_rng(0))
    gains = []
    for twin in (None, identified):
        asked = question(arm, twin=twin, about=identified.dynamics)
        B = question(arm, twin=identified).asked if twin else asked.asked
        before = judge("D", asked.known, B)[0]
        gains.append(judge("D", expected(asked, run).information, B)[0] - before)
    assert 0.0 < gains[1] < 0.5 * gains[0]


def test_a_search_for_one_thing_tells_more_of_it_than_a_search_for_all(ur10e, found):
    ask = replace(found.ask, interest=("shoulder pan friction",), criterion="A")
    narrow = excite(ur10e, ask)
    B = narrow.question.asked
    spread = [judge("A", one.expected.information, B)[0] for one in (narrow, found)]
    assert spread[0] > spread[1]


@pytest.mark.slow
def test_the_same_seed_gives_the_same_motion_whatever_the_processes(ur10e, found):
    again = excite(ur10e, replace(found.ask, restarts=2), processes=2)
    alone = excite(ur10e, replace(found.ask, restarts=2))
    assert again.trajectory.q.tobytes() == alone.trajectory.q.tobytes()
    assert again.values == alone.values
    assert again.values[0] == found.values[0]


def test_a_motion_that_is_found_beats_random_ones(found):
    rng, ruler = np.random.default_rng(7), scale(found.question)
    t = np.linspace(0.0, found.path.lasting, 60, endpoint=False)
    ours = ruler.rate(*found.path.at(t), 1e3)
    from urdyn.simulate.fourier import draw, series_within

    for _ in range(100):
        shape = draw(6, found.path.lasting, rng, 3)
        other = ruler.rate(*series_within(found.arm, shape, found.ask.limits).at(t), 1e3)
        assert ours.log_det > other.log_det


def test_fifty_eight_base_parameters_are_rated(ur10e):
    """36 inertials and four terms a joint, less two rotors that inertials stand for."""
    assert len(scale(question(ur10e)).independent) == 58


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"kind": "dance"}, "no kind"),
        ({"criterion": "Z"}, "no criterion"),
        ({"duration": 0.5}, "takes 2 s to 3600 s"),
        ({"duration": np.nan}, "takes 2 s"),
        ({"duration": 1e7}, "takes 2 s"),
        ({"margin": -1.0}, "margin"),
        ({"rate": 0.0}, "rate"),
        ({"restarts": 0}, "restart"),
    ],
)
def test_an_ask_that_makes_no_sense_is_refused(change, what):
    with pytest.raises(InputError, match=what):
        Ask(**change)


@pytest.mark.slow
def test_expected_and_achieved_spreads_agree():
    """Of a known arm, at its own point: what identification says of itself is what was told."""
    arm = load_arm("ur10e")
    run = fourier(arm, 20.0, 250.0, np.random.default_rng(0))
    ratios = []
    for seed in range(2):
        true = virtual_arm(arm, seed)
        log = observe(true, run, real_sensors(arm), np.random.default_rng(seed))
        fit = identify(arm, condition(log))
        told = expected(question(arm, about=true, rate=250.0), run)
        after = dict(zip(told.parameters.names, told.after, strict=True))
        told_of = ("coulomb", "viscous", "gain", "rotor_inertia", "offset")
        names = [f"{j}.{x}" for j in arm.joint_names for x in told_of]
        ratios += [fit.spread(name) / after[name] for name in names]
    # Noise is estimated from 5,000 rows, and colours by what the encoder and bristles add.
    assert abs(np.median(ratios) - 1.0) < 0.05
    assert np.mean(np.abs(np.array(ratios) - 1.0) < 0.15) > 0.85
