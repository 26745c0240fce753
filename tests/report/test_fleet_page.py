"""A fleet's page ranks by urgency, names what it cannot read, and stays whole and safe."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tracked import HOUSE, diagnosed, growing
from typer.testing import CliRunner

from urdyn.cli.app import app
from urdyn.diagnose.findings.document import findings_document
from urdyn.report.fleet.gather import STATES, gather, names, told
from urdyn.report.fleet.page import WORDS, fleet_page, headline, sentence
from urdyn.report.track import history

HOSTILE = "<img src=x onerror=alert(1)>"
JOINTS = ("shoulder_joint", "elbow_joint")
ROWS = 2000
T = 500.0 + 0.1 * np.arange(ROWS)  # [s] as a controller stamps it
NOW = 1e9  # [s]
DAY = 86400.0


def table(
    friction: float = 1.0, health: float = 1.0, surprise: float = 1.0, slip: float = 0.0
) -> pa.Table:
    """A run in which the elbow's friction and health end at these shares of what they were.

    Args:
        slip: [rad] by which its zero does so elsewhere.
    """
    columns = {"t": T}
    for joint in JOINTS:
        worn, left = (friction, health) if joint == "elbow_joint" else (1.0, 1.0)
        every = (("friction", 5.0, worn), ("coulomb", 3.0, worn), ("health", 1.0, left))
        for name, start, end in every:
            columns[f"{joint}.{name}"] = start * np.linspace(1.0, end, ROWS)
            columns[f"{joint}.{name}.sd"] = np.full(ROWS, 0.002 * start)
    columns |= {"elbow_joint.zero": slip * (T > 600.0), "elbow_joint.zero.sd": np.full(ROWS, 5e-4)}
    measured = np.full(ROWS, len(JOINTS))
    told = {"nis": surprise * measured, "measured": measured, "widened": np.zeros(ROWS, bool)}
    return pa.table(columns | told)


def robot(folder: Path, written: float = NOW, findings: object = None, **run: float) -> Path:
    folder.mkdir(parents=True)
    pq.write_table(table(**run), folder / "history.parquet")
    os.utime(folder / "history.parquet", (written, written))
    (folder / "report.html").write_text("a report")
    if findings is not None:
        (folder / "findings.json").write_text(json.dumps({"findings": findings}))
    return folder


def finding(severity: str, left: float | None = None, joint: int | None = 1) -> dict[str, object]:
    times = left and {"median": left, "lo": 0.5 * left, "hi": 2.0 * left}
    return {
        "kind": "friction_increase", "joint": joint, "onset_s": 510.0, "alarm_s": 512.0,
        "severity": severity, "confidence": 0.9, "time_to_failure_s": times, "evidence": "",
    }  # fmt: skip


@pytest.fixture
def folders(tmp_path: Path) -> list[Path]:
    """The same fleet, in the order of its urgency."""
    return [
        robot(tmp_path / "soon", findings=[finding("critical", DAY)]),
        robot(tmp_path / "later", findings=[finding("notice"), finding("critical", 9 * DAY)]),
        robot(tmp_path / "warned", findings=[finding("warning", 60.0)]),
        robot(tmp_path / "weak", health=0.7),
        robot(tmp_path / "stiff", friction=1.5),
        robot(tmp_path / "strange", surprise=5.0),
        robot(tmp_path / "calm", findings=[]),
    ]


def shown(folders: list[Path], stale: float = DAY) -> str:
    return fleet_page(gather(folders, NOW, stale), folders[0].parent / "fleet.html")


def test_the_most_urgent_comes_first_whatever_the_order_of_the_folders(folders):
    for order in (folders, folders[::-1]):
        found = gather(order, NOW, DAY).robots
        assert [r.name for r in found] == [folder.name for folder in folders]
    states = ["critical", "critical", "warning", "changed", "changed", "surprised", "steady"]
    assert [r.state for r in found] == states


def test_a_row_says_which_joint_since_when_and_until_when_counted_from_what(folders):
    row = shown(folders[:1]).replace("\u00a0", " ")
    said = "critical 24 h (12 to 48) after the run’s last stamp"
    assert f"Elbow friction increase since 10.0 s, critical; {said}." in row
    assert "Times are counted from the first stamp of each run." in row


def test_what_is_to_be_serviced_is_named_first(tmp_path):
    """By its diagnosis, which weighs costs: graver findings may need no service."""
    piece = finding("warning", joint=None) | {"kind": "payload_change"}
    worn, push = finding("notice", 780.0) | {"id": "worn"}, finding("warning", joint=0)
    folder = robot(tmp_path / "a", findings=[])
    for due, state in (("now", "service_now"), ("later", "critical")):
        said = {"advice": due, "finding": "worn"}
        grave = piece | {"severity": "critical"}
        document = {"findings": [grave, push, worn], "recommendation": said}
        (folder / "findings.json").write_text(json.dumps(document))
        (only,) = gather([folder], NOW, DAY).robots
        assert only.state == state
        assert sentence(only).startswith("Elbow friction increase since 10.0 s, notice")


def test_a_time_without_end_is_a_dash(tmp_path):
    endless = finding("critical", DAY)
    endless["time_to_failure_s"]["hi"] = None  # as JSON has infinity
    page = shown([robot(tmp_path / "a", findings=[endless])]).replace("\u00a0", " ")
    assert "critical 24 h (12 to no end) after the run’s last stamp" in page


def test_what_was_there_before_the_run_and_a_level_that_is_passed_are_said_so(tmp_path):
    gone = {"median": 0.0, "lo": 0.0, "hi": 0.0}
    within = {"onset_interval_s": [501.0, 508.4]}
    old = finding("critical", DAY) | {"older": True, "time_to_failure_s": gone} | within
    row = shown([robot(tmp_path / "a", findings=[old])]).replace("\u00a0", " ")
    assert "Elbow friction increase since 8.40 s or before, critical; level passed." in row


def test_a_push_has_a_moment_and_a_length_and_plans_no_service(tmp_path):
    told = {"duration_s": 0.97, "strength_N": 136.0, "force_N": [-100.0, 90.0, 20.0]}
    push = finding("warning") | {"kind": "collision", "evidence": told}
    pushed = robot(tmp_path / "pushed", findings=[push])
    worn = robot(tmp_path / "worn", findings=[push, finding("warning")])
    found = gather([pushed, worn], NOW, DAY)
    assert [(r.name, r.state) for r in found.robots] == [("worn", "warning"), ("pushed", "found")]
    row = shown([pushed]).replace("\u00a0", " ")
    assert "Elbow collision at 10.0 s for 0.97 s, warning." in row


def test_what_is_gone_by_now_is_told_and_is_no_fault(tmp_path):
    passed = finding("warning") | {"gone": True}
    ill = robot(tmp_path / "ill", findings=[passed, finding("notice", joint=0)])
    well = robot(tmp_path / "well", findings=[passed])
    worn = robot(tmp_path / "worn", findings=[passed], friction=1.5)
    found = gather([well, worn, ill], NOW, DAY)
    states = [(r.name, r.state) for r in found.robots]
    assert states == [("ill", "found"), ("worn", "changed"), ("well", "steady")]
    row = shown([well]).replace("\u00a0", " ")
    assert "Elbow friction increase at 10.0 s, gone by now, warning." in row
    assert told(found)["robots"][2]["findings"][0]["gone"]


def test_a_fault_of_the_tool_is_told_by_its_name(tmp_path):
    told = finding("warning", joint=None) | {"name": "tool", "kind": "payload_change"}
    assert "Tool payload change since" in shown([robot(tmp_path / "a", findings=[told])])


def test_a_fault_of_no_joint_is_told_without_one(tmp_path):
    page = shown([robot(tmp_path / "a", findings=[finding("warning", joint=None)])])
    assert "Friction increase since" in page


def test_what_somebody_knows_already_is_less_urgent(tmp_path):
    known = finding("critical", DAY) | {"acknowledged": True}
    first = robot(tmp_path / "known", findings=[known])
    both = robot(tmp_path / "both", findings=[known, finding("notice")])
    second = robot(tmp_path / "warned", findings=[finding("warning")])
    found = gather([first, both, second], NOW, DAY).robots
    assert [r.name for r in found] == ["warned", "both", "known"]
    assert "critical, acknowledged" in shown([first])


@pytest.mark.parametrize(("rate", "due"), [(4e-3, "now"), (4e-6, "later"), (4e-9, "never")])
def test_a_fleet_and_the_page_of_its_robot_recommend_the_same(tmp_path, rate, due):
    said = diagnosed(growing(rate=rate, rate_sd=0.1 * rate))
    assert said["recommendation"]["advice"] == due
    folder = robot(tmp_path / "cell-7", findings=[])
    (folder / "findings.json").write_text(json.dumps(said))
    fleet = gather([folder], NOW, DAY)
    states = {"now": "service_now", "later": "service_later", "never": "found"}
    words = {"now": "to be serviced now", "later": "to be planned for"}
    words["never"] = "with findings that are notices, or over"
    assert fleet.robots[0].state == states[due]
    assert headline(fleet).startswith(f"1 {words[due]} (cell-7).")
    done = CliRunner().invoke(app, ["acknowledge", str(folder), said["findings"][0]["id"]])
    assert done.exit_code == 0 and "report.html: is of before" in done.stderr
    seen = json.loads((folder / "findings.json").read_text())
    assert seen["recommendation"]["text"] != said["recommendation"]["text"]
    fleet = gather([folder], NOW, DAY)
    assert fleet.robots[0].state == "acknowledged"
    assert headline(fleet) == "1 with acknowledged findings only (cell-7)."


def test_what_is_to_be_serviced_now_comes_before_a_greater_severity(tmp_path):
    said = diagnosed(growing())  # a notice that is critical in two minutes
    due = robot(tmp_path / "due", findings=[])
    (due / "findings.json").write_text(json.dumps(said))
    worn = robot(tmp_path / "worn", findings=[finding("critical")])
    assert [r.name for r in gather([worn, due], NOW, DAY).robots] == ["due", "worn"]


@pytest.mark.parametrize("doubtful", [False, True])
def test_half_an_arm_that_was_ill_before_the_run_is_sent_to_no_service(tmp_path, doubtful):
    ill = [
        replace(growing(joint=j, name=JOINTS[j]), severity="critical", older=j < doubtful)
        for j in range(len(JOINTS))
    ]
    said = findings_document(ill, JOINTS, [True] * len(JOINTS), [], {}, {}, HOUSE)
    assert said["recommendation"]["advice"] == "now" and ("doubt" in said) == doubtful
    folder = robot(tmp_path / "cell-7", findings=[])
    (folder / "findings.json").write_text(json.dumps(said))
    fleet = gather([folder], NOW, DAY)
    assert fleet.robots[0].state == ("doubted" if doubtful else "service_now")
    assert ("to be serviced" not in headline(fleet)) == doubtful
    assert (">service now<" not in shown([folder])) == doubtful
    assert sentence(fleet.robots[0]).startswith("1 of 2 joints are far from this") == doubtful
    assert ("doubt" in told(fleet)["robots"][0]) == doubtful


def test_health_that_is_lost_is_said_to_be_lost(tmp_path):
    less = finding("warning") | {"kind": "health_degradation"}
    row = shown([robot(tmp_path / "a", findings=[less])]).replace("\u00a0", " ")
    assert "Elbow drive health loss since 10.0 s, warning." in row


def test_every_joint_has_a_line_for_friction_and_one_for_health(folders):
    page = shown(folders)
    assert page.count("<svg") == 2 * len(JOINTS) * len(folders)
    assert page.count('class="spark moved"') == 2  # stiff and weak
    assert 'aria-label="elbow friction +50 %"' in page and 'aria-label="elbow health −30 %"' in page


def test_equal_changes_are_drawn_alike_and_greater_ones_higher(tmp_path):
    runs = {"a": 1.2, "b": 1.2, "c": 1.4}
    page = shown([robot(tmp_path / name, friction=f) for name, f in runs.items()])
    ends = [
        float(y) for y in re.findall(r'friction \+[24]0 %".*?class="end" d="M\S+?,(\S+?)h0', page)
    ]
    c, a, b = ends  # most changed first
    assert a == b > c


def test_what_is_beyond_the_scale_is_said_to_run_along_its_edge(tmp_path):
    page = shown([robot(tmp_path / name, friction=f) for name, f in {"a": 3.0, "b": 4.0}.items()])
    tripled, fourfold = re.findall(r'friction \+[23]00 %".*?class="end" d="M\S+?,(\S+?)h0', page)
    assert tripled == fourfold and "runs along their edge" in page


def test_links_lead_to_the_reports_from_wherever_the_page_lies(folders, tmp_path):
    page = tmp_path / "else where" / "fleet.html"
    shown_there = fleet_page(gather(folders, NOW, DAY), page)
    links = re.findall(r'href="(.*?)"', shown_there)
    assert links == [f"../{folder.name}/report.html" for folder in folders]
    (folders[0] / "report.html").unlink()
    assert "no report.html" in shown(folders)


def test_what_cannot_be_read_is_named_with_the_reason(folders, tmp_path):
    broken, empty, absent = (tmp_path / name for name in ("broken", "empty", "absent"))
    robot(broken)
    (broken / "history.parquet").write_bytes(b"PAR1 torn")
    empty.mkdir()
    damaged = robot(tmp_path / "damaged", findings=[{"kind": "?"}])
    wrong = robot(tmp_path / "wrong", findings=[finding("critical", joint=7)])
    above = tmp_path
    asked = [*folders, broken, empty, absent, damaged, wrong, above]
    fleet = gather(asked, NOW, DAY)
    reasons = {u.folder: u.reason for u in fleet.unread}
    assert len(fleet.robots) == len(folders) and set(reasons) == set(asked[len(folders) :])
    for folder, word in {
        broken: "cannot be read", empty: "urdyn track", absent: "does not exist",
        damaged: "track the log again", wrong: "joint 7 of 2", above: "name those",
    }.items():  # fmt: skip
        assert word in reasons[folder] and "\n" not in reasons[folder]
        assert folder.name in shown(asked)
    assert "6 folders could not be read" in headline(fleet)


@pytest.mark.parametrize(
    "damage",
    [
        {"joint": np.inf},
        {"joint": 10**400},
        {"onset_s": np.nan},
        {"onset_s": 10**400},
        {"confidence": np.nan},
        {"evidence": {"duration_s": "long"}},
        {"evidence": {"until_s": []}},
        {"time_to_failure_s": {"median": np.nan, "lo": 1.0, "hi": 2.0}},
    ],
    ids=str,
)
def test_numbers_that_are_none_cost_one_folder_and_no_page(folders, tmp_path, damage):
    odd = robot(tmp_path / "odd", findings=[finding("warning") | damage])
    asked = [*folders, odd]
    (unread,) = gather(asked, NOW, DAY).unread
    assert unread.folder == odd and "track the log again" in unread.reason
    assert "1 folder could not be read" in shown(asked)


def test_findings_that_are_nested_beyond_reason_cost_one_folder(tmp_path):
    folder = robot(tmp_path / "deep", findings=[])
    (folder / "findings.json").write_text(10**5 * "[")
    assert "track the log again" in gather([folder], NOW, DAY).unread[0].reason


def test_a_folder_whose_name_is_no_text_is_linked_to_by_its_bytes(tmp_path):
    folder = robot(tmp_path / "cell").rename(tmp_path / os.fsdecode(b"cell\xff"))
    assert 'href="cell%FF/report.html"' in shown([folder])


@pytest.mark.parametrize("columns", [{"t": T}, {"t": T[:0]}, {"x": T}])
def test_a_history_of_nothing_is_no_reason_to_fail(tmp_path, columns):
    folder = robot(tmp_path / "a")
    pq.write_table(pa.table(columns), folder / "history.parquet")
    assert gather([folder], NOW, DAY).unread[0].reason


def test_broken_metadata_is_told(tmp_path):
    folder = robot(tmp_path / "a")
    odd = table().replace_schema_metadata({"urdyn.provenance": "[1]"})
    pq.write_table(odd, folder / "history.parquet")
    assert "cannot be read" in gather([folder], NOW, DAY).unread[0].reason


def test_times_without_end_are_not_numbers(tmp_path):
    folder = robot(tmp_path / "a", findings=[finding("warning", np.inf)])
    document = told(gather([folder], NOW, DAY))
    assert json.dumps(document, allow_nan=False)
    assert document["robots"][0]["findings"][0]["time_to_failure_s"]["hi"] is None


def test_a_history_nobody_writes_to_is_stale(tmp_path):
    folders = [robot(tmp_path / "old", NOW - 2 * DAY), robot(tmp_path / "new", NOW - 0.5 * DAY)]
    fleet = gather(folders, NOW, DAY)
    assert {r.name: r.stale for r in fleet.robots} == {"old": True, "new": False}
    assert "Nothing was heard lately of old" in headline(fleet)


def test_a_run_that_is_not_over_is_read_from_its_parts(tmp_path):
    folder = robot(tmp_path / "a", NOW - DAY)
    parts = folder / "history.parts"
    parts.mkdir()
    whole = table(friction=2.0)
    for k, rows in enumerate((whole[:700], whole[700:1500])):
        pq.write_table(rows, parts / f"part-{k:06d}.parquet")
        os.utime(parts / f"part-{k:06d}.parquet", (NOW, NOW))
    os.utime(folder / "history.parquet", (NOW + 1.0, NOW + 1.0))  # as a copy may have it
    (found,) = gather([folder], NOW, DAY).robots
    assert not found.finished and found.span == pytest.approx(0.1 * 1499)
    assert "unfinished" in shown([folder])
    pq.write_table(whole[1500:], parts / "part-000002.parquet")  # younger than the whole
    (found,) = gather([folder], NOW, DAY).robots
    assert found.finished and found.span == pytest.approx(0.1 * (ROWS - 1))


def test_the_parts_of_a_run_that_goes_on_are_opened_once_and_joined_whole(tmp_path, monkeypatch):
    opened, whole = [], table(friction=2.0, slip=0.01)
    real = history._opened
    monkeypatch.setattr(history, "_opened", lambda path: opened.append(path) or real(path))
    monkeypatch.setattr(history, "GROUP", 4)
    files = tuple(tmp_path / f"part-{k:06d}.parquet" for k in range(10))
    for k, path in enumerate(files):
        pq.write_table(whole[200 * k : 200 * (k + 1)], path)
    run = history.History(files, finished=False)
    for name in run.names:
        np.testing.assert_array_equal(run.column(name), whole[name].to_numpy())
    joined = 1 + len(files)  # for the columns there are, then each for its rows
    assert len(opened) == joined + 1 and not opened[-1].exists()


def test_the_page_is_one_small_file_that_needs_nothing(folders):
    page = shown(folders)
    assert "<script" not in page and "<link" not in page
    assert not re.search(r"(src|@import|url\()\s*=?\s*[\"']?(https?:)?//", page)
    assert len(page.encode()) < 60e3 * len(folders)


def test_a_peak_outlives_thinning(tmp_path):
    whole = table()
    y = whole["elbow_joint.health"].to_numpy().copy()
    y[777] = 0.5
    at = whole.schema.get_field_index("elbow_joint.health")
    folder = robot(tmp_path / "a")
    pq.write_table(
        whole.set_column(at, "elbow_joint.health", pa.array(y)), folder / "history.parquet"
    )
    (found,) = gather([folder], NOW, DAY).robots
    thin = found.series["health"][1]
    assert len(thin.mean) <= 162 and thin.mean.min() == 0.5


def test_hostile_names_and_findings_are_text(tmp_path):
    folder = robot(tmp_path / HOSTILE, findings=[finding(HOSTILE) | {"kind": HOSTILE}])
    page = shown([folder])
    assert HOSTILE not in page and "&lt;img" in page


def test_folders_of_the_same_name_are_told_apart(tmp_path):
    paths = [tmp_path / robot / "monday" for robot in ("a", "b")]
    assert names(paths) == ["a/monday", "b/monday"]
    assert names(paths[:1] * 2) == ["monday", "monday"]


def test_the_json_says_what_the_page_says(folders):
    document = told(gather(folders, NOW, DAY))
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    first, weak = document["robots"][0], document["robots"][3]
    assert first["findings"][0]["time_to_failure_s"] == {
        "median": DAY,
        "lo": DAY / 2,
        "hi": 2 * DAY,
    }
    assert f"{first['history_s']:.0f} s of history" in shown(folders).replace("\u00a0", " ")
    assert weak["joints"][1]["health"] == pytest.approx(0.7)
    assert [joint["health_state"] for joint in weak["joints"]] == ["steady", "changed"]


def test_how_surely_an_arm_lasts_is_told_where_its_diagnosis_says_so(folders):
    arm = {"health_index": 0.34, "horizon_h": 24.0, "judged": True}
    path = folders[0] / "findings.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"arm": arm}))
    said = "health index 34 %, the chance that no joint becomes critical"
    assert shown(folders).replace("\u00a0", " ").count(said) == 1
    document = told(gather(folders, NOW, DAY))["robots"]
    assert [r["health_index"] for r in document] == [0.34, *[None] * (len(folders) - 1)]
    assert document[0]["horizon_h"] == 24.0
    unknown = arm | {"health_index": None, "judged": False}
    path.write_text(json.dumps(json.loads(path.read_text()) | {"arm": unknown}))
    assert "health index not judged" in shown(folders).replace("\u00a0", " ")
    assert told(gather(folders, NOW, DAY))["robots"][0]["health_index"] is None
    path.write_text(json.dumps({"findings": [], "arm": {"health_index": None}}))
    assert "is damaged" in gather(folders, NOW, DAY).unread[0].reason


def test_a_browser_shows_it_without_a_sideways_scroll(folders, chromium, tmp_path):
    page = tmp_path / "fleet.html"
    page.write_text(shown(folders), encoding="utf-8")
    for width in (1280, 420):
        chromium.open(page, width)
        assert chromium.look()["overflow"] <= 0 and chromium.complaints == []


def test_a_run_in_which_nothing_was_compared_is_not_called_steady(tmp_path):
    folder = robot(tmp_path / "still", findings=[])
    still = table()
    still = still.set_column(still.column_names.index("measured"), "measured", [np.zeros(ROWS)])
    pq.write_table(still, folder / "history.parquet")
    (one,) = gather([folder], NOW, DAY).robots
    assert one.state == "unjudged"
    told = {"findings": [], "joints": [{"name": j, "judged": False} for j in JOINTS]}
    short = robot(tmp_path / "short", findings=[])
    (short / "findings.json").write_text(json.dumps(told))
    assert gather([short], NOW, DAY).robots[0].state == "unjudged"
    page = shown([folder])
    assert "nothing can be said of it" in page and "as commissioned" not in page


def test_a_joint_that_nobody_could_observe_is_not_said_to_be_as_commissioned(tmp_path):
    folder = robot(tmp_path / "blind", findings=[])
    blind = table()
    for quantity, sd in (("friction", 2.5), ("health", 0.5)):
        name = f"elbow_joint.{quantity}.sd"
        blind = blind.set_column(blind.column_names.index(name), name, [np.full(ROWS, sd)])
    pq.write_table(blind, folder / "history.parquet")
    fleet = gather([folder], NOW, DAY)
    states = [joint["friction_state"] for joint in told(fleet)["robots"][0]["joints"]]
    assert states == ["steady", "unsure"]
    said = sentence(fleet.robots[0])
    assert "every joint but elbow, of which too little was seen, are as commissioned" in said


def test_what_nobody_diagnosed_is_not_called_steady(tmp_path):
    asked = [robot(tmp_path / "calm", findings=[]), robot(tmp_path / "raw")]
    fleet = gather(asked, NOW, DAY)
    calm, raw = sorted(fleet.robots, key=lambda r: r.name)
    assert (calm.state, raw.state) == ("steady", "undiagnosed")
    assert headline(fleet) == "1 not diagnosed (raw); 1 steady."
    assert sentence(raw) == f"Not diagnosed. {sentence(calm)}"
    page = shown(asked)
    assert ">not diagnosed<" in page and page.index("raw/report") < page.index("calm/report")
    worn = gather([robot(tmp_path / "worn", friction=1.5)], NOW, DAY).robots[0]
    assert sentence(worn).startswith("Not diagnosed. Changed: elbow friction +50 %")


@pytest.mark.parametrize(("slip", "told"), [(-0.0015, False), (-0.023, True)])
def test_a_zero_that_slipped_is_told_though_no_line_shows_it(tmp_path, slip, told):
    asked = [
        robot(tmp_path / "strange", findings=[], surprise=5.0),
        robot(tmp_path / "slipped", findings=[], slip=slip),
    ]
    fleet = gather(asked, NOW, DAY)
    slipped = next(r for r in fleet.robots if r.name == "slipped")
    assert slipped.state == ("changed" if told else "steady")
    assert ("Changed: elbow zero −23 mrad since 100 s." in sentence(slipped)) == told
    assert ("1 changed (slipped)" in headline(fleet)) == told
    page = shown(asked)
    assert (page.index("slipped/report") < page.index("strange/report")) == told


def test_what_changed_is_judged_by_the_levels_of_its_own_diagnosis(tmp_path):
    slipped = robot(tmp_path / "slipped", findings=[], slip=-0.005)
    for warning, state in ((0.002, "changed"), (0.006, "steady")):
        levels = {"zero": {"warning": warning, "critical": 0.01}}
        (slipped / "findings.json").write_text(json.dumps({"findings": [], "levels": levels}))
        assert gather([slipped], NOW, DAY).robots[0].state == state
    (slipped / "findings.json").write_text('{"findings": [], "levels": {"zero": {"warning": "?"}}}')
    assert "is damaged" in gather([slipped], NOW, DAY).unread[0].reason


def test_words_are_as_urgent_as_states():
    assert list(WORDS) == list(STATES)
