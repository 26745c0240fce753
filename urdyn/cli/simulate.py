"""urdyn simulate: a recording of a virtual arm, and its ground truth."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

import urdyn as ud
from urdyn.cli.options import Json, Quiet, Robot
from urdyn.cli.recording import numbers_of
from urdyn.cli.virtual import CENTRE, Simulation, at_work
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
    from urdyn.io import sha256
    from urdyn.simulate import observe, write_truth
    from urdyn.simulate import truth as truth_of

    if truth is not None and truth.suffix.lower() not in (".json", ".toml"):
        raise InputError(f"{truth}: the truth is written as .json or .toml")
    voice = Voice(json, quiet)
    dynamics = _dynamics(robot, twin, seed, _payload(payload_mass, payload_com))
    sensors = _sensors(dynamics.arm, noise)
    with voice.progress("simulating"):
        ask = Simulation(duration, rate, seed)
        motion, chance = at_work(dynamics, ask, run, trajectory)
        ud.write(observe(dynamics, motion, sensors, chance), out)
    document = truth_of(dynamics, sensors, seed)
    if truth is not None:
        write_truth(truth, document)
    robot, seconds = dynamics.arm.name, float(motion.t[-1])
    voice.show(f"{out}: {len(motion)} rows, {seconds:g} s of a virtual {robot}")
    voice.result(
        {
            "urdyn": ud.__version__,
            "path": str(out),
            "sha256": sha256(out),
            "n": len(motion),
            "duration_s": seconds,
            "truth": document,
        }
    )


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


def _payload(mass: float | None, com: str | None) -> Payload | None:
    from urdyn.simulate import Payload

    if mass is None:
        if com is not None:
            raise typer.BadParameter("--payload-com needs --payload-mass")
        return None
    place = numbers_of(com, "payload com") if com is not None else CENTRE
    if len(place) != 3:
        raise InputError(f"payload com {com!r}: three numbers in m, like 0,0,0.06")
    return Payload(mass, np.array(place))


def _sensors(arm: Arm, scale: float) -> Sensors:
    from urdyn.simulate import perfect_sensors, typical_sensors

    if not 0.0 <= scale < math.inf:
        raise InputError(f"noise {scale:g}: is to be 0 or more times the usual noise")
    usual = typical_sensors(arm)
    noisy = replace(
        usual,
        current_noise=scale * usual.current_noise,
        velocity_noise=scale * usual.velocity_noise,
    )
    return noisy if scale else perfect_sensors(arm)
