"""An option that another one leaves nothing to do is refused in one line, before any work."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from urdyn.cli.app import app

TRACK = "track twin.toml {source} --out out"
FIND, SIMULATE = "excite --robot ur5e --out out", "simulate --robot ur5e --duration 1 --rate 50"
LIVE = {"rtde": "rtde://127.0.0.1:1", "ros2": "ros2:///joint_states"}

# Command lines without the option, the option, and why it does nothing.
IDLE = [
    *((TRACK.format(source="log.csv") + " --no-diagnosis", option, "with --no-diagnosis")
      for option in ("--rules none.toml", "--fail-on-finding", "--false-alarm-hours 9")),
    *((TRACK.format(source=source), option, f"with a live source, {source}")
      for source in LIVE.values() for option in ("--rows 0:9", "--columns timestamp")),
    (TRACK.format(source=LIVE["rtde"]), "--effort-unit Nm", "with a controller"),
    (TRACK.format(source="log.csv"), "--calibration geometry", "without --poses"),
    (TRACK.format(source="log.csv"), "--serial 7", "where nobody is told"),
    (FIND, "--joint elbow", "with --kind fourier"),
    *((f"{FIND} --kind poses", option, "with --kind poses")
      for option in ("--joint 2", "--harmonics 5", "--restarts 2", "--processes 1")),
    *((f"{FIND} --kind probe --joint 2", option, "with --kind probe")
      for option in ("--harmonics 5", "--restarts 2", "--processes 1")),
    *(("excite old.toml --out out", option, "with old.toml")
      for option in ("--duration 20", "--robot ur5e", "--seed 0", "--kind fourier", "--all d")),
    *(("excite --all out", option, "with --all")
      for option in ("--out o", "--robot ur5e", "--twin twin.toml")),
    *((f"{SIMULATE} --out run.csv", option, "without --serve")
      for option in ("--host ::1", "--port 30004")),
    (f"{SIMULATE} --out run.csv", "--pose-rate 5", "without --poses"),
    ("simulate --robot ur5e --serve", "--rate 50", "with --serve"),
    ("simulate --robot ur5e --serve", "--recorder polling", "without --out"),
    *(("simulate --robot ur5e --out run.csv --trajectory plan.csv", option, "with plan.csv")
      for option in ("--duration 5", "--motion shift")),
    *(("calibrate --robot ur5e --suggest 3", option, "without POSES")
      for option in ("--rows 0:9", "--columns q")),
    *(("calibrate factory.yaml --robot ur5e --out out", option, "with factory.yaml")
      for option in ("--evaluate d", "--suggest 3", "--rows 0:9", "--columns q")),
    *(("convert findings.json day.mcap", option, "with findings.json")
      for option in ("--rows 0:9", "--rate 9", "--robot ur5e", "--effort-unit A")),
    *(("convert run.csv run.parquet", option, "without --effort-unit Nm")
      for option in ("--robot ur5e", "--drive-gain 1,1,1,1,1,1")),
    ("convert run.csv run.mcap --effort-unit Nm --drive-gain 1,1,1,1,1,1", "--robot ur5e", "with"),
    *(("identify virtual.toml", option, "where the campaign simulates")
      for option in ("--rows 0:9", "--rate 9", "--columns timestamp", "--payload-log run.csv",
                     "--contact bits:3")),
    *((f"view {LIVE['rtde']} --robot ur5e", option, "with a live source")
      for option in ("--log run.csv", "--rows 0:9", "--columns q", "--rate 9")),
    ("view run.csv --robot ur5e", "--log other.csv", "with run.csv"),
    ("view run.csv --twin twin.toml", "--robot ur5e", "with --twin"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "option", "why"), IDLE)
def test_an_option_that_does_nothing_is_refused(
    line: str, option: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.csv").touch()
    (tmp_path / "findings.json").write_text("{}")
    (tmp_path / "virtual.toml").write_text('robot = "ur5e"\n[simulate]\nduration = 1.0\n')
    before = {*tmp_path.iterdir()}
    done = CliRunner().invoke(app, [*line.split(), *option.split()])
    word = option.split()[0]
    assert (done.exit_code, done.stdout) == (1, "")
    assert done.stderr.startswith(f"urdyn: {word} does nothing {why}"), done.stderr
    assert done.stderr.endswith("; leave it out\n") and done.stderr.count("\n") == 1
    assert {*tmp_path.iterdir()} == before


def test_a_fault_that_never_happens_is_refused(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    fault = "friction_increase:joint=2,rate=0.01,onset="
    for onset, told in (
        ("0.5", ""),
        ("50", "its onset, 50 s, is after the end of the run, 0.98 s\n"),
    ):
        log.unlink(missing_ok=True)
        line = [*SIMULATE.split(), "--out", str(log), "--fault", fault + onset]
        done = CliRunner().invoke(app, line)
        assert (done.exit_code, log.exists()) == ((1, False) if told else (0, True))
        assert done.stderr.endswith(told)
