"""The page of a diagnosed run: what is wrong, since when, what to do, and what will be."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tracked import CRITICAL, HOUSE, JOINTS, START, columns, diagnosed, growing, summary, write

from urdyn.cli.diagnosing import faulty, summed
from urdyn.diagnose.findings.acknowledge import as_set
from urdyn.diagnose.findings.doubt import GAIN
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.io.spans import clock, span, span_of
from urdyn.report.digits import difference, number
from urdyn.report.finding_words import direction, size, when
from urdyn.report.track.history import History
from urdyn.report.track.page import track_page
from urdyn.types import NORMAL90

SCRIPT = re.compile(r"<script.*?</script>", re.S)
PUSH = {"duration_s": 0.5, "strength_N": 40.0, "force_N": [40.0, 0.0, 0.0]}
PUSH |= {"force_sd_N": [5.0, 50.0, 1.0], "frame": "base"}


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("run") / "history.parquet", columns())


def page(history: Path, *findings) -> str:
    return track_page(History((history,)), summary(**diagnosed(*findings)))


def said(html: str, kind: str) -> str:
    found = re.search(rf'<p class="{kind}">(.*?)</p>', html)
    assert found
    return found.group(1).replace("\u00a0", " ")


def part(html: str, title: str) -> str:
    """A section."""
    whole = SCRIPT.sub("", html)
    return next(s for s in whole.split("<section>") if s.startswith(f"<h2>{title}</h2>"))


def test_the_first_words_are_what_is_wrong_since_when_and_what_to_do(history):
    html = page(history, growing())
    first = said(html, "headline")
    assert first.startswith(
        "Elbow: friction increase, 10.0 ± 1.6 % at 55.0 s, since 30.0 s; notice, "
    )
    assert re.search(r"critical in 100 s \(8\d to 12\d\)", first)
    assert said(html, "advice").startswith("Service now: elbow, check lubrication")


def test_a_belief_that_a_sick_sensor_bends_is_said_to_be_bent(tmp_path):
    table = columns()
    table["elbow_joint.health"] *= np.linspace(1.0, 0.8, len(table["elbow_joint.health"]))
    bent, kind = write(tmp_path / "history.parquet", table), "sensor_fault"
    sick = replace(growing(), kind=kind, id=f"{kind}.elbow_joint")
    told = said(page(bent, sick), "said")
    assert told.startswith("Tracked parameters, changed: elbow health")
    assert "A sensor fault distorts" in told and "A sensor fault" not in said(
        page(bent, growing()), "said"
    )


def test_where_a_friction_finding_meets_tracked_friction_their_sizes_are_told_apart(tmp_path):
    table = columns()
    table["elbow_joint.coulomb"] *= np.linspace(1.0, 1.7, len(table["elbow_joint.coulomb"]))
    stiff = write(tmp_path / "history.parquet", table)
    told = said(page(stiff, growing()), "said")
    assert "elbow Coulomb friction +70 %" in told and "all friction of its joint" in told
    still = write(tmp_path / "still.parquet", columns())
    assert "all friction of its joint" not in said(page(still, growing()), "said")


def test_nothing_found_is_said_first(history):
    html = page(history)
    assert said(html, "headline") == "Nothing wrong was found in 60.0 s."
    assert said(html, "advice") == "Leave it at work."
    assert "No trend is established in the friction or drive health of any joint." in html


@pytest.mark.parametrize(("slipped", "told"), [(0.0015, False), (0.023, True)])
def test_what_changed_beyond_a_warning_is_not_left_without_a_word(tmp_path, slipped, told):
    table = columns()
    table["elbow_joint.zero"] -= np.where(table["t"] > table["t"][3000], slipped, 0.0)
    html = page(write(tmp_path / "history.parquet", table))
    assert said(html, "said").startswith("Tracked parameters, changed: elbow zero −")
    advice = said(html, "advice")
    assert ("but check elbow zero: changed by more than a warning takes" in advice) == told
    assert advice == "Leave it at work." or told


def test_a_page_judges_by_the_levels_of_the_owners_own_rules(tmp_path):
    own, table = tmp_path / "plant.toml", columns()
    own.write_text(
        "[kind.encoder_offset]\nwarning = 0.03\ncritical = 0.05\n"
        "[kind.friction_increase]\ncritical = 0.25\n[kind.health_degradation]\ncritical = 0.15\n"
    )
    table["elbow_joint.zero"] -= np.where(table["t"] > table["t"][3000], 0.023, 0.0)
    for joint in JOINTS:  # shows a half, and not a quarter
        table[f"{joint}.friction.sd"] = 0.15 * table[f"{joint}.friction"]
    run = History((write(tmp_path / "history.parquet", table),))
    house, plant = (
        track_page(run, summary(**diagnosed(rules=r))) for r in (HOUSE, read_rules(own))
    )
    assert "check elbow zero" in said(house, "advice") and "friction by 50 %" in said(house, "lead")
    assert said(plant, "advice") == "Leave it at work."
    assert "friction by 25 % or of health by 15 % would not show" in said(plant, "lead")
    assert plant.count("0 sd, unsure") == house.count("0 sd, unsure") + len(JOINTS)


def test_what_too_little_was_seen_of_is_neither_well_nor_steady(history):
    nothing = track_page(History((history,)), summary(**diagnosed(judged=False)))
    assert said(nothing, "headline") == "Too little was compared in 60.0 s to judge."
    assert "Leave it" not in nothing and ", steady" not in nothing and "Steady:" not in nothing
    one = track_page(History((history,)), summary(**diagnosed(judged=(False, True))))
    told = said(one, "headline")
    assert "Too little was seen of shoulder, now or at commissioning, to judge." in told
    assert "every joint but shoulder, of which too little was seen, are as" in said(one, "said")
    table = one[one.index("<table") :]
    rows = [row for row in table.split("<tr>") if "<th>shoulder</th>" in row]
    assert "not judged" in rows[0] and "steady" not in rows[0]


def test_of_what_may_be_older_than_the_run_the_page_says_by_when_it_was_there(history):
    html = page(history, replace(growing(), older=True))
    assert "since 34.0 s or before" in said(html, "headline")
    assert "<td>34.0 s or before</td>" in html.replace("\u00a0", " ")


def test_the_health_of_what_was_not_seen_is_not_told(history):
    seen = diagnosed(growing(), judged=(False, True))
    told = part(track_page(History((history,)), summary(**seen)), "Forecast")
    row = next(r for r in told.split("<tr>") if "<th>shoulder</th>" in r)
    assert "100 %" not in row and "nothing found" not in row and row.count("not judged") == 3


def test_the_health_of_an_arm_of_which_no_joint_was_judged_is_not_told(history):
    push = replace(
        growing(name="forearm_link"), kind="collision", forecast=None, time_to_failure_s=None,
        evidence=PUSH,
    )  # fmt: skip
    for findings in ((), (push,)):
        said = diagnosed(*findings, judged=False)
        assert said["arm"]["health_index"] is None
        told = part(track_page(History((history,)), summary(**said)), "Forecast")
        assert "100 %" not in told and "99 %" not in told and "not judged" in told
    assert diagnosed(growing(), judged=False)["arm"]["health_index"] < 0.5
    assert diagnosed(judged=(True, False))["arm"]["health_index"] > 0.99


@pytest.mark.parametrize(
    ("severity", "set_to_it", "told"),
    [
        ("warning", False, "warning"),
        ("warning", True, "notice, acknowledged"),
        ("critical", True, "critical"),
    ],
)
def test_a_load_that_the_controller_is_set_to_is_known_unless_it_is_too_much(
    history, severity, set_to_it, told
):
    advice = read_rules().levels("payload_change").advice
    load = replace(
        growing(joint=None, name="tool"), kind="payload_change", unit="kg", size=1.0, size_sd=0.1,
        forecast=None, time_to_failure_s=None, severity=severity, advice=advice,
    )  # fmt: skip
    found = as_set([load]) if set_to_it else [load]
    run = summary(**diagnosed(*found))
    assert told in part(track_page(History((history,)), run), "Findings")
    assert faulty(run) == ("acknowledged" not in summed(run)) == ("acknowledged" not in told)
    assert as_set([growing()]) == [growing()]


def test_a_push_is_told_by_the_stamp_of_the_terminal_and_drawn_in_the_joints_that_felt_it(tmp_path):
    table = columns()
    t, shoved = table["t"] - START, 3.0
    table["current_0"] = table["current_0"] + shoved * ((t > 20.0) & (t < 20.5))
    table["predicted_1"] = np.full(len(t), np.nan)  # it stands
    table["current_1"] = 2.0 + shoved * ((t > 20.0) & (t < 20.5))
    finding = replace(
        growing(name="forearm_link"), kind="collision", forecast=None, time_to_failure_s=None,
        onset_s=START + 20.0,
    )  # fmt: skip
    run = write(tmp_path / "history.parquet", table)
    for torque, joints in (([9.0, 9.0], {"shoulder", "elbow"}), ([9.0, np.nan], {"shoulder"})):
        push = replace(finding, evidence=PUSH | {"torque_Nm": torque})
        told = page(run, push)
        assert "for 0.50 s; stamp 1020.00 s" in told
        (drawn,) = (
            json.loads(spec)
            for spec in re.findall(r'<script type="application/json">(.*?)</script>', told, re.S)
            if "beyond expected" in spec
        )
        traces = {trace["name"]: trace for trace in drawn["data"]}
        assert set(traces) == joints
        for trace in traces.values():
            x, y = values(trace["x"]), values(trace["y"])
            assert x.min() >= 18.0 - 0.01 and x.max() <= 22.5 + 0.01
            during = (x > 20.1) & (x < 20.4)
            assert np.median(y[during]) == pytest.approx(shoved, abs=0.1)
            assert np.median(y[x < 19.9]) == pytest.approx(0.0, abs=0.1)


def test_the_graver_finding_comes_first(history):
    mild, grave = growing(), growing(joint=0, name="shoulder_joint")
    first = said(page(history, mild, replace(grave, severity="critical")), "headline")
    assert first.index("Shoulder") < first.index("Elbow")


def test_a_change_that_does_not_surely_grow_has_no_fan_and_says_so(history):
    html = page(history, growing(rate=1e-3, rate_sd=1e-3))
    told = part(html, "Forecast")
    assert 'class="plot"' not in told
    assert "No trend is established of elbow, friction increase: found, but not surely" in told
    assert 'class="plot"' in part(html, "Findings")  # its course is drawn there


def test_a_fan_is_drawn_from_the_numbers_of_the_finding(history):
    finding = growing()
    whole = page(history, finding)
    drawn = next(
        json.loads(text)
        for text in re.findall(r'<script type="application/json">(.*?)</script>', whole, re.S)
        if "forecast" in text
    )
    traces = {trace.get("name"): trace for trace in drawn["data"]}
    reached = next(t for name, t in traces.items() if name and name.startswith("critical in"))
    left = finding.forecast["to_critical_s"]
    (x,), (y,) = ([*map(float, values(reached[axis]))] for axis in "xy")
    assert x == pytest.approx(finding.forecast["at_s"] - START + left["median"], rel=1e-5)
    assert y == pytest.approx(100.0 * CRITICAL)
    bar = reached["error_x"]
    assert (bar["array"][0], bar["arrayminus"][0]) == pytest.approx(
        (left["hi"] - left["median"], left["median"] - left["lo"])
    )
    labels = {shape.get("label", {}).get("text") for shape in drawn["layout"]["shapes"]}
    assert labels >= {"warning +20 %", "critical +50 %", "now", "alarm"}


def test_a_band_of_what_was_seen_is_as_wide_as_90_percent_are(history):
    finding = growing()
    drawn = next(
        json.loads(text)
        for text in re.findall(
            r'<script type="application/json">(.*?)</script>', page(history, finding), re.S
        )
        if '"seen"' in text and "forecast" in text
    )
    seen, sd = (100.0 * np.array(finding.evidence["series"][k]) for k in ("size", "sd"))
    n = len(seen)
    edges = [values(t["y"])[:n] for t in drawn["data"] if len(values(t["y"])) == n + 1]
    half = max(float(np.max(np.abs(y - seen) / sd)) for y in edges)
    assert half == pytest.approx(NORMAL90, rel=1e-4)


def values(drawn) -> np.ndarray:
    import base64

    if isinstance(drawn, dict):
        return np.frombuffer(base64.b64decode(drawn["bdata"]), drawn["dtype"])
    return np.array(drawn, float)


def test_each_joint_is_told_how_long_it_lasts(history):
    told = part(page(history, growing()), "Forecast")
    row = next(r for r in told.split("<tr>") if "<th>elbow</th>" in r)
    assert "health index, 24 h" in told and "outside" in row  # critical in two minutes
    row = next(r for r in told.split("<tr>") if "<th>shoulder</th>" in r)
    assert "100 %" in row and "outside" not in row and row.count("nothing found") == 2
    row = next(r for r in told.split("<tr>") if "<th>whole arm</th>" in r)
    assert "that no joint becomes critical within 24 h" in row and "outside" in row


def test_what_servicing_now_or_never_would_cost_is_told_in_a_sentence(history):
    told = part(page(history, growing()), "Findings").replace("\u00a0", " ")
    cost = diagnosed(growing())["recommendation"]["expected_cost"]
    now, later, never = (number(cost[choice]) for choice in ("now", "later", "never"))
    said = f"as much as {now} planned services, later as {later}, never as {never}."
    assert f"Servicing now is expected to cost {said}" in told


def test_both_levels_are_told_in_the_first_sentence(history):
    finding = growing()
    warning, critical = (span_of(finding.forecast[f"to_{x}_s"]) for x in ("warning", "critical"))
    first = said(page(history, finding), "headline")
    assert first.endswith(f"warning in {warning}, critical in {critical}.")


def test_a_level_that_is_passed_is_told_once_by_the_severity(history):
    finding = growing()
    passed = finding.forecast | {"to_warning_s": {"median": 0.0, "lo": 0.0, "hi": 0.0}}
    first = said(page(history, replace(finding, forecast=passed, severity="warning")), "headline")
    critical = span_of(finding.forecast["to_critical_s"])
    assert first.endswith(f"since 30.0 s; warning, critical in {critical}.")


def test_a_sound_arm_is_told_how_long_it_lasts(history):
    told = part(page(history), "Forecast")
    index = 100.0 * diagnosed()["arm"]["health_index"]
    said = f"Health index of the arm: {index:.0f} %, the chance that no joint becomes critical"
    assert f"{said} within 24 h." in told


def test_losses_of_the_stream_are_shown(history):
    told = part(page(history), "Data quality")
    for words in ("3 x torn row (left out)", "longest step 0.13 s", ">12\n<", "0.10 %"):
        assert words in told
    # 1 of 5500 compared rows is far off, and a Gaussian has as good as none
    assert "1 row<" in told
    assert "From 20.0 s on, for 9.00 s, samples came 0.12 s apart, where 0.010 s" in told


def test_a_hostile_finding_is_text(history):
    hostile = "</script><img src=x onerror=alert(1)>"
    finding = replace(growing(), advice=hostile, quantity=hostile, kind=hostile)
    shown = page(history, finding)
    assert "<img" not in SCRIPT.sub("", shown)
    assert shown.count("<script") == page(history, growing()).count("<script")


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(None, "no end"), (1e9, "no end"), (90.0, "90 s"), (7500.0, "2.1 h"), (9 * 86400.0, "9.0 d")],
)
def test_times_are_told_in_their_largest_unit(seconds, words):
    assert span(seconds) == words


@pytest.mark.parametrize(
    ("until", "words"), [(START + 35.2, ", until 35.2 s"), (START + 30.02, " for 0.020 s")]
)
def test_what_is_over_at_once_is_not_told_to_last_from_a_moment_to_the_same(until, words):
    finding = {"kind": "sensor_fault", "onset_s": START + 30.0, "older": False, "gone": False}
    told = when(finding | {"evidence": {"until_s": until}}, START, clock(60.0))
    assert told == f"at 30.0 s{words}"


def test_what_is_gone_is_said_to_be_and_neither_marked_nor_a_reason_to_fail(history):
    grave = replace(growing(), severity="warning", forecast=None, time_to_failure_s=None)
    for gone in (False, True):
        run = summary(**diagnosed(replace(grave, gone=gone)))
        assert faulty(run) != gone
        html = track_page(History((history,)), run)
        assert (", gone by now; warning." in said(html, "headline")) == gone
        assert ('class="outside"' not in part(html, "Findings")) == gone
        assert ("all that was found is known, or gone by now" in said(html, "advice")) == gone


def test_a_size_has_the_digits_of_its_interval():
    assert size({"unit": "kg", "size": 2.00712, "size_sd": 0.018}) == "2.007 ± 0.030 kg"
    assert size({"unit": "N", "size": 90.2, "size_sd": None}) == "90 N"
    along = "(40.0 ± 8.2, 0 ± 82, 0.0 ± 1.6) N along x, y, z of the pendant's base"
    assert direction(PUSH) == along


@pytest.mark.parametrize(
    ("share", "words"),
    [(0.009, "+0.9 %"), (-0.0704, "−7.0 %"), (0.35, "+35 %"), (-0.0004, "0 %"), (0.0995, "+10 %")],
)
def test_a_change_has_no_digit_that_nobody_measured(share, words):
    assert difference(share) == words


def test_what_is_large_and_unsure_is_not_called_steady(tmp_path):
    table = columns()
    rows = len(table["t"])
    table["elbow_joint.friction"] *= np.linspace(1.0, 0.9, rows)
    table["elbow_joint.friction.sd"] = np.full(rows, 0.9)
    table["shoulder_joint.friction"] *= np.linspace(1.0, 1.02, rows)
    html = page(write(tmp_path / "history.parquet", table))
    assert said(html, "said").startswith("No change is sure: friction")
    assert "−0.7 sd, unsure" in html and html.count("unsure") >= 2
    assert "+1.3 sd, steady" in html


def test_intervals_that_are_too_narrow_are_not_said_to_hold(tmp_path):
    table = columns()
    table["nis"] *= 3.0
    lead = said(page(write(tmp_path / "history.parquet", table)), "lead")
    assert "too narrow" in lead and "Intervals would hold 90 % if nothing were missing." in lead


def test_a_doubt_calls_a_joint_as_people_do(history):
    load = replace(
        growing(joint=1, name="elbow_joint"), kind="sensor_fault", quantity=GAIN, size=-2.0
    )
    html = page(history, load)
    assert "The current of elbow has the wrong sign" in html.replace("\u00a0", " ")
