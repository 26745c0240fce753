"""Recordings of a virtual arm, for a campaign without a robot."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

import urdyn as ud
from urdyn.cli.recording import Recording, numbers_of
from urdyn.errors import InputError

if TYPE_CHECKING:
    from urdyn.model.arm import Arm
    from urdyn.model.dynamics import Dynamics
    from urdyn.simulate import Payload, Sensors

CENTRE = (0.0, 0.0, 0.06)  # [m] of a payload's mass, in front of the flange


@dataclass(frozen=True)
class Simulation:
    """How a virtual arm is drawn, and for how long it is recorded."""

    duration: float = 30.0  # [s] of each run
    rate: float = 125.0  # [Hz]
    seed: int = 0
    payload_mass: float | None = None  # [kg] in a second run, which determines the drive gains
    trajectory: Path | None = None  # of both these runs; None: at random, for `duration`


@dataclass(frozen=True)
class Virtual:
    """What was recorded, and what the arm really is."""

    log: Recording
    loaded: Recording | None
    held_out: Recording  # another motion, which identification does not see
    truth: dict[str, Any]


def record(arm: Arm, ask: Simulation, out: Path) -> Virtual:
    """Put the virtual arm to work and write its runs into `out`."""
    from urdyn.simulate import Payload, truth, typical_sensors, virtual_arm, write_truth

    sensors, mass = typical_sensors(arm), ask.payload_mass
    payload = None if mass is None else Payload(mass, np.array(CENTRE))
    bare, loaded = virtual_arm(arm, ask.seed), virtual_arm(arm, ask.seed, payload)
    told = truth(loaded, sensors, ask.seed)
    logs = {
        "excitation": at_work(bare, sensors, ask, 0, ask.trajectory),
        "held_out": at_work(bare, sensors, ask, 1),
    }
    if payload is not None:
        logs["loaded"] = at_work(loaded, sensors, ask, 2, ask.trajectory)
    out.mkdir(parents=True, exist_ok=True)
    for name, log in logs.items():
        ud.write(log, out / f"{name}.parquet")
    write_truth(out / "truth.json", told)
    return Virtual(
        Recording(out / "excitation.parquet"),
        None if payload is None else Recording(out / "loaded.parquet", mass=mass),
        Recording(out / "held_out.parquet"),
        told,
    )


def at_work(
    dynamics: Dynamics, sensors: Sensors, ask: Simulation, run: int, path: Path | None = None
) -> ud.Log:
    """The log of an arm's `run`-th motion, with motion and noise of its own.

    `path` names a file of the motion.
    """
    from urdyn.simulate import fourier, from_file, observe

    motion, noise = np.random.default_rng((ask.seed, run)).spawn(2)
    if path is not None:
        return observe(dynamics, from_file(path, dynamics.arm, ask.rate), sensors, noise)
    return observe(
        dynamics, fourier(dynamics.rigid, ask.duration, ask.rate, motion), sensors, noise
    )


def payload_of(mass: float | None, com: str | None) -> Payload | None:
    """The payload from options: its mass, and X,Y,Z of its centre."""
    from urdyn.simulate import Payload

    if mass is None:
        if com is not None:
            raise typer.BadParameter("--payload-com needs --payload-mass")
        return None
    place = numbers_of(com, "payload com") if com is not None else CENTRE
    if len(place) != 3:
        raise InputError(f"payload com {com!r}: three numbers in m, like 0,0,0.06")
    return Payload(mass, np.array(place))


def sensors_of(arm: Arm, scale: float) -> Sensors:
    """The usual sensors with `scale` times their noise; 0: perfect ones."""
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
