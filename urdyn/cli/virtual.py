"""Recordings of a virtual arm: what a campaign without a robot is made of."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import urdyn as ud
from urdyn.cli.recording import Recording

if TYPE_CHECKING:
    from urdyn.model.arm import Arm
    from urdyn.model.dynamics import Dynamics
    from urdyn.simulate import Trajectory

CENTRE = (0.0, 0.0, 0.06)  # [m] of a payload's mass, in front of the flange


@dataclass(frozen=True)
class Simulation:
    """How a virtual arm is drawn, and for how long it is recorded."""

    duration: float = 30.0  # [s] of each run
    rate: float = 125.0  # [Hz]
    seed: int = 0
    payload_mass: float | None = None  # [kg] in a second run, which tells the drive gains


@dataclass(frozen=True)
class Virtual:
    """What was recorded, and what the arm really is."""

    log: Recording
    loaded: Recording | None
    held_out: Recording  # another motion, which identification does not see
    truth: dict[str, Any]


def record(arm: Arm, ask: Simulation, out: Path) -> Virtual:
    """Put the virtual arm to work and write its runs into `out`."""
    from urdyn.simulate import (
        Payload,
        observe,
        truth,
        typical_sensors,
        virtual_arm,
        write_truth,
    )

    sensors, mass = typical_sensors(arm), ask.payload_mass
    payload = None if mass is None else Payload(mass, np.array(CENTRE))
    bare, loaded = virtual_arm(arm, ask.seed), virtual_arm(arm, ask.seed, payload)
    told = truth(loaded, sensors, ask.seed)

    def run(number: int, dynamics: Dynamics) -> ud.Log:
        trajectory, chance = at_work(dynamics, ask, number)
        return observe(dynamics, trajectory, sensors, chance)

    logs = {"excitation": run(0, bare), "held_out": run(2, bare)}
    logs |= {} if payload is None else {"loaded": run(1, loaded)}
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
    dynamics: Dynamics, ask: Simulation, run: int = 0, path: Path | None = None
) -> tuple[Trajectory, np.random.Generator]:
    """Motion of an arm, and what the noise of its sensors is drawn from, run by run.

    `path` names a file of the motion; run 0 is that of `urdyn.simulate.simulate`.
    """
    from urdyn.model.arm import with_inertials
    from urdyn.simulate import fourier, from_file

    motion, noise = np.random.default_rng((ask.seed, run)).spawn(2)
    if path is not None:
        return from_file(path, dynamics.arm, ask.rate), noise
    arm = with_inertials(dynamics.arm, dynamics.loaded())
    return fourier(arm, ask.duration, ask.rate, motion), noise
