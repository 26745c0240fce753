"""urdyn simulate: a recording of a virtual arm, and its ground truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import urdyn as ud
from urdyn.cli.options import Json, Quiet, Robot
from urdyn.cli.virtual import Simulation, at_work, payload_of, sensors_of
from urdyn.cli.voice import Voice
from urdyn.errors import InputError

if TYPE_CHECKING:
    from urdyn.model.arm import Arm
    from urdyn.model.dynamics import Dynamics
    from urdyn.simulate import Payload, Sensors

OutLog = Annotated[
    Path, typer.Option(metavar="LOG", help="Where to write it: .csv, .csv.gz, ..., .parquet.")
]
Duration = Annotated[float, typer.Option(metavar="S", help="Length of a random excitation.")]
SampleRate = Annotated[float, typer.Option(metavar="HZ", help="Sample rate, 500 at most.")]
Seed = Annotated[int, typer.Option(min=0, help="The same seed makes the same arm and noise.")]
Run = Annotated[int, typer.Option(min=0, help="Another motion and other noise of that arm.")]
TrajectoryFile = Annotated[
    Path | None,
    typer.Option("--trajectory", help="CSV of t, q0, ... [s, rad] to follow in its place."),
]
TwinFile = Annotated[
    Path | None, typer.Option("--twin", help="Simulate this identified arm, not a random one.")
]
Mass = Annotated[float | None, typer.Option(metavar="KG", help="Mass of a payload at the tool.")]
Com = Annotated[
    str | None, typer.Option(metavar="X,Y,Z", help="Its centre of mass from the flange [m].")
]
Noise = Annotated[
    float, typer.Option(metavar="SCALE", help="Of the usual sensor noise; 0: perfect sensors.")
]
Truth = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write what the arm truly is: .json, .toml.")
]


def simulate(
    out: OutLog,
    robot: Robot = None,
    duration: Duration = 30.0,
    rate: SampleRate = 500.0,
    seed: Seed = 0,
    run: Run = 0,
    trajectory: TrajectoryFile = None,
    twin: TwinFile = None,
    payload_mass: Mass = None,
    payload_com: Com = None,
    noise: Noise = 1.0,
    truth: Truth = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Record a virtual arm whose masses, friction and gains are known.

    Example: [bold]urdyn simulate --robot ur10e --duration 30 --seed 7 --out run.parquet[/bold]
    """
    from urdyn.simulate import truth as truth_of
    from urdyn.simulate import write_truth

    if truth is not None and truth.suffix.lower() not in (".json", ".toml"):
        raise InputError(f"{truth}: the truth is written as .json or .toml")
    voice, ask = Voice(json, quiet), Simulation(duration, rate, seed)
    payload = payload_of(payload_mass, payload_com)
    dynamics = _dynamics(robot, twin, seed, payload)
    sensors = sensors_of(dynamics.arm, noise)
    with voice.progress("simulating"):
        if twin is None and run == 0:
            log, document = _of_library(dynamics.arm, ask, trajectory, payload, sensors)
        else:
            log = at_work(dynamics, sensors, ask, run, trajectory)
            document = truth_of(dynamics, sensors, seed)
        ud.write(log, out)
    if truth is not None:
        write_truth(truth, document)
    voice.show(f"{out}: {len(log)} rows, {log.t[-1]:g} s of a virtual {dynamics.arm.name}")
    voice.result(_summary(log, out, document))


def _of_library(
    arm: Arm, ask: Simulation, path: Path | None, payload: Payload | None, sensors: Sensors
) -> tuple[ud.Log, dict[str, Any]]:
    """What `urdyn.simulate` gives for a seed, so that the two can be compared."""
    from urdyn.simulate import from_file

    return ud.simulate(
        arm,
        ask.duration,
        ask.rate,
        ask.seed,
        trajectory=None if path is None else from_file(path, arm, ask.rate),
        payload=payload,
        sensors=sensors,
    )


def _summary(log: ud.Log, out: Path, truth: dict[str, Any]) -> dict[str, Any]:
    """The run in numbers."""
    from urdyn.io import sha256

    return {
        "urdyn": ud.__version__,
        "path": str(out),
        "sha256": sha256(out),
        "n": len(log),
        "duration_s": float(log.t[-1]),
        "truth": truth,
    }


def _dynamics(robot: str | None, twin: Path | None, seed: int, payload: Payload | None) -> Dynamics:
    """The arm of a seed, or that of a twin, with what it carries."""
    from urdyn.simulate import virtual_arm

    if (robot is None) == (twin is None):
        raise typer.BadParameter("name the arm by either --robot or --twin")
    if robot is not None:
        return virtual_arm(ud.load_arm(robot), seed, payload)
    assert twin is not None, "one of the two"
    found = ud.Twin.load(twin).fit.dynamics
    return replace(found, payload=payload.inertials()) if payload else found
