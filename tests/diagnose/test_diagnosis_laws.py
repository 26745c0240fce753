"""Live is offline, a memory forgets nothing, and rules are data."""

from __future__ import annotations

import json
import shutil
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from found import FOUND
from scipy.stats import norm
from shop import Shop
from typer.testing import CliRunner

from urdyn.cli.app import app
from urdyn.diagnose import memory
from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.findings.acknowledge import (
    WORSE,
    Acknowledged,
    acknowledge,
    acknowledged,
    forget_gone,
)
from urdyn.diagnose.findings.document import findings_document
from urdyn.diagnose.findings.prognosis import FAN, Course, trend
from urdyn.diagnose.findings.trust import trust
from urdyn.diagnose.findings.verdict import of_change, up_to_date
from urdyn.diagnose.job import Job
from urdyn.diagnose.kinds import rules
from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.kinds.rules import Rules
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.load.carrying import MOMENT
from urdyn.diagnose.memory import Memory
from urdyn.diagnose.offline import diagnose
from urdyn.diagnose.residual.pace import BEAT, Pace
from urdyn.diagnose.session import Session
from urdyn.diagnose.slow.onsets import Block
from urdyn.diagnose.slow.recall import Recall, Series
from urdyn.diagnose.state import Now, State
from urdyn.errors import InputError
from urdyn.io import writing
from urdyn.signal import Instant
from urdyn.types import NORMAL90

PUSH = "collision:link=4,force=90/0/60,onset=6"
RUN = {"run": "this"}
NAMES = ("t", "q", "v", "a", "jerk", "current", "temperature", "shift", "instrumental")


def instants(shop: Shop, log):
    motion, s, moved = shop.motion(log)
    for k in range(len(motion)):
        yield Now(Instant(*(getattr(motion, name)[k] for name in NAMES)), s[k], moved[k])


def test_instant_by_instant_finds_what_the_whole_recording_shows(shop: Shop) -> None:
    log = shop.log(PUSH, seconds=10.0)
    diagnosis = shop.diagnosis(log)
    state = diagnosis.init()
    for now in instants(shop, log):
        state, _ = diagnosis.step(state, now)
    state, _ = diagnosis.finish(state)
    (live,), (whole,) = state.findings, diagnose(shop.fit, log).findings
    assert live.id == whole.id
    np.testing.assert_allclose(live.size, whole.size, rtol=0.1)
    np.testing.assert_allclose(live.alarm_s, whole.alarm_s, atol=0.25)


@pytest.mark.parametrize("rate", [100.0, 125.0, 250.0, 500.0])
def test_beats_are_the_same_live_as_over_the_whole(shop: Shop, rate: float, monkeypatch) -> None:
    log, beats = shop.log(seconds=4.0, rate=rate), {"live": [], "whole": []}
    diagnosis = shop.diagnosis(log)

    def counted(name):
        def beat(self, state):
            beats[name].append(sum(map(len, state.beat)))
            return replace(state, beat=()), []

        monkeypatch.setattr(Diagnosis, "_beat", beat)

    counted("live")
    state = diagnosis.init()
    for now in instants(shop, log):
        state, _ = diagnosis.step(state, now)
    diagnosis.finish(state)
    counted("whole")
    diagnosis.over(*shop.motion(log))
    assert len(beats["live"]) > 10 and beats["live"] == beats["whole"]


def test_an_encoder_that_is_silent_as_the_clock_is_set_back_takes_nothing_back(shop: Shop) -> None:
    """As far as it is known, that is after what was seen, and not before."""
    log = shop.log(seconds=31.0, rate=50.0)
    log = replace(log, t=log.t - log.t[0] + 1000.0)
    diagnosis, silent = shop.diagnosis(log), np.arange(6) == 3
    before = diagnosis.init()
    for now in instants(shop, log):
        before, _ = diagnosis.step(before, now)
    after, found = before, []
    for k in range(12):
        gone = replace(now.instant, t=5.0 + 0.02 * k, q=np.where(silent, np.nan, now.instant.q))
        after, more = diagnosis.step(after, replace(now, instant=gone))
        found += more
    assert len(before.slow.recall.blocks) > 3
    assert len(after.slow.recall.blocks) == len(before.slow.recall.blocks)
    assert [f.onset_s > 1031.0 for f in found] == [True]


def test_moments_that_wait_are_seen_as_the_arm_is_believed_to_be_by_now(shop: Shop) -> None:
    """Or what the last block taught would speak for a load that is compared with them."""
    health = "health_degradation:joint=1,onset=8,rate=0.2,shape=step"
    log = shop.log(health, seconds=20.0, rate=20.0)
    diagnosis, likely = shop.diagnosis(log), set()
    state, loads = diagnosis.init(), diagnosis.slow.loads
    for now in instants(shop, log):
        state, _ = diagnosis.step(state, now)
        slow = state.slow
        believed = diagnosis.slow._believed(slow)
        for moment in slow.waiting:
            usual = loads.given.shown(moment, believed(moment), slow.carrying.modes[0].mean)
            np.testing.assert_allclose(moment.told[0].d, usual.d, rtol=1e-9)
        likely.add(slow.likely)
    assert len(likely) > 1 and slow.known


