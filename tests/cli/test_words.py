"""Files in one another's place are told by what they are; help breaks lines where they end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from story import Story
from typer.testing import CliRunner

from urdyn.cli.app import app, flowing
from urdyn.io.motion_files import motion_csv
from urdyn.model.arm import Arm
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
