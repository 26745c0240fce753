"""urdyn simulate: a recording of a virtual arm, what befell it, and its ground truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import urdyn as ud
from urdyn.cli.options import Json, Quiet, Robot
from urdyn.cli.virtual import payload_of, sensors_of
from urdyn.cli.voice import Voice
from urdyn.errors import InputError

if TYPE_CHECKING:
    from urdyn.model.arm import Arm
    from urdyn.model.dynamics import Dynamics
    from urdyn.simulate import Payload, Recorder, Sensors, Work

OutLog = Annotated[
    Path, typer.Option(metavar="LOG", help="Where to write it: .csv, .csv.gz, ..., .parquet.")
]
Duration = Annotated[float, typer.Option(metavar="S", help="Length of a random motion.")]
SampleRate = Annotated[float, typer.Option(metavar="HZ", help="Sample rate, 500 at most.")]
Seed = Annotated[int, typer.Option(min=0, help="The same seed makes the same arm and noise.")]
Run = Annotated[int, typer.Option(min=0, help="Another motion and other noise of that arm.")]
Motion = Annotated[
    str,
    typer.Option(metavar="KIND", help="fourier, point_to_point, pick_and_place or shift."),
]
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
Faults = Annotated[
    list[str] | None,
    typer.Option(
        "--fault",
        metavar="KIND:...",
        help="What befalls the arm: friction_increase:joint=2,onset=60,rate=0.001; several at once "
        "by several --fault. A kind alone tells what it needs, a wrong one which there are.",
    ),
]
Heat = Annotated[bool, typer.Option("--heat", help="Joints begin cold and warm up by their work.")]
Deviations = Annotated[
    bool, typer.Option("--deviations", help="Joints are where a real arm's are, not as drawn.")
]
Noise = Annotated[
    str,
    typer.Option(
        metavar="real|white|SCALE",
        help="real: coloured, with steps of temperature and the wrench; a number: times the usual "
        "white noise; 0: perfect sensors.",
    ),
]
RecorderKind = Annotated[
    str,
    typer.Option("--recorder", metavar="KIND", help="exact, polling or several_rates."),
]
Truth = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Write what the arm truly is, and becomes: .json, .toml, or .parquet with a .json.",
    ),
]


def simulate(
    out: OutLog,
    robot: Robot = None,
    duration: Duration = 30.0,
    rate: SampleRate = 500.0,
    seed: Seed = 0,
    run: Run = 0,
    motion: Motion = "fourier",
    trajectory: TrajectoryFile = None,
    twin: TwinFile = None,
    payload_mass: Mass = None,
    payload_com: Com = None,
    fault: Faults = None,
    heat: Heat = False,
    deviations: Deviations = False,
    noise: Noise = "white",
    recorder: RecorderKind = "exact",
    truth: Truth = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Record a virtual arm whose masses, friction and gains are known, and so are its faults.

    Example: [bold]urdyn simulate --robot ur10e --duration 30 --seed 7 --out run.parquet[/bold]
    """
    from urdyn.simulate import happening, observe, parse_fault, streams, write_truth
    from urdyn.simulate import truth as truth_of

    if truth is not None and truth.suffix.lower() not in (".json", ".toml", ".parquet"):
        raise InputError(f"{truth}: the truth is written as .json, .toml or .parquet")
    voice, written = Voice(json, quiet), _recorder(recorder)
    payload = payload_of(payload_mass, payload_com)
    dynamics = _dynamics(robot, twin, seed, payload, deviations)
    sensors = _sensors(dynamics.arm, noise)
    faults = tuple(parse_fault(text, dynamics.arm.joints) for text in fault or ())
    if twin is None and run == 0:  # what `urdyn.simulate` gives for this seed
        moving, noisy = streams(seed, payload)
    else:
        moving, noisy = np.random.default_rng((seed, run)).spawn(2)
    with voice.progress("simulating"):
        work = _work(dynamics, motion, trajectory, duration, rate, moving)
        events = happening(dynamics, work, faults, heat)
        log = observe(dynamics, work.trajectory, sensors, noisy, events)
        ud.write(written.record(log, np.random.default_rng((seed, run, 1))), out)
    document = truth_of(dynamics, sensors, seed, events, float(log.t[-1]))
    if truth is not None:
        write_truth(truth, document)
    voice.show(f"{out}: {len(log)} rows, {log.t[-1]:g} s of a virtual {dynamics.arm.name}")
    voice.result(_summary(log, out, document))


def _work(
    dynamics: Dynamics,
    motion: str,
    path: Path | None,
    duration: float,
    rate: float,
    rng: np.random.Generator,
) -> Work:
    """What the arm does: as a file says, or at random."""
    from urdyn.model.arm import with_inertials
    from urdyn.simulate import Work, from_file, plan

    if path is not None:
        return Work(from_file(path, dynamics.arm, rate))
    loaded = with_inertials(dynamics.arm, dynamics.loaded())
    return plan(motion, loaded, duration, rate, rng)


def _sensors(arm: Arm, noise: str) -> Sensors:
    """Sensors by the word or number of --noise."""
    from urdyn.simulate import real_sensors

    if noise in ("real", "white"):
        return real_sensors(arm) if noise == "real" else sensors_of(arm, 1.0)
    try:
        return sensors_of(arm, float(noise))
    except ValueError:
        raise InputError(f"noise {noise!r}: is real, white, or a number of times it") from None


def _recorder(kind: str) -> Recorder:
    """The recorder of this name."""
    from urdyn.simulate import RECORDERS

    if kind not in RECORDERS:
        raise InputError(f"no recorder {kind!r}; name one of {', '.join(RECORDERS)}")
    return RECORDERS[kind]


def _dynamics(
    robot: str | None, twin: Path | None, seed: int, payload: Payload | None, deviations: bool
) -> Dynamics:
    """The arm of a seed, or that of a twin, with what it carries."""
    from urdyn.simulate import virtual_arm, with_deviations

    if (robot is None) == (twin is None):
        raise typer.BadParameter("name the arm by either --robot or --twin")
    if robot is not None:
        return virtual_arm(ud.load_arm(robot), seed, payload, deviations=deviations)
    assert twin is not None, "one of the two"
    found = ud.Twin.load(twin).fit.dynamics
    found = with_deviations(found, seed) if deviations else found
    return replace(found, payload=payload.inertials()) if payload else found


def _summary(log: ud.Log, out: Path, truth: dict[str, Any]) -> dict[str, Any]:
    """The run in numbers; what changes over time is for files."""
    from urdyn.io import sha256

    return {
        "urdyn": ud.__version__,
        "path": str(out),
        "sha256": sha256(out),
        "n": len(log),
        "duration_s": float(log.t[-1]),
        "truth": {name: value for name, value in truth.items() if name != "course"},
    }