def test_a_controller_that_begins_anew_ends_no_diagnosis(shop: Shop) -> None:
    log = shop.log("friction_increase:joint=2,onset=15,rate=0.6,shape=step", rate=25.0)
    diagnosis = shop.diagnosis(log)
    state = diagnosis.init()
    for now in instants(shop, log):
        t = now.instant.t + (9e3 if now.instant.t < 8.0 else 0.0)
        state, _ = diagnosis.step(state, replace(now, instant=replace(now.instant, t=t)))
        assert len(state.beat) + len(state.moment) < 20
    state, _ = diagnosis.finish(state)
    (found,) = state.findings
    assert (found.kind, found.joint) == ("friction_increase", 2) and not found.older


def test_a_diagnosis_goes_on_where_its_memory_ends(shop: Shop, tmp_path: Path) -> None:
    log = shop.log(PUSH, seconds=9.0, rate=100.0)
    diagnosis, again = shop.diagnosis(log), None
    state, kept = diagnosis.init(), Memory(tmp_path, RUN)
    for k, now in enumerate(instants(shop, log)):
        if k in (100, 380, 655):  # amid a beat, a moment and a block; at last just after the push
            kept.keep(state, k)
        if k == 655:
            again = Memory(tmp_path, RUN).at(k)
        if again is not None:
            again, _ = diagnosis.step(again, now)
        state, _ = diagnosis.step(state, now)
    assert again is not None
    none = ((), (), (), {}, {}, diagnosis.rules)
    one, other = (findings_document(s.findings, *none) for s in (again, state))
    assert one == other
    assert len(state.findings) == 1
    assert whole(again, tmp_path / "again") == whole(state, tmp_path / "state")


def whole(state: State, folder: Path) -> bytes:
    """All that there is to remember of a state, to the last bit."""
    folder.mkdir()
    Memory(folder, RUN).keep(state, 1)
    (path,) = folder.iterdir()
    return path.read_bytes()


@pytest.mark.parametrize("again", [2000, 3000])  # a run may end at the sample that it was kept at
def test_a_diagnosis_that_is_killed_while_it_is_kept_goes_on_at_the_sample_before(
    shop: Shop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, again: int
) -> None:
    diagnosis = shop.diagnosis(shop.log(seconds=2.0))
    state, kept = diagnosis.init(), Memory(tmp_path, RUN)
    kept.keep(replace(state, slow=diagnosis.slow.init()), 1000)
    kept.keep(state, 2000)

    def killed(path: Path) -> Any:
        if path.name == f"diagnosis-{again}.npz":
            raise InterruptedError
        return writing(path)

    monkeypatch.setattr(memory, "writing", killed)
    with pytest.raises(InterruptedError):
        kept.keep(state, again)
    monkeypatch.undo()
    goes_on = Memory(tmp_path, RUN).at(2000)
    assert whole(goes_on, tmp_path / "goes_on") == whole(state, tmp_path / "state")


def test_a_memory_knows_all_that_a_diagnosis_is_made_of_by_its_own_name() -> None:
    seen, ahead = set[type](), [State]
    while ahead:
        kind = ahead.pop()
        seen.add(kind)
        hints = list(get_type_hints(kind).values())
        while hints:
            hint = hints.pop()
            hints += get_args(hint)
            if isinstance(hint, type) and is_dataclass(hint) and hint not in seen:
                ahead.append(hint)
    assert seen <= set(memory.KNOWN)
    assert len(memory.CLASSES) == len(memory.KNOWN)


