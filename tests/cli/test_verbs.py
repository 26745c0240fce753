"""What a user does, from a recording to a twin that is judged."""

from __future__ import annotations

import hashlib
import html
import json
import math
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from story import ROOT, Story, urdyn
from typer.testing import CliRunner

import urdyn as ud
from urdyn.cli.app import app
from urdyn.identify import Fit
from urdyn.model.arm import Arm
from urdyn.report.identify.doubts import unlike

QUANTITY = {"value", "sd", "unit"}


def command(*words: object) -> str:
    """Standard output of a verb that must succeed."""
    result = CliRunner().invoke(app, list(map(str, words)))
    assert result.exit_code == 0, result.stderr
    return result.stdout


def test_identify_prints_one_object_and_writes_three_files(story: Story) -> None:
    found = json.loads(story.identified.stdout)
    assert found["robot"] == "ur10e" and found["n_samples"] == 1200
    assert 0 < found["rank"] <= found["n_parameters"] and found["wall_s"] > 0.0
    assert len(found["drive_gain"]) == len(found["joints"]) == len(found["links"]) == 6
    for joint in found["joints"]:
        for quantity in ("coulomb", "viscous", "structural", "offset", "rotor_inertia"):
            assert joint[quantity].keys() >= QUANTITY
    for link in found["links"]:
        assert link["mass"].keys() >= {"value", "sd", "prior", "prior_sd", "informed"}
        assert 0.0 <= link["mass"]["informed"] <= 1.0
        assert (len(link["com"]), len(link["inertia"])) == (3, 6)
    assert found["payload"] is None
    written = {path.name for path in story.out.iterdir()}
    assert written == {"twin.toml", "identified.urdf", "report.html"}


def test_what_is_meant_for_people_goes_aside_under_json(story: Story) -> None:
    assert "shoulder pan" in story.identified.stderr
    assert "written to" in story.identified.stderr


def test_what_arms_of_a_type_hardly_have_is_told(identified: Fit) -> None:
    """Four standard deviations of their masses and gains are."""
    table, sd = identified.parameters, identified.prior_sd
    heavy = np.array([name == "upper_arm_link.mass" for name in table.names])
    other = replace(table, values=np.where(heavy, identified.prior + 4.1 * sd, table.values))
    [said] = unlike(replace(identified, parameters=other))
    assert said.startswith("upper_arm_link.mass is") and "this is no ur5e" in said
    assert "a tool is mounted, and is part of this twin" in said
    [said] = unlike(replace(identified, parameters=other, tool_known=True))
    assert "tool has another mass or centre than was named" in said and "mounted" not in said
    assert unlike(identified) == []
    heavy = np.array([name.endswith("_arm_link.mass") for name in table.names])
    heavy |= np.array([name == "forearm_link.mass" for name in table.names])
    other = replace(table, values=np.where(heavy, identified.prior + 4.1 * sd, table.values))
    [said] = unlike(replace(identified, parameters=other))
    assert said.startswith("2 of 12 masses and drive gains are what such arms hardly have: this is")


def test_what_a_mass_is_unsure_by_grows_with_it(identified: Fit) -> None:
    """A link that is twice as heavy, and twice as unsure, was told as much of."""
    name = "forearm_link.mass"
    at = identified.parameters.names.index(name)
    twice = np.where(np.arange(len(identified.sd)) == at, 2.0, 1.0)
    table = replace(identified.parameters, values=twice * identified.parameters.values)
    heavier = replace(identified, parameters=table, sd=twice * identified.sd)
    assert 0.0 < identified.informed(name) == pytest.approx(heavier.informed(name))


@pytest.mark.slow
def test_another_robot_than_the_log_s_is_told(story: Story, tmp_path: Path) -> None:
    other = ("--robot", "ur3e", "--out", tmp_path, "--rows", "0:600")
    told = CliRunner().invoke(app, ["identify", str(story.log), *map(str, other)])
    assert told.exit_code == 0 and "this is no ur3e" in " ".join(told.stderr.split())
    assert "this is no" not in story.identified.stderr


def test_identification_finds_the_simulated_friction(story: Story) -> None:
    found = json.loads(story.identified.stdout)["joints"]
    truth = json.loads(story.truth.read_text())["joints"]
    z = [
        (mine[q]["value"] - true[q]) / mine[q]["sd"]
        for mine, true in zip(found, truth, strict=True)
        for q in ("coulomb", "viscous", "structural", "offset", "rotor_inertia")
    ]
    # The mean square of 30 scores is 1 with a standard deviation of sqrt(2 / 30) = 0.26.
    assert np.mean(np.square(z)) < 1.0 + 4.0 * math.sqrt(2.0 / len(z))


