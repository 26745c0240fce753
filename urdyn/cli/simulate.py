"""urdyn simulate: a recording of a virtual arm with its faults, and its ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

import urdyn as ud
from urdyn.cli import simulate_options as ask
from urdyn.cli.apart import apart
from urdyn.cli.idle import idle
from urdyn.cli.options import Json, Quiet, Robot
from urdyn.cli.serving import cycle, serve_logs
from urdyn.cli.virtual import payload_of, sensors_of
from urdyn.cli.voice import Voice
from urdyn.errors import InputError

if TYPE_CHECKING:
    from urdyn.model.arm import Arm
    from urdyn.model.dynamics import Dynamics
    from urdyn.simulate import Fault, Fidelity, Payload, Sensors, Work
    from urdyn.types import Array


def simulate(
    context: typer.Context,
    out: ask.OutLog = None,
    robot: Robot = None,
    duration: ask.Duration = 30.0,
    rate: ask.SampleRate = 500.0,
    seed: ask.Seed = 0,
    run: ask.Run = 0,
    motion: ask.Motion = "fourier",
    trajectory: ask.TrajectoryFile = None,
    twin: ask.TwinFile = None,
    payload_mass: ask.Mass = None,
    payload_com: ask.Com = None,
    fault: ask.Faults = None,
    heat: ask.Heat = False,
    deviations: ask.Deviations = False,
    noise: ask.Noise = "white",
    recorder: ask.RecorderKind = "exact",
    fidelity: ask.FidelityName = "inverse",
    truth: ask.Truth = None,
    poses: ask.Watched = None,
    pose_rate: ask.PoseRate = 10.0,
    serve: ask.Serve = False,
    host: ask.Host = "127.0.0.1",
    port: ask.Port = 30004,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Record a virtual arm whose masses, friction and gains are known, and so are its faults.

    With --serve it is a controller on the network instead, for `urdyn record` or any RTDE client.

    Example: [bold]urdyn simulate --robot ur10e --fault friction_increase:joint=2,onset=10,rate=0.01
    --out run.parquet[/bold]
    """
    from urdyn.simulate import happening, parse_fault, write_truth
    from urdyn.simulate import truth as truth_of
    from urdyn.simulate.observe import log_and_links
    from urdyn.simulate.rounds import rounds
    from urdyn.simulate.there_and_back import there_and_back
    from urdyn.simulate.truth import require_course

    _require_outcome(out, serve, truth, poses)
    _refuse_idle(context, out, trajectory, poses, serve)
    voice, payload = Voice(json, quiet), payload_of(payload_mass, payload_com)
    dynamics = _dynamics(robot, twin, seed, payload, deviations)
    sensors, lived = _sensors(dynamics.arm, noise), _fidelity(dynamics.arm, fidelity)
    faults = tuple(parse_fault(text, dynamics.arm.joints) for text in fault or ())
    moving, noisy = _streams(twin, seed, payload, run)
    pace = 1.0 / cycle(dynamics.arm) if serve else rate
    if poses is not None and not 0.0 < pose_rate <= pace:
        raise InputError(f"--pose-rate {pose_rate:g}: is to be above 0, and {pace:g} at most")
    with voice.progress("simulating"):
        work = _work(dynamics, motion, trajectory, duration, pace, moving)
        work = there_and_back(work) if serve else work
        _befalls_in_time(faults, work)
        _is_felt(faults, heat)
        events = happening(dynamics, work, faults, heat)
        end = float(sensors.stamps(work.trajectory)[-1])
        document = truth_of(dynamics, sensors, seed, events, end)
        if truth is not None:
            require_course(truth, document)
        log, links = log_and_links(dynamics, work.trajectory, sensors, noisy, events, lived)
        if out is not None:
            _record(log, recorder, out, (seed, run, 1))
    if poses is not None:
        _watch(dynamics, log.t, links, pose_rate, poses, (seed, run, 2))
    if truth is not None:
        write_truth(truth, document)
    about = {} if out is None else _summary(log, out, document)
    if out is not None:
        voice.show(f"{out}: {len(log)} rows, {log.t[-1]:g} s of a virtual {dynamics.arm.name}")
    if serve:
        later = partial(rounds, dynamics, work, sensors, noisy, faults, heat, lived)
        serve_logs(chain([log], apart(later)), dynamics.arm, host, port, voice, about)
    else:
        voice.result(about)


def _require_outcome(out: Path | None, serve: bool, truth: Path | None, poses: Path | None) -> None:
    """InputError unless all outputs have distinct paths, and the truth a known format.

    Checked before anything is written: a log without its truth is half of what was asked for.
    """
    from urdyn.cli.results import require_place

    if out is None and not serve:
        raise typer.BadParameter("say where to write by --out, or --serve")
    if truth is not None and truth.suffix.lower() not in (".json", ".toml", ".parquet"):
        raise InputError(f"{truth}: the truth is written as .json, .toml or .parquet")
    asked = [path for path in (out, truth, poses) if path is not None]
    for path in asked:
        require_place(path)
        if [other.resolve() for other in asked].count(path.resolve()) > 1:
            raise InputError(f"{path}: is asked for twice; each file of a run needs its own place")


