"""Whole virtual arms, commissioned and recorded, and the errors of histories tracked on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from urdyn.bench.life import Life, commissioned_states, drawn
from urdyn.bench.spread import of_root
from urdyn.dbn.robot_drive import POSITIVE
from urdyn.identify import PayloadPrior, Run, identify
from urdyn.identify.fit import Fit
from urdyn.io import write
from urdyn.model.arm import load_arm
from urdyn.model.dynamics import Dynamics
from urdyn.signal import condition
from urdyn.simulate import (
    Payload,
    fourier,
    observe,
    simulate,
    streams,
    typical_sensors,
    virtual_arm,
)
from urdyn.tracking.belief.model import tracking_model
from urdyn.tracking.belief.physical import JOINT
from urdyn.twin import Twin
from urdyn.types import Array, Log

COMMISSIONING = 12.0  # [s] bare, and as long with a known payload, which identifies the gains
PAYLOAD = Payload(5.0, np.array([0.0, 0.02, 0.06]))
SETTLED = 0.5  # [-] of the run, after which errors count
NEAR = 1.3  # [-] of the second half's error: converged once it stays below
QUANTITIES = {
    "k": ("zero", "rad"),
    "m": ("mass", "kg"),
    "f": ("coulomb", "N·m"),
    "alpha": ("viscous", "N·m·s/rad"),
    "beta": ("structural", "-"),
    "z": ("health", "-"),
}


@dataclass(frozen=True, eq=False)
class VirtualArm:
    """A twin, a recording that it has not seen, and the truth behind both."""

    twin: Path
    log: Path
    truth: Log  # "elbow_joint.coulomb", "forearm_link.mass", ... over the recording
    duration: float  # [s] of the recording
    rate: float  # [Hz]


@dataclass(frozen=True, eq=False)
class Tracked:
    """An arm's truth, and histories of its recording."""

    truth: Log
    history: Path
    bound: Path  # by an extended Kalman filter


@dataclass(frozen=True)
class Group:
    """Errors of a group of parameters, over arms, joints or links, and the second half of runs."""

    symbol: str
    unit: str
    rmse: float
    bound: float
    ratio_sd: float | None  # standard error over arms; None: one arm
    converged: float | None  # [s] until the error stays near that of the second half

    @property
    def ratio(self) -> float:
        """Error in units of the bound."""
        return self.rmse / self.bound


def virtual_run(folder: Path, duration: float, rate: float, seed: int = 1) -> VirtualArm:
    """A UR10e of this seed, identified from its commissioning, then recorded for `duration` [s].

    The recording is on another day, and the arm strays during it: both are drawn from its twin's
    prior, so that the twin's own standard deviations bound the mean square error.
    """
    arm, dynamics = load_arm("ur10e"), virtual_arm(load_arm("ur10e"), seed)
    bare, _ = simulate(arm, COMMISSIONING, rate, seed)
    loaded, _ = simulate(arm, COMMISSIONING, rate, seed, payload=PAYLOAD)
    lifted = Run(condition(loaded), PayloadPrior(PAYLOAD.mass))
    fit = identify(arm, condition(bare), loaded=[lifted])
    life = drawn(tracking_model(fit), 0.0, duration, np.random.default_rng([seed, 2]))
    motion, noise = streams(seed, None, run=1)
    asked = fourier(dynamics.arm, duration, rate, motion)
    whole = observe(life.on_the_day(dynamics), asked, typical_sensors(arm), noise, (life,))
    folder.mkdir(exist_ok=True)
    twin, log = folder / "twin.toml", folder / "log.parquet"
    Twin(arm, fit).save(twin)
    write(whole, log)
    return VirtualArm(twin, log, _truth(dynamics, fit, life), duration, rate)


def _truth(dynamics: Dynamics, fit: Fit, life: Life) -> Log:
    """Every quantity, named and defined as in a history; for links, the whole mass."""
    at, arm = life.currents.places, dynamics.arm
    states = commissioned_states(dynamics, fit, life.currents) + life.x
    found: dict[str, Array] = {}
    for group, (name, _) in JOINT.items():
        values = states[:, at[group]]
        values = np.exp(values) if group in POSITIVE else values
        values = np.minimum(values, 1.0) if group == "z" else values
        named = (f"{joint}.{name}" for joint in arm.joint_names)
        found |= dict(zip(named, values.T, strict=True))
    for link, body in zip(arm.link_names, dynamics.inertials, strict=True):
        found[f"{link}.mass"] = np.full(len(life.t), body[0])
    return Log(life.begin + life.t, found)


def groups(runs: Sequence[Tracked]) -> list[Group]:
    """Errors of histories by Table I's groups.

    The bound is an extended Kalman filter's own standard deviation: Tichavsky's recursion with the
    Jacobians taken along its estimate.
    """
    t = np.asarray(pq.read_table(runs[0].history)["t"])
    late = t - t[0] > SETTLED * (t[-1] - t[0])
    found = []
    for symbol, (quantity, unit) in QUANTITIES.items():
        error, sd = (
            np.array(x) for x in zip(*(_errors(r, quantity, t) for r in runs), strict=True)
        )
        square, least = np.mean(error[:, late] ** 2, axis=(1, 2)), np.mean(sd[:, late] ** 2)
        rmse, bound = float(np.sqrt(square.mean())), float(np.sqrt(least))
        spread = of_root(list(square / least)) if len(runs) > 1 else None
        found.append(Group(symbol, unit, rmse, bound, spread, _converged(t, error, rmse)))
    return found


def _errors(run: Tracked, quantity: str, t: Array) -> tuple[Array, Array]:
    """Errors of every joint or link, and their bound, at stamps t, (N, d) each."""
    true, mine, best = run.truth, pq.read_table(run.history), pq.read_table(run.bound)
    names = [n for n in true.channels if n.endswith(f".{quantity}")]
    found = np.stack([np.interp(t, mine["t"], mine[n]) for n in names], axis=1)
    truth = np.stack([np.interp(t, true.t, true.channels[n]) for n in names], axis=1)
    sd = np.stack([np.interp(t, best["t"], best[f"{n}.sd"]) for n in names], axis=1)
    return found - truth, sd


def _converged(t: Array, error: Array, settled: float) -> float | None:
    far = np.sqrt(np.mean(error**2, axis=(0, 2))) > NEAR * settled
    last = int(np.flatnonzero(far)[-1]) + 1 if far.any() else 0
    return None if last == len(t) else float(t[last] - t[0])