def test_a_twin_predicts_another_motion_of_its_arm(story: Story, tmp_path: Path) -> None:
    twin, page = story.out / "twin.toml", tmp_path / "page"
    [score] = json.loads(command("validate", twin, story.held_out, "--json", "--out", page))["logs"]
    assert score["path"] == str(story.held_out) and score["n"] == 1200
    assert score["duration_s"] == pytest.approx(11.99)
    for key in ("rre_percent", "rmse_A", "noise_floor_percent", "coverage90"):
        assert len(score[key]) == 6
    assert np.all(np.less(score["rre_percent"], score["target_current_rre_percent"]))
    # 90 % of 1200 samples: two thirds of a percent is one standard deviation, for white noise.
    assert np.all(np.abs(np.subtract(score["coverage90"], 0.9)) < 0.05)
    assert [path.name for path in page.iterdir()] == ["validation.html"]  # no twin's own page
    assert (page / "validation.html").stat().st_size > 1e5


def test_another_arm_s_log_is_told_from_this_one_s(story: Story, tmp_path: Path) -> None:
    twin, log = story.out / "twin.toml", tmp_path / "other.parquet"
    command("simulate", "--robot", "ur5e", "--duration", 6, "--rate", 100, "--out", log)
    out = "--out", tmp_path / "run"
    as_named = "identify", log, "--robot", "ur10e", *out
    for verb in ("validate", twin, log), ("track", twin, log, *out), as_named:
        refused = CliRunner().invoke(app, list(map(str, verb)))
        assert refused.exit_code == 1 and "where a ur5e has its tool" in refused.stderr
    only = ("timestamp", "actual_q", "actual_qd", "actual_current")
    ud.write(ud.read(log, channels=only), log := tmp_path / "currents.parquet")
    said = command("validate", twin, log)
    assert "joints intervals for 90 % of the currents hold less than half" in said
    doubt = json.loads(command("validate", twin, log, "--json"))["doubt"]
    assert doubt in said and "this is not this arm's twin" in doubt
    assert doubt in CliRunner().invoke(app, ["validate", str(twin), str(log), "-q"]).stderr
    assert "doubt" not in json.loads(command("validate", twin, story.held_out, "--json"))


def test_the_command_on_a_page_makes_it_again(story: Story, tmp_path: Path) -> None:
    page = tmp_path / "a page" / "validation.html"
    urdyn("validate", story.out / "twin.toml", story.log, "--rows=100:700", "--out", page.parent)
    before = page.read_text()
    told = re.search(r"To reproduce:</p>\s*<pre><code>(.*?)</code>", before)
    page.unlink()
    urdyn(*shlex.split(html.unescape(told.group(1)))[1:])
    assert page.read_text() == before


def test_a_slice_is_scored_by_its_rows(story: Story) -> None:
    told = command("validate", story.out / "twin.toml", story.log, "--rows", "100:700", "--json")
    assert json.loads(told)["logs"][0]["n"] == 600


