"""urdyn excite: the most informative motion that an arm can make in its cell, proven safe."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import urdyn as ud
from urdyn.cli import excite_options as ask_for
from urdyn.cli.idle import idle
from urdyn.cli.options import Folder, Json, Quiet, Robot
from urdyn.cli.voice import Voice
from urdyn.errors import InputError

if TYPE_CHECKING:
    from urdyn.identify.excite import Ask, Excitation
    from urdyn.model.arm import Arm
    from urdyn.model.cell import Cell
    from urdyn.simulate.limits import Limits


def excite(
    context: typer.Context,
    again: ask_for.Again = None,
    robot: Robot = None,
    out: Folder = None,
    every: ask_for.All = None,
    duration: ask_for.Duration = 20.0,
    kind: ask_for.Kind = "fourier",
    joint: ask_for.Joint = None,
    criterion: ask_for.Criterion = "D",
    interest: ask_for.Interest = None,
    twin: ask_for.TwinFile = None,
    cell: ask_for.CellFile = None,
    margin: ask_for.Margin = 0.02,
    payload_mass: ask_for.Mass = None,
    payload_com: ask_for.Com = None,
    excursion: ask_for.Excursion = None,
    velocity: ask_for.Velocity = None,
    acceleration: ask_for.Acceleration = None,
    rate: ask_for.Rate = None,
    harmonics: ask_for.Harmonics = None,
    restarts: ask_for.Restarts = 4,
    processes: ask_for.Processes = 2,
    seed: ask_for.Seed = 0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find a motion that tells most about an arm, prove it safe, write it for the robot.

    FILE is an excitation.toml of this verb: the same motion is proven and written again; where it
    adds to a twin, by that --twin.

    Example: [bold]urdyn excite --robot ur10e --duration 20 --out excitation/[/bold]
    """
    from urdyn.cli.results import require_folder
    from urdyn.cli.virtual import payload_of
    from urdyn.identify import excite as room
    from urdyn.io import sha256

    voice, begin = Voice(json, quiet), time.perf_counter()
    _refuse_idle(context, again, every, kind)
    folder = every or out
    if folder is None:
        raise typer.BadParameter("missing: name a folder", param_hint="--out")
    require_folder(folder)
    if again is not None:
        _tell(_again(again, twin), folder, time.perf_counter() - begin, voice)
        return
    fit = ud.Twin.load(twin).fit if twin else None

    def wanted(arm: Arm) -> Ask:
        return room.Ask(
            kind=kind,
            duration=duration,
            rate=rate or _controller_rate(arm),
            criterion=criterion,
            interest=_phrases(interest),
            joint=_joint(arm, joint, kind),
            payload=payload_of(payload_mass, payload_com),
            cell=_cell(cell),
            margin=margin,
            limits=_limits(arm, excursion, velocity, acceleration),
            harmonics=harmonics,
            restarts=restarts,
            seed=seed,
            twin=sha256(twin) if twin else "",
        )

    if every is not None:
        _every(every, wanted, processes, voice)
        return
    arm = _arm(robot, fit)
    with voice.progress("looking for a motion") as progress:
        found = room.excite(arm, wanted(arm), fit, progress, processes)
    _tell(found, folder, time.perf_counter() - begin, voice)


def _refuse_idle(context: typer.Context, again: Path | None, every: Path | None, kind: str) -> None:
    """InputError at an option that FILE, or another option, leaves nothing to do."""
    if again is not None:
        told = {*context.params} - {"again", "out", "twin", "json", "quiet"}
        idle(context, f"with {again}, which tells the motion", *sorted(told))
    if every is not None:
        idle(context, "with --all", "out", "robot", "twin")
    if kind != "probe":
        idle(context, f"with --kind {kind}", "joint")
    if kind != "fourier":
        idle(context, f"with --kind {kind}", "harmonics", "restarts", "processes")