def _streams(
    twin: Path | None, seed: int, payload: Payload | None, run: int
) -> tuple[np.random.Generator, np.random.Generator]:
    """Random generators of motion and of noise."""
    from urdyn.simulate import streams

    if twin is None:  # as `urdyn.simulate` has them for this seed and run
        return streams(seed, payload, run)
    moving, noisy = np.random.default_rng((seed, run)).spawn(2)
    return moving, noisy


def _record(log: ud.Log, recorder: str, out: Path, seed: tuple[int, ...]) -> None:
    """Write the log as such a recorder would."""
    from urdyn.simulate import RECORDERS

    ud.write(RECORDERS[recorder].record(log, np.random.default_rng(seed)), out)


def _watch(
    dynamics: Dynamics, t: Array, links: Array, rate: float, out: Path, seed: tuple[int, ...]
) -> None:
    """Write what a tracker beside the arm measured meanwhile."""
    from urdyn.simulate.watched import watched

    ud.write(watched(dynamics, t, links, rate, np.random.default_rng(seed)), out)


def _refuse_idle(
    context: typer.Context,
    out: Path | None,
    trajectory: Path | None,
    poses: Path | None,
    serve: bool,
) -> None:
    """InputError at an option that has no effect beside another one."""
    if trajectory is not None:
        idle(context, f"with {trajectory}, which tells the motion", "motion", "duration")
    if poses is None:
        idle(context, "without --poses", "pose_rate")
    if serve:
        idle(context, "with --serve: a controller has a rate of its own", "rate")
    else:
        idle(context, "without --serve", "host", "port")
    if out is None:
        idle(context, "without --out", "recorder")


def _is_felt(faults: Sequence[Fault], heat: bool) -> None:
    """InputError for a warming room around an arm that has no thermal effects."""
    from urdyn.simulate.mishaps import ThermalDrift

    if not heat and any(isinstance(fault, ThermalDrift) for fault in faults):
        raise InputError("--fault thermal_drift: changes nothing without --heat; add it")


def _befalls_in_time(faults: Sequence[Fault], work: Work) -> None:
    """InputError at a fault that would begin after the end."""
    from urdyn.simulate.faults import describe

    end = float(work.trajectory.t[-1])
    for fault in faults:
        if fault.onset > end:
            told = f"its onset, {fault.onset:g} s, is after the end of the run, {end:g} s"
            raise InputError(f"--fault {describe(fault)['kind']}: {told}")


def _fidelity(arm: Arm, name: str) -> Fidelity:
    """The fidelity of the simulation, by the word of --fidelity."""
    from urdyn.simulate import forward, inverse, typical_gears

    known: dict[str, Fidelity] = {
        "inverse": inverse,
        "forward": forward,
        "elastic": partial(forward, gears=typical_gears(arm)),
    }
    return known[name]


def _work(
    dynamics: Dynamics,
    motion: str,
    path: Path | None,
    duration: float,
    rate: float,
    rng: np.random.Generator,
) -> Work:
    """The arm's motion: from a file, or at random."""
    from urdyn.simulate import Work, from_file, plan

    if path is not None:
        return Work(from_file(path, dynamics.arm, rate))
    return plan(motion, dynamics.rigid, duration, rate, rng)


def _sensors(arm: Arm, noise: str) -> Sensors:
    """Sensors by the word or number of --noise."""
    from urdyn.simulate import real_sensors

    if noise in ("real", "white"):
        return real_sensors(arm) if noise == "real" else sensors_of(arm, 1.0)
    try:
        return sensors_of(arm, float(noise))
    except ValueError:
        told = f"{noise!r} is to be real, white, or a number of times it"
        raise typer.BadParameter(told, param_hint="--noise") from None


def _dynamics(
    robot: str | None, twin: Path | None, seed: int, payload: Payload | None, deviations: bool
) -> Dynamics:
    """The arm of a seed, or that of a twin, with what it carries."""
    from urdyn.model.population import TEMPERATURE
    from urdyn.simulate import virtual_arm, with_deviations

    if (robot is None) == (twin is None):
        raise typer.BadParameter("name the arm by either --robot or --twin")
    if robot is not None:
        return virtual_arm(ud.load_arm(robot), seed, payload, deviations=deviations)
    assert twin is not None, "one of the two"
    found = ud.Twin.load(twin).fit.dynamics
    quoted = np.nan_to_num(found.drive.temperature, nan=TEMPERATURE)  # where its log had none
    found = replace(found, drive=replace(found.drive, temperature=quoted))
    found = with_deviations(found, seed) if deviations else found
    return replace(found, payload=found.payload + payload.inertials()) if payload else found


def _summary(log: ud.Log, out: Path, truth: dict[str, Any]) -> dict[str, Any]:
    """The run in numbers; what changes over time is for files."""
    from urdyn.io import sha256

    return {
        "path": str(out),
        "sha256": sha256(out),
        "n": len(log),
        "duration_s": float(log.t[-1]),
        "truth": {name: value for name, value in truth.items() if name != "course"},
    }
