"""Whatever is wrong with an input: one line that says so, status 1, and nothing left behind."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from story import Story
from typer.testing import CliRunner

from urdyn.cli.app import app

Text = Callable[[Story], str]

TO = "--robot ur10e --out {tmp}/out"
CAMPAIGN = 'robot = "ur10e"\n[[log]]\npath = "run.csv"\n'


def lines(story: Story) -> list[str]:
    return story.log.read_text().splitlines()


def log(edit: Callable[[list[str]], list[str]]) -> Text:
    """The sound log with its lines edited; the header is the first."""
    return lambda story: "\n".join(edit(lines(story))) + "\n"


def twin(pattern: str, replacement: str) -> Text:
    """The sound twin with the first match replaced."""

    def edit(story: Story) -> str:
        text = (story.out / "twin.toml").read_text()
        edited, count = re.subn(pattern, replacement, text, count=1)
        assert count, "the pattern is of this format"
        return edited

    return edit


def literally(text: str) -> Text:
    return lambda story: text


MASS = r'(name = "upper_arm_link.mass"\nvalue = )\S+'

# name: command line, and the text of {tmp}/x
BROKEN: dict[str, tuple[str, Text | None]] = {
    # logs
    "twin for a campaign": ("identify {twin}", None),
    "log absent": (f"identify {{tmp}}/none.csv {TO}", None),
    "log a folder": (f"identify {{tmp}} {TO}", None),
    "log empty": (f"identify {{tmp}}/x {TO}", literally("")),
    "log of prose": (f"identify {{tmp}}/x {TO}", literally("Dear robot,\nhow are you?\n")),
    "log of header only": (f"identify {{tmp}}/x {TO}", log(lambda rows: rows[:1])),
    "log of one row": (f"identify {{tmp}}/x {TO}", log(lambda rows: rows[:2])),
    "log too short": (f"identify {{tmp}}/x {TO}", log(lambda rows: rows[:100])),
    "log at rest": (f"identify {{tmp}}/x {TO}", log(lambda rows: still(rows))),
    "log without currents": (
        f"identify {{tmp}}/x {TO}",
        log(lambda rows: [rows[0].replace("actual_current", "other"), *rows[1:]]),
    ),
    "log without header": (f"identify {{tmp}}/x {TO}", log(lambda rows: rows[1:])),
    "log of another arm": (
        f"identify {{tmp}}/x {TO} --columns timestamp,actual_q*5,actual_qd*5,actual_current*5,-*29",
        log(lambda rows: rows[1:]),
    ),
    "same log twice": (f"identify {{log}} {{log}} {TO}", None),
    "payload log is the log": (f"identify {{log}} --payload-log {{log}} {TO}", None),
    # options
    "robot unknown": ("identify {log} --robot ur99 --out {tmp}/out", None),
    "robot a broken URDF": ("identify {log} --robot {tmp}/x --out {tmp}/out", literally("<robot")),
    "robot without links": (
        "identify {log} --robot {tmp}/x --out {tmp}/out",
        literally('<robot name="none"><link name="base"/></robot>'),
    ),
    "out a file": ("identify {log} --robot ur10e --out {tmp}/x", literally("mine")),
    "out below a file": ("identify {log} --robot ur10e --out {tmp}/x/y", literally("mine")),
    "rows of text": (f"identify {{log}} {TO} --rows a:b", None),
    "rows reversed": (f"identify {{log}} {TO} --rows 900:100", None),
    "rows negative": (f"identify {{log}} {TO} --rows=-5:100", None),
    "rows beyond the end": (f"identify {{log}} {TO} --rows 500:90000", None),
    "rate of a timed log": (f"identify {{log}} {TO} --rate 100", None),
    "columns too few": (f"identify {{log}} {TO} --columns timestamp,actual_q*6", None),
    "gains too few": (f"identify {{log}} {TO} --drive-gain 14,13,11", None),
    "gain negative": (f"identify {{log}} {TO} --drive-gain 14,13,11,10,-11,11", None),
    "gain not finite": (f"identify {{log}} {TO} --drive-gain 14,13,11,10,nan,11", None),
    "gain text": (f"identify {{log}} {TO} --drive-gain 14,13,eleven,10,11,11", None),
    "tool without its centre": (f"identify {{log}} {TO} --tool 1.2", None),
    "tool without half of its centre": (f"identify {{log}} {TO} --tool 1.2,0,0", None),
    "tool negative": (f"identify {{log}} {TO} --tool=-1.2,0,0,0.05", None),
    "tool text": (f"identify {{log}} {TO} --tool gripper", None),
    "campaign's tool without its mass": (
        "identify {tmp}/x.toml",
        literally("tool = {com = [0.0, 0.0, 0.05]}\n" + CAMPAIGN),
    ),
    "campaign's tool text": (
        "identify {tmp}/x.toml",
        literally('tool = {mass = 1.2, com = ["here"]}\n' + CAMPAIGN),
    ),
    "payload weightless": (
        f"identify {{log}} {TO} --payload-log {{held_out}} --payload-mass 0",
        None,
    ),
    "payload mass not finite": (
        f"identify {{log}} {TO} --payload-log {{held_out}} --payload-mass nan",
        None,
    ),
    # twins
    "twin absent": ("validate {tmp}/none.toml {log}", None),
    "twin truncated": (
        "validate {tmp}/x {log}",
        lambda s: (s.out / "twin.toml").read_text()[:4000],
    ),
    "twin of another format": ("validate {tmp}/x {log}", twin("format = 1", "format = 99")),
    "twin no twin": ("validate {tmp}/x {log}", literally('robot = "ur10e"\n')),
    "twin's urdyn a number": ("validate {tmp}/x {log}", literally("urdyn = 1\n")),
    "twin without noise": ("validate {tmp}/x {log}", twin(r"\[noise\]", "[music]")),
    "twin with a mass of nan": ("validate {tmp}/x {log}", twin(MASS, r"\1nan")),
    "twin with a negative mass": ("validate {tmp}/x {log}", twin(MASS, r"\1-3.0")),
    "twin with a mass of text": ("validate {tmp}/x {log}", twin(MASS, r'\1"heavy"')),
    "twin's covariance cut": (
        "validate {tmp}/x {log}",
        twin(r"(?s)(covariance = \[\n).*?\n", r"\1"),
    ),
    "twin's covariance ragged": (
        "validate {tmp}/x {log}",
        twin(r"(covariance = \[\n  \[)\S+ ", r"\1"),
    ),
    "twin of an unknown arm": ("validate {tmp}/x {log}", twin('name = "ur10e"', 'name = "ur99"')),
    "twin's gain zero": (
        "validate {tmp}/x {log}",
        twin(r'(elbow_joint.gain"\nvalue = )\S+', r"\g<1>0.0"),
    ),
    "twin's noise of three joints": (
        "validate {tmp}/x {log}",
        twin(r"(\[noise\]\nsd = ).*", r"\1[0.1, 0.1, 0.1]"),
    ),
    "validated log absent": ("validate {twin} {tmp}/none.csv", None),
    "validated log empty": ("validate {twin} {tmp}/x", literally("")),
    "validated log too short": ("validate {twin} {tmp}/x", log(lambda rows: rows[:100])),
    "validated rows reversed": ("validate {twin} {log} --rows 9:3", None),
    "validation into a file": ("validate {twin} {log} --out {tmp}/x", literally("mine")),
    "validated contact of no channel": ("validate {twin} {log} --contact tool_works", None),
    "validated contact of six": ("validate {twin} {log} --contact actual_q:1", None),
    "validated contact of no bit": ("validate {twin} {log} --contact bits:x", None),
    # campaigns
    "campaign absent": ("identify {tmp}/none.toml", None),
    "campaign no TOML": ("identify {tmp}/x.toml", literally("robot = \n")),
    "campaign without robot": ("identify {tmp}/x.toml", literally('[[log]]\npath = "run.csv"\n')),
    "campaign without log": ("identify {tmp}/x.toml", literally('robot = "ur10e"\n')),
    "campaign of no logs": ("identify {tmp}/x.toml", literally('robot = "ur10e"\nlog = []\n')),
    "campaign of a virtual arm and a real load": (
        "identify {tmp}/x.toml",
        literally('robot = "ur10e"\n[simulate]\n[[payload]]\npath = "x.toml"\n'),
    ),
    "campaign's log absent": ("identify {tmp}/x.toml", literally(CAMPAIGN)),
    "campaign's key unknown": ("identify {tmp}/x.toml", literally('robots = "ur10e"\n')),
    "campaign's log key unknown": ("identify {tmp}/x.toml", literally(CAMPAIGN + "mass = 2.0\n")),
    "campaign's robot a number": ("identify {tmp}/x.toml", literally("robot = 10\n")),
    "campaign's rows a list": ("identify {tmp}/x.toml", literally(CAMPAIGN + "rows = [1, 2]\n")),
    "campaign's gain text": (
        "identify {tmp}/x.toml",
        literally('drive_gain = ["strong"]\n' + CAMPAIGN),
    ),
    "campaign's contact a bit": ("identify {tmp}/x.toml", literally("contact = 3\n" + CAMPAIGN)),
    "campaign's variable unset": (
        "identify {tmp}/x.toml",
        literally(CAMPAIGN.replace("run.csv", "${URDYN_NOWHERE}/run.csv")),
    ),
    "campaign's seed negative": (
        "identify {tmp}/x.toml",
        literally('robot = "ur10e"\n[simulate]\nseed = -1\n'),
    ),
    "campaign's duration nothing": (
        "identify {tmp}/x.toml",
        literally('robot = "ur10e"\n[simulate]\nduration = 0.0\n'),
    ),
    # simulations
    "simulated for no time": ("simulate --robot ur10e --duration 0 --out {tmp}/l.csv", None),
    "simulated too fast": ("simulate --robot ur10e --rate 5000 --out {tmp}/l.csv", None),
    "simulated to no format": ("simulate --robot ur10e --duration 2 --out {tmp}/l.bag", None),
    "simulated into no folder": ("simulate --robot ur10e --duration 2 --out {tmp}/no/l.csv", None),
    "truth into no folder": (
        "simulate --robot ur10e --duration 2 --out {tmp}/l.csv --truth {tmp}/no/t.json",
        None,
    ),
    "poses into no folder": (
        "simulate --robot ur10e --duration 2 --out {tmp}/l.csv --poses {tmp}/no/p.csv",
        None,
    ),
    "truth over the log": (
        "simulate --robot ur5e --duration 1 --heat --out {tmp}/l.parquet --truth {tmp}/l.parquet",
        None,
    ),
    "poses over the log": (
        "simulate --robot ur5e --duration 1 --out {tmp}/l.csv --poses {tmp}/./l.csv",
        None,
    ),
    "truth over time of no event": (
        "simulate --robot ur5e --duration 1 --out {tmp}/l.csv --truth {tmp}/t.parquet",
        None,
    ),
    "truth to no format": ("simulate --robot ur10e --out {tmp}/l.csv --truth {tmp}/t.txt", None),
    "trajectory of text": (
        "simulate --robot ur10e --trajectory {tmp}/x --out {tmp}/l.csv",
        literally("t,q0\n0,left\n"),
    ),
    "noise negative": ("simulate --robot ur10e --noise -1 --out {tmp}/l.csv", None),
    "payload impossible": ("simulate --robot ur10e --payload-mass -2 --out {tmp}/l.csv", None),
    "payload com of two": (
        "simulate --robot ur10e --payload-mass 2 --payload-com 0,1 --out {tmp}/l.csv",
        None,
    ),
    "simulated twin broken": ("simulate --twin {tmp}/x --out {tmp}/l.csv", literally("a = 1\n")),
    # those who are told
    "serial number no text": (
        "track {twin} {log} --out {tmp}/out --mqtt 127.0.0.1:1 --serial \udcff",
        None,
    ),
    "serial number of none": ("track {twin} {log} --out {tmp}/out --mqtt 127.0.0.1:1", None),
    "no broker": ("track {twin} {log} --out {tmp}/out --serial 7 --mqtt=", None),
    "nowhere to serve": ("track {twin} {log} --out {tmp}/out --prometheus=", None),
    "no port": ("track {twin} {log} --out {tmp}/out --prometheus 0", None),
    "demo of an unknown arm": ("demo --robot ur99 --out {tmp}/out", None),
    "demo into a file": ("demo --out {tmp}/x", literally("mine")),
}


def still(rows: list[str]) -> list[str]:
    """The log of an arm that holds its first pose."""
    stamps = (row.split(",", 1)[0] for row in rows[1:])
    pose = rows[1].split(",", 1)[1]
    return [rows[0], *(f"{stamp},{pose}" for stamp in stamps)]


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_input_is_told_in_one_line(case: str, story: Story, tmp_path: Path) -> None:
    command, text = BROKEN[case]
    if text is not None:
        name = "x.toml" if "x.toml" in command else "x"
        (tmp_path / name).write_text(text(story))
    places = {
        "tmp": tmp_path,
        "log": story.log,
        "held_out": story.held_out,
        "twin": story.out / "twin.toml",
    }
    before = sorted(tmp_path.rglob("*"))
    result = CliRunner().invoke(app, [word.format(**places) for word in command.split()])
    assert result.exit_code == 1, result.output
    assert result.stdout == ""
    assert re.fullmatch(r"urdyn: [^\n]+\n", result.stderr), result.stderr
    assert "Traceback" not in result.stderr and "unexpected" not in result.stderr
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "verb",
    [
        "identify {tmp}/none.csv --robot ur10e --out {tmp}/a/b",
        "excite --robot ur10e --twin {tmp}/none.toml --out {tmp}",
        "simulate --twin {tmp}/none.toml --out {tmp}/l.csv",
    ],
)
def test_a_folder_that_takes_no_files_is_told_before_any_work(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda path, mode, **more: not mode & os.W_OK)
    result = CliRunner().invoke(app, verb.format(tmp=tmp_path).split())
    assert result.exit_code == 1 and f"you may not write in {tmp_path}; name" in result.stderr


@pytest.mark.parametrize(
    "command",
    [
        "identify",
        "identify run.csv",
        "identify run.csv --robot ur10e",
        "identify run.csv other.csv --robot ur10e --out out --rows 1:9",
        "identify run.csv --robot ur10e --out out --payload-mass 2",
        "identify run.csv campaign.toml",
        "identify run.csv --robot ur10e --out out --what",
        "validate twin.toml",
        "simulate --out run.csv",
        "simulate --robot ur10e --payload-com 0,0,1 --out run.csv",
        "simulate --robot ur10e --seed -1 --out run.csv",
        "unknown",
    ],
)
def test_wrong_usage_has_status_2(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, command.split())
    assert result.exit_code == 2
    assert result.stdout == "" and "Traceback" not in result.stderr
    assert not list(tmp_path.iterdir())