def _every(folder: Path, wanted: Callable[[Arm], Ask], processes: int, voice: Voice) -> None:
    """excitation.toml of every arm of the library."""
    from urdyn.identify.excite import excite as search
    from urdyn.identify.excite.excitation_file import excitation_document
    from urdyn.io import dump_toml, write_folder
    from urdyn.model.library import names
    from urdyn.report.excite.summary import safety

    values = {}
    for name in names():
        arm = ud.load_arm(name)
        with voice.progress(f"looking for a motion of {name}") as progress:
            found = search(arm, wanted(arm), None, progress, processes)
        write_folder(folder / name, {"excitation.toml": dump_toml(excitation_document(found))})
        voice.show(f"{folder / name / 'excitation.toml'}: {safety(found)}")
        values[name] = found.value
    voice.result({"values": values})


def _arm(robot: str | None, fit: ud.Fit | None) -> Arm:
    """The arm of --robot, or the twin's."""
    if fit is not None:
        arm = fit.dynamics.arm
        if robot is not None and ud.load_arm(robot).name != arm.name:
            raise InputError(f"the twin is of a {arm.name}, not of {robot}; leave --robot out")
        return arm
    if robot is None:
        raise typer.BadParameter("missing: name the arm, or a --twin of it", param_hint="--robot")
    return ud.load_arm(robot)


def _controller_rate(arm: Arm) -> float:
    from urdyn.cli.serving import cycle

    return 1.0 / cycle(arm)


def _phrases(interest: list[str] | None) -> tuple[str, ...]:
    """Names of interest, one per option or separated by commas."""
    phrases = (part.strip() for text in interest or () for part in text.split(","))
    return tuple(phrase for phrase in phrases if phrase)


def _joint(arm: Arm, name: str | None, kind: str) -> int:
    """A joint by its number from 0, or by its name."""
    if name is None:
        if kind == "probe":
            raise typer.BadParameter("a probe needs --joint, like --joint elbow")
        return 0
    plain = name.lower().replace(" ", "_").removesuffix("_joint")
    called = [joint.lower().removesuffix("_joint") for joint in arm.joint_names]
    if plain.isdecimal() and int(plain) < arm.joints:
        return int(plain)
    if plain not in called:
        raise InputError(f"no joint {name!r}; name one of {', '.join(called)}, or count from 0")
    return called.index(plain)


def _cell(path: Path | None) -> Cell:
    from urdyn.identify.excite.cell_file import read_cell
    from urdyn.model.cell import STANDING

    return STANDING if path is None else read_cell(path)


def _limits(
    arm: Arm, excursion: float | None, velocity: float | None, acceleration: float | None
) -> Limits:
    """The usual limits, with those that are asked for."""
    from urdyn.simulate.limits import comfortable

    asked = {"excursion": excursion, "velocity": velocity, "acceleration": acceleration}
    for name, value in asked.items():
        if value is not None and not 0.0 < value <= (1.0 if name == "velocity" else 100.0):
            raise InputError(f"--{name} {value:g}: is to be above 0, and within what arms can do")
    return comfortable(arm, **{name: value for name, value in asked.items() if value is not None})


def _again(file: Path, twin: Path | None) -> Excitation:
    """The motion in a file, proven anew, with the twin that it adds to."""
    from urdyn.identify.excite import repeated
    from urdyn.identify.excite.excitation_file import read_excitation
    from urdyn.io import sha256

    arm, wanted, path = read_excitation(file)
    if twin is not None and sha256(twin) != wanted.twin:
        raise InputError(f"{twin}: is not the twin that {file} adds to")
    return repeated(arm, wanted, path, ud.Twin.load(twin).fit if twin else None)


def _tell(found: Excitation, out: Path, wall: float, voice: Voice) -> None:
    """Write, show, print."""
    from urdyn.identify.excite.excitation_file import texts
    from urdyn.io import write_folder
    from urdyn.report.excite.page import excite_page
    from urdyn.report.excite.summary import excited, excited_table, safety

    files = texts(found) | {"report.html": excite_page(found, wall)}
    write_folder(out, files)
    voice.show(excited_table(found), safety(found))
    voice.note(f"written to {out}: {', '.join(files)}")
    voice.result(excited(found, wall))
