"""What a twin ends in."""

from dataclasses import replace

import numpy as np
import pytest
from found import FOUND

from urdyn.diagnose.findings.prognosis import Course
from urdyn.diagnose.findings.recommend import arm_health, health, recommendation
from urdyn.faults import Costs, decide, outlook

HOUR = 3600.0
LEFT = {"median": 300 * HOUR, "lo": 200 * HOUR, "hi": 450 * HOUR}
GROWING = replace(FOUND, time_to_failure_s=LEFT)
STEADY = replace(GROWING, id="steady", time_to_failure_s=None)
KNOWN = "all that was found is known, or gone by now"


def advice(*findings):
    return recommendation(findings, Costs())


def test_nothing_found_is_left_at_work():
    assert advice()["advice"] == "never"
    assert advice(STEADY)["advice"] == "never"


@pytest.mark.parametrize("found", [(), (STEADY,), (STEADY, GROWING)])
def test_what_is_advised_costs_least(found):
    of = advice(*found)
    cost = of["expected_cost"]
    assert cost[of["advice"]] == min(cost.values())


def test_a_service_of_a_sound_joint_costs_itself_and_its_life_and_none_costs_nothing():
    cost, costs = advice()["expected_cost"], Costs()
    used = costs.service * costs.horizon / costs.life
    assert (cost["now"], cost["never"]) == (costs.stop + used, 0.0)


def test_what_needs_no_service_is_to_be_looked_at_all_the_same():
    push = replace(STEADY, kind="collision", severity="critical", name="tool", advice="look at it")
    assert advice(STEADY, push)["text"] == "no service is due; tool: look at it"
    assert advice()["text"] == "leave it at work: nothing was found"


def test_pushes_that_recur_are_asked_whether_they_are_the_work():
    """Until somebody has said so."""
    push = replace(STEADY, kind="collision", name="tool0", advice="look at it")
    first, *others = (replace(push, id=f"collision.tool0@{t}", onset_s=t) for t in (3.0, 9.0, 18.0))
    elsewhere = replace(push, id="collision.wrist", name="wrist")
    assert advice(first, others[0], elsewhere)["text"].endswith("tool0, wrist: look at it")
    told = advice(first, elsewhere, *others)["text"]
    assert "look at it; 3 pushes on tool0, every 7.5 s or so: if that is the work" in told
    assert "pushes on" not in advice(replace(first, acknowledged=True), *others)["text"]


def test_nothing_found_is_no_health_where_too_little_was_seen():
    some, none = ({"elbow": False, "wrist": seen} for seen in (True, False))
    told = recommendation((), Costs(), some)["text"]
    few = "too little was seen of elbow, now or at commissioning, to judge"
    assert told == f"leave it at work: nothing was found; {few}"
    assert "leave it" not in recommendation((), Costs(), none)["text"]
    assert recommendation((GROWING,), Costs(), none) == advice(GROWING)


def test_what_somebody_has_seen_is_no_safer():
    seen, new = advice(replace(GROWING, acknowledged=True)), advice(GROWING)
    assert seen | {"text": new["text"]} == new
    assert seen["text"] == f"{new['text']} (acknowledged)"
    known = advice(replace(STEADY, acknowledged=True))
    assert known["text"] == f"no service is due: {KNOWN}"


def test_nobody_is_sent_to_look_at_what_is_gone_by_now():
    passed = replace(STEADY, id="passed", name="wrist", alarm_s=9.0, gone=True)
    assert advice(passed)["text"] == f"no service is due: {KNOWN}"
    assert advice(passed, STEADY)["text"] == advice(STEADY)["text"]


def test_what_grows_is_serviced_before_it_fails():
    of = advice(STEADY, GROWING)
    assert of["advice"] == "later"
    assert of["finding"] == GROWING.id
    assert Costs().notice <= of["service_in_h"] < 200.0
    assert "elbow_joint" in of["text"]


