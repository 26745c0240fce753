"""Files in one another's place are told by what they are; help and terminals of all kinds."""

from __future__ import annotations

import sys
import unicodedata
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from story import Story, urdyn
from typer.testing import CliRunner

from urdyn.cli.app import app, flowing
from urdyn.cli.voice import Printable, Voice
from urdyn.io.motion_files import motion_csv
from urdyn.model.arm import Arm
from urdyn.report.terminal import terminal_table
from urdyn.simulate import fourier

MIXED = [
    ("identify {twin}", "{twin}: is a twin, not a campaign"),
    ("identify {plan} --robot ur5e --out {tmp}/out", "is a plan, as `urdyn excite` writes it"),
    ("validate {log} {twin}", "{twin} is a twin, and comes first; {log} is to follow it"),
    ("track {log} {twin} --out {tmp}/out", "{twin} is a twin, and comes first"),
    ("validate {log} {log}", "{log}:1: not TOML"),
]


@pytest.mark.parametrize(("line", "said"), MIXED)
def test_a_file_in_another_s_place_is_told(
    line: str, said: str, story: Story, ur5e: Arm, tmp_path: Path
) -> None:
    plan = tmp_path / "plan.csv"
    moved = fourier(ur5e, 2.0, 100.0, np.random.default_rng(0))
    plan.write_text("".join(motion_csv(moved.t, moved.q, moved.v, moved.a)))
    places = {"twin": story.out / "twin.toml", "log": story.log, "plan": plan, "tmp": tmp_path}
    done = CliRunner().invoke(app, [word.format(**places) for word in line.split()])
    assert (done.exit_code, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert said.format(**places) in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_paragraph_of_help_is_a_line() -> None:
    text = """First.

    Of two lines,
    and their end.

    Example: [bold]do[/bold]
    """
    assert flowing(text) == "First.\n\nOf two lines, and their end.\n\nExample: [bold]do[/bold]"


@pytest.mark.parametrize("verb", ["", "simulate", "track", "bench", "bench faults"])
def test_a_switch_takes_no_value_in_the_help(verb: str) -> None:
    done = CliRunner().invoke(app, [*verb.split(), "--help"], env={"COLUMNS": "80"})
    assert "--help" in done.stdout and "bool" not in done.stdout.lower()


@pytest.mark.parametrize("verb", ["identify", "validate", "simulate", "track", "convert"])
def test_an_example_in_the_help_is_whole_at_80_columns(verb: str) -> None:
    told = CliRunner().invoke(app, [verb, "--help"], env={"COLUMNS": "80"}).stdout
    assert f"urdyn {verb}" in told and "…" not in told


@pytest.mark.parametrize("hostile", ["\x1b]0;title\x1b\\", "\x1b[8m", "\x9b2J", "\b", "\r"])
def test_no_name_in_a_file_acts_on_a_terminal(
    hostile: str, capsys: pytest.CaptureFixture[str]
) -> None:
    named = f"an {hostile}elbow"
    tabled = terminal_table(named, [named], [[named]])
    Voice().show(named, tabled)
    Console(file=sys.stdout, force_terminal=True, color_system=None).print(Printable(tabled))
    said = capsys.readouterr().out
    assert said.count("elbow") == 7
    assert not [sign for sign in said if unicodedata.category(sign) == "Cc" and sign != "\n"]


@pytest.mark.parametrize("encoding", ["ascii", pytest.param("latin-1", marks=pytest.mark.slow)])
def test_signs_that_a_terminal_lacks_are_told_in_ascii(encoding: str, story: Story) -> None:
    done = urdyn("validate", story.out / "twin.toml", story.held_out, PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr) == (0, "")
    assert ") ... " in done.stdout  # from the best joint to the worst
    assert "controller's own model" in done.stdout
    assert urdyn("track", "--help", PYTHONIOENCODING=encoding).returncode == 0