def test_quiet_says_nothing(story: Story) -> None:
    result = CliRunner().invoke(
        app, ["validate", str(story.out / "twin.toml"), str(story.log), "-q"]
    )
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device here")
@pytest.mark.parametrize("how", [(), ("--json",)])
def test_results_that_find_no_room_are_told_by_their_place(
    how: tuple[str, ...], story: Story
) -> None:
    asked = (sys.executable, "-m", "urdyn", "validate", story.out / "twin.toml", story.log, *how)
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(asked, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "urdyn: standard output: No space left on device"


def test_the_identified_arm_loads_elsewhere(story: Story) -> None:
    twin = ud.Twin.load(story.out / "twin.toml")
    path = story.out / "identified.urdf"
    np.testing.assert_allclose(ud.load_arm(path).inertials, twin.fit.dynamics.inertials, rtol=1e-9)


@pytest.mark.parametrize("reader", ["pinocchio", "yourdfpy", "mujoco"])
def test_the_urdf_loads_in_other_tools(reader: str, story: Story) -> None:
    module, path = pytest.importorskip(reader), str(story.out / "identified.urdf")
    match reader:
        case "pinocchio":
            assert module.buildModelFromUrdf(path).nq == 6
        case "yourdfpy":
            arm = module.URDF.load(path, build_scene_graph=False, load_meshes=False)
            assert len(arm.actuated_joint_names) == 6
        case "mujoco":
            assert module.MjModel.from_xml_path(path).nv == 6


def test_simulate_is_the_library_s(story: Story, tmp_path: Path) -> None:
    made, _ = ud.simulate(ud.load_arm("ur10e"), 12.0, 100.0, 3)
    ud.write(made, tmp_path / "run.csv")
    told = json.loads(story.simulated.stdout)
    assert told["sha256"] == hashlib.sha256((tmp_path / "run.csv").read_bytes()).hexdigest()
    assert told["n"] == 1200 and told["truth"] == json.loads(story.truth.read_text())


def test_a_twin_can_be_simulated(story: Story, tmp_path: Path) -> None:
    twin, log = story.out / "twin.toml", tmp_path / "again.parquet"
    how = ("--duration", 12, "--rate", 100, "--noise", 0, "--seed", 8)
    command("simulate", "--twin", twin, *how, "--out", log)
    [score] = json.loads(command("validate", twin, log, "--json"))["logs"]
    assert max(score["rre_percent"]) < 2.0  # what smoothing leaves: there is no noise


def test_a_payload_and_a_trajectory_can_be_simulated(tmp_path: Path) -> None:
    way, log = tmp_path / "way.csv", tmp_path / "log.csv"
    way.write_text("t,q0,q1,q2,q3,q4,q5\n0,0,-1.5,1,0,0,0\n2,0.5,-1.2,1,0,0,0.5\n")
    load = ("--payload-mass", 2, "--payload-com", "0,0.01,0.05")
    told = command(
        "simulate",
        "--robot",
        "ur5e",
        "--trajectory",
        way,
        "--rate",
        100,
        *load,
        "--out",
        log,
        "--json",
    )
    payload = json.loads(told)["truth"]["payload"]
    assert payload["mass"] == 2.0
    np.testing.assert_allclose(payload["com"], [0.0, 0.01, 0.05])
    assert ud.read(log).joint("actual_q")[-1, 0] == pytest.approx(0.5, abs=1e-4)


RECIPE = """robot = "ur5e"
out = "results"
[simulate]
duration = 6.0
rate = 100
seed = 1
payload_mass = 2.0
"""


def carried_out(said: str, folder: Path) -> None:
    """What a campaign of that recipe tells, and writes."""
    found = json.loads(said)
    assert found["robot"] == "ur5e" and found["payload"]["mass"] == pytest.approx(2.0, abs=0.001)
    assert [Path(log["path"]).name for log in found["logs"]] == [
        "excitation.parquet",
        "loaded.parquet",
    ]
    assert (folder / "results" / "twin.toml").is_file()
    assert "held_out.parquet" in (folder / "results" / "report.html").read_text()


def test_a_campaign_scores_what_is_identified_of_what_it_simulated(
    identified: Fit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a fit that is at hand, of the same arm."""
    asked = []

    def identify(arm: Arm, *bare: ud.Motion, loaded: list[ud.Run], **how: object) -> Fit:
        asked.append(
            (arm.name, *map(len, bare), *((len(r.motion), r.payload.mass) for r in loaded))
        )
        return replace(identified, sources=(bare[0].source, *(r.motion.source for r in loaded)))

    monkeypatch.setattr(ud, "identify", identify)
    (tmp_path / "campaign.toml").write_text(RECIPE)
    carried_out(command("identify", tmp_path / "campaign.toml", "--json"), tmp_path)
    assert asked == [("ur5e", 600, (600, 2.0))]


@pytest.mark.slow
def test_a_campaign_simulates_identifies_and_scores(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(RECIPE)
    done = urdyn("identify", tmp_path / "campaign.toml", "--json")
    assert done.returncode == 0, done.stderr
    carried_out(done.stdout, tmp_path)


@pytest.mark.parametrize("path", sorted(ROOT.glob("identification/*/campaign.toml")), ids=str)
def test_every_campaign_can_be_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from urdyn.cli.campaign import read_campaign

    monkeypatch.delenv("URDYN_RECORDINGS", raising=False)
    if "URDYN_RECORDINGS" in path.read_text():
        with pytest.raises(ud.UrdynError, match="skipped: set URDYN_RECORDINGS to the folder"):
            read_campaign(path)
    else:
        assert read_campaign(path).robot == path.parent.name


def told_of_it(said: str, out: Path) -> None:
    """What a demo tells, and where its page is."""
    assert "true values lie inside" in said
    assert str(out / "report.html") in said
    assert (out / "report.html").is_file()


def test_the_demo_says_what_was_found(
    identified: Fit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a fit that is at hand, of the same arm."""
    monkeypatch.setattr(ud, "identify", lambda *of, **how: identified)
    out = tmp_path / "demo"
    told_of_it(command("demo", "--robot", "ur5e", "--seed", 1, "--out", out), out)


@pytest.mark.slow
def test_the_demo_goes_the_whole_way(tmp_path: Path) -> None:
    done = urdyn("demo", "--out", tmp_path / "demo")
    assert done.returncode == 0, done.stderr
    told_of_it(done.stdout, tmp_path / "demo")