def test_what_has_to_be_serviced_first_comes_first():
    times = {"median": 2 * HOUR, "lo": HOUR, "hi": 4 * HOUR}
    urgent = replace(GROWING, id="urgent", time_to_failure_s=times)
    of = advice(GROWING, urgent)
    assert (of["advice"], of["finding"]) == ("now", "urgent")


@pytest.mark.parametrize(("kind", "told"), [("health_degradation", "now"), ("collision", "never")])
def test_what_is_critical_already_is_serviced_now_if_that_helps(kind, told):
    assert advice(replace(STEADY, kind=kind, severity="critical"))["advice"] == told


def test_a_joint_lasts_as_surely_as_its_faults_do():
    notice = Costs().notice * HOUR
    times = {"median": notice, "lo": 0.5 * notice, "hi": 2.0 * notice}
    even = replace(GROWING, confidence=1.0, time_to_failure_s=times)
    far = replace(GROWING, id="far", joint=0)
    pushed = replace(GROWING, id="pushed", kind="collision", joint=1, severity="critical")
    rows = health([even, far, pushed], ("a", "b", "c", "d"), Costs())
    index = [row["health_index"] for row in rows]
    unseen = np.exp(-Costs().notice / Costs().life)
    assert index[0] == pytest.approx(unseen, abs=1e-5)  # 200 h at the soonest, or by 4.5 sd
    assert index[1] == index[3] == pytest.approx(unseen)  # nothing that wears; nothing at all
    assert 0.99 < unseen < 1.0
    assert index[2] == pytest.approx(0.5, abs=0.02)  # by its median, to a step of the outlook
    both = health([even, replace(even, id="too")], ("a", "b", "c"), Costs())
    assert both[2]["health_index"] == pytest.approx(index[2] ** 2 / unseen)


@pytest.mark.parametrize("sd", [0.05, 0.11, 0.115, 0.125])
def test_a_change_that_may_be_critical_at_once_waits_as_its_own_draws_do(sd):
    """Oracle: the forecast itself, of which the outlook knows a median and two limits."""
    course = Course(0.0, 0.4, sd, 0.0005 / HOUR, 0.0001 / HOUR)
    sizes, rates = course._draws
    t, failed = outlook(Costs(), 1.0, *(x / HOUR for x in course.until(0.6).values()))
    drawn = np.mean((0.6 - sizes) / rates <= HOUR * t[:, None], axis=1)
    early = t <= Costs().notice
    np.testing.assert_allclose(failed[early], drawn[early], atol=0.02)
    assert decide(t, failed).advice == decide(t, drawn).advice == "later"


def test_an_arm_lasts_as_surely_as_all_its_joints_do():
    weak = health([replace(STEADY, severity="critical")], ("a", "b", "c"), Costs())
    arm = arm_health(weak, Costs())
    assert arm["health_index"] == pytest.approx(np.prod([row["health_index"] for row in weak]))
    assert arm["health_index"] < 0.05 and arm["horizon_h"] == Costs().notice
    sound = arm_health(health([], ("a", "b", "c"), Costs()), Costs())["health_index"]
    assert sound == pytest.approx(np.exp(-3.0 * Costs().notice / Costs().life))


def test_what_is_critical_and_yet_not_serviced_says_what_each_choice_costs():
    dear = Costs(stop=8.0)
    doubtful = replace(STEADY, severity="critical", confidence=0.75)
    of = recommendation([doubtful], dear)
    assert of["advice"] == "never" and of["expected_cost"]["never"] == pytest.approx(7.5, abs=0.1)
    assert "no service is due, by [costs] of the rules: to go on is" in of["text"]
    assert "cost 7.5" in of["text"]
    assert f"service now {of['expected_cost']['now']:.3g}" in of["text"]
    assert doubtful.advice in of["text"]
    known = recommendation([replace(doubtful, acknowledged=True)], dear)["text"]
    assert "expected to cost" in known and known.endswith(KNOWN)