def test_another_runs_memory_and_a_damaged_one_are_refused(
    shop: Shop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    state, kept = shop.diagnosis(shop.log(seconds=2.0)).init(), Memory(tmp_path, RUN)
    for sample in (1000, 2000):
        kept.keep(state, sample)
    that = Memory(tmp_path, {"run": "that"})
    with pytest.raises(InputError, match="another run"):
        that.at(1000)
    with monkeypatch.context() as older:
        older.delitem(memory.CLASSES, "Book")  # a class that is no more, or not yet
        with pytest.raises(InputError, match="another run"):
            that.at(1000)
    for name, sample in [("diagnosis-1000.npz", 1000), ("diagnosis-2000-lasting.npz", 2000)]:
        path = tmp_path / name
        path.write_bytes(path.read_bytes()[:1000])
        with pytest.raises(InputError, match="damaged"):
            kept.at(sample)
        path.unlink()
        with pytest.raises(InputError, match="damaged"):
            kept.at(sample)


def test_an_expert_adds_a_kind_without_touching_the_code(shop: Shop, tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text(
        "[kind.dry_gear]\nchange = { beta = 0.5 }\nleast = 0.1\nwarning = 0.2\ncritical = 1.0\n"
        "sign = 1\n[promise]\nhours = 100.0\n"
    )
    rules = read_rules(path)
    [own] = [kind for kind in rules.slow if kind.name == "dry_gear"]
    assert own.unit == "-"  # that of its state: told in per cent
    assert rules.hours == 100.0
    report = diagnose(shop.fit, shop.log(seconds=3.0), rules)
    assert len(report) == 0


@pytest.mark.parametrize(
    ("robot", "tool", "plant", "critical"),
    [
        ("ur30", 0.0, "", 30.0),
        ("ur3e", 1.0, "", 2.0),
        ("ur3e", 4.0, "", 0.2),  # whatever is added
        ("ur3e", 1.0, "[rated]\nur3e = 2.5\n", 1.5),
        ("ur3e", 1.0, "[kind.payload_change]\ncritical = 8.0\n", 8.0),
        ("one_of_a_kind", 1.0, "", 4.0),  # a UR5e by its dimensions
    ],
)
def test_a_load_is_critical_beyond_what_the_arm_is_rated_for_or_as_a_plant_says(
    shop: Shop, robot: str, tool: float, plant: str, critical: float, tmp_path: Path
) -> None:
    path, of = tmp_path / "plant.toml", shop.dynamics
    path.write_text(plant)
    loaded = replace(of, arm=replace(of.arm, name=robot), payload=np.r_[tool, np.zeros(9)])
    rules = read_rules(path)
    before, after = ({k.name: k for k in kinds} for kinds in (rules.slow, rules.slow_of(loaded)))
    assert after.pop("payload_change").critical == pytest.approx(critical)
    assert after == {name: before[name] for name in after}


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("kind.controller_instability", {"patience": 2.5}),
        ("kind.joint_backlash", {"enough": 5}),
        ("kind.friction_increase", {"warning": 0.3}),
        ("healthy.f", {"day": 0.2}),
    ],
)
def test_what_a_plant_does_not_say_the_house_says(
    table: str, said: dict[str, float], tmp_path: Path
) -> None:
    def told(rules: Rules) -> dict[str, object]:
        tables = {kind.name: vars(kind) for kind in rules.slow} | dict(rules.healthy)
        tables |= {name: vars(rule) for name, rule in vars(rules.fast).items()}
        return dict(tables[table.partition(".")[2]])

    path, ((key, value),) = tmp_path / "plant.toml", said.items()
    path.write_text(f"[{table}]\n{key} = {value}\n")
    assert told(read_rules(path)) == told(read_rules()) | said


@pytest.mark.parametrize(
    "text",
    [
        "[kind.odd]\nchange = { colour = 1.0 }\nleast = 0\nwarning = 0\ncritical = 0\n",
        "[kind.odd]\nchange = { f = 1.0 }\n",
        "[promise]\nhours = 0\n",
        "[healthy]\nq = { day = 1.0 }\n",
        "[healthy]\nf = 3\n",
        "[warmth]\nlag = 'a'\n",
        "[noise]\nx = 3\n",
        "[sorts]\na = 1\n",
        "promise = 3\n",
        "[kind]\nodd = 1\n",
        "[kind.odd]\nwarning = 1\n",
        "[kind.odd]\nchange = 1\n",
        "[kind.odd]\nchange = {}\nleast = 0\nwarning = 0\ncritical = 0\n",
        "[kind.friction_increase]\nwarning = 'x'\n",
        "[kind.friction_increase]\nshapes = 1\n",
        "[kind.controller_instability]\npatience = 'x'\n",
        "[kind.controller_instability]\nlonger = 1.5\n",
        "[kind.odd\n",
    ],
)
def test_rules_that_cannot_be_are_refused_in_one_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_rules(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


ODD = "[kind.odd]\nchange = {{ {} }}\nleast = 0.1\nwarning = 0.2\ncritical = 0.3\n{}\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[kind.collision]\nleast = nan\n", "[kind.collision] least is a finite number"),
        ("[kind.collision]\nleast = -1\n", "[kind.collision] least is above 0"),
        ("[kind.collision]\nlongest = -1\n", "[kind.collision] longest is 0 or more"),
        ("[kind.collision]\nwarning = 10\n", "[kind.collision] least, warning, critical do not"),
        ("[kind.joint_backlash]\nwarning = 1\n", "[kind.joint_backlash] least, warning, critical"),
        ("[kind.joint_backlash]\npromise = 0\n", "[kind.joint_backlash] promise is above 0"),
        ("[kind.joint_backlash]\nenough = 0\n", "[kind.joint_backlash] enough is 1 or more"),
        (
            "[kind.controller_instability]\nlowest = 0\n",
            "[kind.controller_instability] lowest is above 0 and",
        ),
        (
            "[kind.controller_instability]\nlowest = 1e4\n",
            "[kind.controller_instability] lowest is above 0 and",
        ),
        (
            "[kind.controller_instability]\nthreshold = 0\n",
            "[kind.controller_instability] threshold is above 0",
        ),
        ("[kind.sensor_silent]\nlasting = 0\n", "[kind.sensor_silent] lasting is above 0"),
        ("[kind.friction_increase]\nleast = 0.3\n", "[kind.friction_increase] least, warning"),
        ("[kind.friction_increase]\nsign = 2\n", "[kind.friction_increase] sign is -1, 0 or 1"),
        ("[kind.friction_increase]\nshapes = []\n", "[kind.friction_increase] shapes are step"),
        ("[kind.friction_increase]\nshapes = [['step']]\n", "[kind.friction_increase] shapes"),
        (ODD.format("f = nan", ""), "[kind.odd] change f is a finite number"),
        (ODD.format("f = 0.0", ""), "[kind.odd] change f is above 0"),
        (ODD.format("f = -0.5", ""), "[kind.odd] change f is above 0"),
        (ODD.format("f = 1e300", ""), "[kind.odd] change f is a finite number"),
        (ODD.format("f = 0.5", "hold = -1.0"), "[kind.odd] hold is 0 or more"),
        (ODD.format("f = 0.5", "family = 'drive'"), "[kind.odd] family is one of payload"),
        (ODD.format("f = 0.5", "family = 'health'"), "[kind.odd] family health changes z"),
        (ODD.format("mass = 0.5", "family = 'joint'"), "[kind.odd] family is payload where"),
        (ODD.format("z = 0.5", "family = 'sensor'"), "[kind.odd] family sensor has sign 1"),
        ('[kind.""]\nchange = { f = 1.0 }\n', '[kind.""] needs a name'),
        ("[kind.collision]\nchange = { f = 1.0 }\n", "[kind.collision] takes no change"),
        (
            "[kind.odd]\nchange = { f = 1.0 }\nleast = 0.1\n",
            "[kind.odd] has no warning and no crit",
        ),
        ("[healthy]\nf = { day = nan }\n", "[healthy] f day is a finite number"),
        ("[healthy]\nf = { day = -0.1 }\n", "[healthy] f day is 0 or more"),
        ("[warmth]\nlag = -1\n", "[warmth] lag is 0 or more"),
        ("[noise]\nshare = 1.1\n", "[noise] share is from 0 to 1"),
        ("[noise]\nlasting = 0\n", "[noise] lasting is above 0"),
        ("[promise]\nhours = inf\n", "[promise] hours is a finite number"),
        ("[promise]\nhours = -1\n", "[promise] hours is above 0"),
        ("[costs]\nstop = 0\n", "[costs] stop is above 0"),
        ("[costs]\nnotice = 3000.0\n", "[costs] the horizon is to be longer than the notice"),
        ("[named]\nodd = [1, 2]\n", "[named] has odd"),
    ],
)
def test_a_number_that_cannot_be_is_named_by_its_key(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_rules(path)
    assert str(caught.value).startswith(f"{path}: {said}") and "\n" not in str(caught.value)


def test_the_rules_of_the_house_can_be_copied_and_changed(tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_bytes(b"\xef\xbb\xbf" + Path(rules.__file__).with_suffix(".toml").read_bytes())
    assert read_rules(path) == read_rules()


def test_a_finding_that_was_seen_is_quiet_until_it_gets_worse(shop: Shop, tmp_path: Path) -> None:
    log = shop.log("sensor_fault:joint=3,mode=stuck,onset=3", seconds=5.0)
    of = shop.diagnosis(log)
    session = Session(Job(of.fit, of.period, of.rules, tmp_path, 0, {"twin": "a"}, {}))
    for now in instants(shop, log):
        series = [getattr(now.instant, name) for name in NAMES[1:]]
        session.take(np.concatenate([[now.instant.t], *series, now.s, now.travelled]))
    session.finish()
    (finding,) = session.write()["findings"]
    assert not finding["acknowledged"]
    acknowledge(tmp_path, finding["id"])
    told = json.loads((tmp_path / "findings.json").read_text())
    assert told == session.write()  # what is advised, too, is as tracking again would have it
    known, kept = acknowledged(tmp_path), Finding(**finding | {"size_sd": np.nan})
    assert known.quiets(kept)
    assert not known.quiets(replace(kept, size=2.0 * kept.size))
    with pytest.raises(InputError, match="no finding"):
        acknowledge(tmp_path, "collision.nothing")
    session.finish()  # of a run that found it again
    assert acknowledged(tmp_path).quiets(kept)
    (other := tmp_path / "tuesday").mkdir()
    shutil.copy(tmp_path / "acknowledged.json", other)
    tuesday = Session(replace(session.job, folder=other, identity={"source": "b"}))
    tuesday._state = session._state  # another run that found it
    assert tuesday.write()["findings"][0]["acknowledged"] and not tuesday.untold([kept])
    Session(replace(session.job, index=0)).finish()  # and of one that did not: repaired, maybe
    assert not acknowledged(tmp_path).quiets(kept)


def test_pushes_on_one_link_are_acknowledged_together(tmp_path: Path) -> None:
    ids = [f"collision.{at}" for at in ("tool0@2.7", "tool0@13.5", "tool0_plate@6.3")]
    pushes = [replace(FOUND, id=name, kind="collision", name=name.split("@")[0]) for name in ids]
    document = findings_document(pushes, ("a", "b", "c"), [True] * 3, (), {}, {}, read_rules())
    (tmp_path / "findings.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"no finding 'collision.tool'; there is collision.tool0@"):
        acknowledge(tmp_path, "collision.tool")
    done = CliRunner().invoke(app, ["acknowledge", str(tmp_path), "collision.tool0"])
    assert done.output == "collision.tool0: acknowledged at warning, 2 findings\n"
    told = json.loads((tmp_path / "findings.json").read_text())["findings"]
    assert [f["acknowledged"] for f in told] == [True, True, False]
    assert list(acknowledged(tmp_path).seen) == ids[:2]


@pytest.mark.parametrize(
    ("name", "seen"),
    [
        ("gain.a", ["gain.a"]),
        ("gain.a@b", ["gain.a@b"]),
        ("push.a", ["push.a@2.7"]),
        ("push.a@b", ["push.a@b@2.7", "push.a@b@-13.5"]),
        ("push.a@b@2.7", ["push.a@b@2.7"]),
    ],
)
def test_a_part_whose_name_looks_stamped_is_acknowledged_alone(
    name: str, seen: list[str], tmp_path: Path
) -> None:
    ids = ("gain.a", "gain.a@b", "push.a@2.7", "push.a@b@2.7", "push.a@b@-13.5")
    each = [replace(FOUND, id=known) for known in ids]
    document = findings_document(each, ("a", "b", "c"), [True] * 3, (), {}, {}, read_rules())
    (tmp_path / "findings.json").write_text(json.dumps(document))
    assert [finding["id"] for finding in acknowledge(tmp_path, name)] == seen


def test_what_was_acknowledged_is_not_told_again_by_chance() -> None:
    sd, blocks = 0.03, 1000
    seen, *later = sd * np.random.default_rng(0).standard_normal(1 + blocks)
    known = Acknowledged({FOUND.id: {"severity": "notice", "size": seen}})
    small = replace(FOUND, severity="notice", size_sd=sd)
    loud = np.mean([not known.quiets(replace(small, size=x)) for x in later])
    beyond = 2.0 * norm.sf(2.0)  # of what has not changed, whatever it was when it was seen
    assert loud < beyond + 4.0 * np.sqrt(beyond / blocks)
    assert not known.quiets(replace(small, size=WORSE * abs(seen) + 2.1 * sd))


@pytest.mark.parametrize("ended", [False, True])
@pytest.mark.parametrize("gone", [False, True])
def test_what_was_acknowledged_and_is_gone_is_told_when_it_comes_back(
    tmp_path: Path, gone: bool, ended: bool
) -> None:
    """In the same run, too; what was not found yet is gone only once the run has ended."""
    other = replace(FOUND, id="yet to be found")
    seen = {f.id: {"severity": f.severity, "size": f.size} for f in (FOUND, other)}
    (tmp_path / "acknowledged.json").write_text(json.dumps(seen))
    forget_gone(tmp_path, [replace(FOUND, size=0.01, severity="notice", gone=gone)], ended)
    known = acknowledged(tmp_path)
    assert (known.quiets(FOUND), known.quiets(other)) == (not gone, not ended)


def test_what_was_acknowledged_is_forgotten_while_the_run_goes_on(
    shop: Shop, tmp_path: Path
) -> None:
    session = Session(Job(shop.fit, 0.01, read_rules(), tmp_path, 0, {}, {}))
    (tmp_path / "acknowledged.json").write_text(
        json.dumps({FOUND.id: {"severity": FOUND.severity, "size": FOUND.size}})
    )
    for gone in (False, True):
        book = replace(session._state.book, findings=(replace(FOUND, gone=gone),))
        session._state = replace(session._state, book=book)
        session.write()
        assert bool(session.untold([FOUND])) == gone


@pytest.mark.parametrize(
    "text", ['{"findings": 5}', '{"findings": [{"id": [1]}]}', '{"findings": [{"id": "a"}]}', "x"]
)
def test_findings_that_were_edited_are_refused_and_nothing_is_acknowledged(
    tmp_path: Path, text: str
) -> None:
    (tmp_path / "findings.json").write_text(text)
    with pytest.raises(InputError, match=str(tmp_path)):
        acknowledge(tmp_path, "a")
    assert not acknowledged(tmp_path).seen


def test_what_was_acknowledged_says_how_bad_it_was(tmp_path: Path) -> None:
    (tmp_path / "acknowledged.json").write_text('{"a": {"severity": "warning", "size": "big"}}')
    with pytest.raises(InputError, match="remove it"):
        acknowledged(tmp_path)


def test_what_shows_again_began_when_it_did_first(shop: Shop) -> None:
    diagnosis, found = Diagnosis(shop.fit, 0.01), []
    state = diagnosis.init()
    for t in (5.0, 40.0):
        stuck = Event("sensor_fault", 2, t, t + 0.3, 10.0, 0.99, {"mode": "stuck", "value_A": 1.0})
        state, found = diagnosis._told(state, [stuck])
    (kept,) = state.findings
    assert (kept.onset_s, kept.alarm_s) == (5.0, 5.3) and "since stamp 5.0 s" in kept.text
    assert not found  # and is not told again


def test_the_time_left_holds_the_truth_as_often_as_it_says() -> None:
    rng, inside, runs = np.random.default_rng(3), 0, 400
    for _ in range(runs):
        rate, size = 1e-3 + 1e-4 * rng.standard_normal(), 0.2 + 0.01 * rng.standard_normal()
        left = Course(0.0, size, 0.01, rate, 1e-4).until(0.5)
        inside += left["lo"] <= 0.3 / 1e-3 <= left["hi"]
    assert abs(inside / runs - 0.9) < 4.0 * np.sqrt(0.09 / runs)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_fan_crosses_a_level_when_the_time_left_says(way: float) -> None:
    told = Course(60.0, way * 0.2, 0.01, way * 1e-3, 1e-4).forecast(0.3, 0.5)
    assert told is not None
    ahead = np.array(told["ahead_s"])
    fan = way * np.array([told["quantiles"][f"{q:g}"] for q in FAN])
    assert np.all(np.diff(fan, axis=0) > 0.0)  # never across one another
    for level in ("warning", "critical"):
        left, at = told[f"to_{level}_s"], way * told[level]
        for q, name in ((0.05, "hi"), (0.5, "median"), (0.95, "lo")):
            # of the same draws: of two quantiles of 2000, interpolated between moments
            crossed = np.interp(at, fan[FAN.index(q)], ahead)
            assert crossed == pytest.approx(left[name], rel=0.01)


@pytest.mark.parametrize("rate", [0.0, 1.9e-4, -1e-3])
def test_nothing_is_forecast_of_what_may_not_grow(rate: float) -> None:
    assert Course(0.0, 0.2, 0.01, rate, 1e-4).forecast(0.3, 0.5) is None


@pytest.mark.parametrize(
    ("size", "sd", "now"),
    [(0.21, 0.03, "warning"), (0.19, 0.03, "warning"), (0.13, 0.03, "notice")],
)
def test_a_severity_does_not_flicker_at_its_level(
    shop: Shop, size: float, sd: float, now: str
) -> None:
    log = shop.log(seconds=2.0)
    diagnosis = shop.diagnosis(log)
    k = next(k for k, s in enumerate(diagnosis.slow.of.each) if s.kind.warning == 0.2)
    suspect = diagnosis.slow.of.each[k]
    change = Change(k, 0.0, (-1.0, 1.0), (-1.0, 1.0), 5.0, 0.99, 9.0, 0.25, 0.01, 0.0, 0.0)
    warned = of_change(change, diagnosis.slow.of, diagnosis.space, diagnosis.rules, [])
    series = {k: [(10.0, size, sd)]}
    (told,) = up_to_date([warned], {k: suspect}, series, diagnosis.space, 12.5, {k: 0.0})
    assert (warned.severity, told.severity, told.size) == ("warning", now, size)


@pytest.mark.parametrize(
    ("onset", "pause", "since"),
    [
        (46.3, None, "since stamp 46.3 s"),
        (46.3, (50.0, 110.0), "since stamp 46.3 s, or the pause before stamp 110.0 s"),
        (80.0, (50.0, 110.0), "since the pause before stamp 110.0 s"),
    ],
)
def test_a_change_that_may_have_come_in_a_pause_is_told_so(
    shop: Shop, onset: float, pause: tuple[float, float] | None, since: str
) -> None:
    diagnosis = shop.diagnosis(shop.log(seconds=2.0))
    of = diagnosis.slow.of
    k = next(k for k, s in enumerate(of.each) if s.kind.name == "viscous_friction")
    span = (32.9, 112.0)
    change = Change(k, onset, span, span, 124.0, 0.99, 9.0, 0.2, 0.03, 0.0, 0.0, pause=pause)
    found = of_change(change, of, diagnosis.space, diagnosis.rules, [])
    series = {k: [(130.0, 0.19, 0.03)]}
    (later,) = up_to_date([found], {k: of.each[k]}, series, diagnosis.space, 130.0, {k: 0.0})
    for finding in (found, later):
        assert since in finding.text
        assert finding.pause_s == pause


@pytest.mark.parametrize(
    ("began", "pause"),
    [
        ((0.0, 9.0), None),
        ((7.0, 30.0), (10.0, 70.0)),
        ((80.0, 90.0), None),
        ((0.0, 90.0), (10.0, 70.0)),
    ],
)
def test_a_pause_is_as_long_as_a_restart_and_lies_where_a_change_may_have_begun(
    began: tuple[float, float], pause: tuple[float, float] | None
) -> None:
    nothing = np.zeros((1, 1)), np.zeros(1)
    begins = 0.0, 5.0, 70.0, 77.0, 82.0, 117.0  # rests of 60, 2 and 30 s
    blocks = tuple(Block(t, t + 5.0, *nothing) for t in begins)
    assert Recall(np.nan, np.zeros(1), np.eye(1), blocks).pause(*began) == pause


def found_then(
    shop: Shop, kind: str, size: float, sd: float, series: Series, now: float
) -> Finding:
    """A change of this kind and size that was found at 5 s, as its series has it `now` [s]."""
    diagnosis = shop.diagnosis(shop.log(seconds=2.0))
    of = diagnosis.slow.of
    k = next(k for k, s in enumerate(of.each) if s.kind.name == kind)
    change = Change(k, 0.0, (-1.0, 1.0), (-1.0, 1.0), 5.0, 0.99, 9.0, size, sd, 0.0, 0.0)
    found = of_change(change, of, diagnosis.space, diagnosis.rules, [])
    (then,) = up_to_date([found], {k: of.each[k]}, {k: series}, diagnosis.space, now, {k: 0.0})
    return then


def test_a_finding_is_as_sure_as_its_name_and_its_text_tells_a_90_percent_interval(
    shop: Shop,
) -> None:
    """A bias is told as a share of friction: how well that is known counts, too."""
    diagnosis = shop.diagnosis(shop.log(seconds=2.0))
    of = diagnosis.slow.of
    k = next(k for k, s in enumerate(of.each) if s.kind.name == "sensor_fault")
    suspect = replace(of.each[k], doubt=0.1)
    named = replace(of, each=(*of.each[:k], suspect, *of.each[k + 1 :]))
    change = Change(k, 0.0, (-1.0, 1.0), (-1.0, 1.0), 5.0, 0.99, 9.0, 0.5, 0.05, 0.0, 0.0)
    found = of_change(change, named, diagnosis.space, diagnosis.rules, [])
    size, sd = suspect.read(0.5, 0.05)
    assert found.size_sd == pytest.approx(np.hypot(sd, 0.1 * size))
    assert f"± {NORMAL90 * found.size_sd:.2g} " in found.text
    right = trust("sensor_fault", diagnosis.rules.named)
    assert right < 1.0 and found.confidence == pytest.approx(0.99 * right)


def test_a_change_has_the_size_of_the_last_block_that_tells_it(shop: Shop) -> None:
    """Once one that may as well be nothing was critical, at +0.3 % ± 181 %."""
    before, blind, told = (-2.5, 0.0, 0.03), (12.5, -0.003, 1.1), (7.5, 0.6, 0.03)
    for series, size in (([before], 0.78), ([before, blind], 0.78), ([told, blind], 0.6)):
        now = found_then(shop, "sensor_gain", 0.78, 0.02, series, 15.0)
        assert (now.severity, now.size) == ("critical", -size) and now.size_sd < 0.1


def test_what_is_repaired_is_gone_however_long_its_joint_was_sound_before(shop: Shop) -> None:
    """And a notice, though its block alone could not say that it is no warning."""
    sound, broken = (
        [(5.0 * k, x, 0.09) for k in ks] for x, ks in ((0.0, range(-48, 1)), (1.9, range(1, 12)))
    )
    now = found_then(shop, "sensor_fault", 1.9, 0.09, [*sound, *broken, (60.0, 0.1, 0.09)], 62.5)
    assert now.gone and now.severity == "notice"


@pytest.mark.parametrize(("sd", "severity"), [(0.05, "critical"), (0.02, "warning")])
def test_what_may_still_be_at_a_level_that_it_had_says_so(
    shop: Shop, sd: float, severity: str
) -> None:
    series = [(5.0 * k, x, sd) for k, x in enumerate((0.55, 0.55, 0.55, 0.41), 1)]
    now = found_then(shop, "friction_increase", 0.55, sd, series, 22.5)
    assert now.severity == severity
    assert now.text.endswith(", and may still be at the critical level") == (severity == "critical")


def test_a_rate_is_told_as_what_people_read_grows(shop: Shop) -> None:
    """A sensor's bank has the current that is missing: what is read of it falls as that rises."""
    diagnosis = shop.diagnosis(shop.log(seconds=2.0))
    of, step = diagnosis.slow.of, 1e-6
    for k, suspect in enumerate(of.each):
        size = 0.1 * suspect.unit
        (before, _), (after, _) = (
            suspect.read(size + d * suspect.unit, 0.0) for d in (-step, step)
        )
        slope = (after - before) / (2.0 * step * suspect.unit)
        assert suspect.slope(size) == pytest.approx(slope, rel=1e-5)
        assert suspect.read(size, 2.0)[1] == pytest.approx(2.0 * abs(slope), rel=1e-5)
        if suspect.kind.of_friction or suspect.kind.of_tool:
            continue  # of all friction, and of no rate
        change = Change(k, 0.0, (0.0, 0.0), (0.0, 0.0), 5.0, 0.99, 9.0, size, 0.01, 0.02, 0.01)
        told = of_change(change, of, diagnosis.space, diagnosis.rules, [])
        assert told.evidence["rate_per_s"] == pytest.approx(0.02 * slope, rel=1e-5)


def test_every_rival_of_a_change_has_a_name_of_its_own(shop: Shop) -> None:
    """Kinds that are told as one are two rivals."""
    diagnosis = shop.diagnosis(shop.log(seconds=2.0))
    of = diagnosis.slow.of
    rivals = tuple((k, 0.1) for k in range(1, len(of.each)))
    change = Change(0, 0.0, (-1.0, 1.0), (-1.0, 1.0), 5.0, 0.9, 9.0, 0.3, 0.01, 0.0, 0.0)
    told = of_change(replace(change, rivals=rivals), of, diagnosis.space, diagnosis.rules, [])
    names = {(rival["kind"], rival["joint"]) for rival in told.evidence["rivals"]}
    assert len(names) == len(rivals)


def test_friction_that_falls_below_its_first_day_is_no_failure_to_come(shop: Shop) -> None:
    falling = [(10.0 * n, 0.3 - 0.1 * n, 0.01) for n in range(9)]
    now = found_then(shop, "friction_increase", 0.3, 0.01, falling, 85.0)
    assert now.size < -0.3 and now.severity == "notice"
    assert now.forecast is None and now.time_to_failure_s is None


def test_a_straight_series_goes_on_straight_and_a_short_one_is_none() -> None:
    series = [(5.0 * k, 1e-3 * 5.0 * k, 1e-3) for k in range(40)]
    course = trend(series, onset=0.0, now=197.5)  # half a block after the middle of the last one
    assert course is not None
    assert (course.t, course.size, course.rate) == pytest.approx((197.5, 0.1975, 1e-3))
    assert trend(series, onset=180.0, now=197.5) is None


@pytest.mark.parametrize("blocks", [5, 8, 12, 20])
@pytest.mark.parametrize("over", [2.0, 7.0, 12.0])
def test_what_has_stopped_growing_has_no_forecast(blocks: int, over: float) -> None:
    """A step that a block saw half of, too, and a ramp; one that goes on has a forecast."""
    rng, t = np.random.default_rng(4), 5.0 * np.arange(blocks) + 2.5
    for grown, goes_on in ((np.minimum(t / over, 1.0), False), (t / t[-1], True)):
        size = 0.2 * grown + 0.004 * rng.standard_normal(blocks)
        course = trend([(*row, 0.01) for row in zip(t, size, strict=True)], 0.0, t[-1] + 2.5)
        assert course is not None and course.grows == goes_on
        assert (course.forecast(0.1, 0.5) is not None) == goes_on


@pytest.mark.parametrize("rate", [20.0, 25.0, 50.0, 62.5, 100.0, 125.0, 250.0, 500.0])
def test_a_moment_lasts_half_a_second_at_any_rate(rate: float) -> None:
    """125 Hz divide into no quarter of a second, and a beat that waits for it takes two."""
    of, t = Pace(1.0 / rate), 7.3 + np.arange(2.0 * rate) / rate

    def rows(least: float, step: int) -> int:
        """As many as that takes, of rows that come so many at a time."""
        return next(n for n in range(step, len(t), step) if of.lasted(t[0], t[n - 1], least))

    for step in (of.beat, of.chunk):  # at once, and live
        beat = rows(BEAT, step)
        assert abs(beat / rate - BEAT) <= 0.1 * BEAT or beat == of.beat
        assert rows(MOMENT, beat) == 2 * beat
