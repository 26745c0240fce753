"""A whole virtual arm: commissioned, recorded, and what a tracked history is worth against it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from urdyn.identify import PayloadPrior, Run, identify
from urdyn.io import write
from urdyn.model.arm import load_arm
from urdyn.signal import condition
from urdyn.simulate import Fault, Payload, simulate
from urdyn.simulate.mishaps import EncoderOffset
from urdyn.simulate.wear import HealthDegradation
from urdyn.tracking.model import HEALTH_SD, ZERO_SD
from urdyn.twin import Twin
from urdyn.types import Array

COMMISSIONING = 12.0  # [s] bare, and as long with a payload of known mass, which tells the gains
PAYLOAD = Payload(5.0, np.array([0.0, 0.02, 0.06]))
SETTLED = 0.5  # [-] of the run, of which the errors are told
NEAR = 1.3  # [-] of the error of the second half: converged where it stays below
QUANTITIES = {
    "k": ("zero", "rad"),
    "m": ("mass", "kg"),
    "f": ("coulomb", "N·m"),
    "alpha": ("viscous", "N·m·s/rad"),
    "beta": ("structural", "-"),
    "z": ("health", "-"),
}


@dataclass(frozen=True)
class VirtualArm:
    """A twin, a recording that it has not seen, and the truth behind both."""

    twin: Path
    log: Path
    truth: Mapping[str, float]  # "elbow_joint.coulomb", "forearm_link.mass", ...
    duration: float  # [s] of the recording
    rate: float  # [Hz]


@dataclass(frozen=True)
class Group:
    """Errors of one group of parameters over joints or links and the second half of a run."""

    symbol: str
    unit: str
    rmse: float
    bound: float
    converged: float | None  # [s] until the error stays near that of the second half

    @property
    def ratio(self) -> float:
        """Error in units of the bound."""
        return self.rmse / self.bound


def virtual_run(folder: Path, duration: float, rate: float, seed: int = 1) -> VirtualArm:
    """A UR10e of this seed, identified from its commissioning, then recorded for `duration` [s].

    In between zeros and health of its joints moved, by as much as a twin is told to expect.
    """
    arm, rows = load_arm("ur10e"), round(COMMISSIONING * rate)
    rng = np.random.default_rng(seed)
    zero = ZERO_SD * rng.standard_normal(arm.joints)
    lost = HEALTH_SD * np.abs(rng.standard_normal(arm.joints))
    moved: list[Fault] = []
    for j in range(arm.joints):
        moved.append(EncoderOffset(j, offset=float(-zero[j]), onset=COMMISSIONING))
        moved.append(HealthDegradation(j, float(lost[j]), COMMISSIONING, "step"))
    whole, truth = simulate(arm, COMMISSIONING + duration, rate, seed, events=moved)
    loaded, _ = simulate(arm, COMMISSIONING, rate, seed, payload=PAYLOAD)
    lifted = Run(condition(loaded), PayloadPrior(PAYLOAD.mass))
    fit = identify(arm, condition(whole.slice(0, rows)), loaded=[lifted])
    twin, log = folder / "twin.toml", folder / "log.parquet"
    Twin(arm, fit).save(twin)
    write(whole.slice(rows), log)
    now = {f"{name}.zero": float(x) for name, x in zip(arm.joint_names, zero, strict=True)}
    now |= {f"{name}.health": 1.0 - float(x) for name, x in zip(arm.joint_names, lost, strict=True)}
    return VirtualArm(twin, log, _values(truth) | now, duration, rate)


def _values(truth: Mapping[str, Any]) -> dict[str, float]:
    """The truth of the first day by the names that a history has."""
    names = ("coulomb", "viscous", "structural")
    found = {f"{j['name']}.{name}": float(j[name]) for j in truth["joints"] for name in names}
    return found | {f"{link['name']}.mass": float(link["mass"]) for link in truth["links"]}


def groups(history: Path, bound: Path, truth: Mapping[str, float]) -> list[Group]:
    """Errors of a history by Table I's groups.

    `bound` is the history of an extended Kalman filter: its standard deviations are Tichavsky's
    recursion with the Jacobians taken along its own estimate.
    """
    mine, best = pq.read_table(history), pq.read_table(bound)
    t = np.asarray(mine["t"])
    t = t - t[0]
    late = t > SETTLED * t[-1]
    found = []
    for symbol, (quantity, unit) in QUANTITIES.items():
        names = [n for n in truth if n.endswith(f".{quantity}")]
        error = np.stack([np.asarray(mine[n]) - truth[n] for n in names], axis=1)
        sd = np.stack([np.asarray(best[f"{n}.sd"]) for n in names], axis=1)
        sd = sd[np.asarray(best["t"]) - np.asarray(best["t"])[0] > SETTLED * t[-1]]
        rmse = _rms(error[late])
        found.append(Group(symbol, unit, rmse, _rms(sd), _converged(t, error, rmse)))
    return found


def _converged(t: Array, error: Array, settled: float) -> float | None:
    far = np.sqrt(np.mean(error**2, axis=1)) > NEAR * settled
    last = int(np.flatnonzero(far)[-1]) + 1 if far.any() else 0
    return None if last == len(t) else float(t[last])


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))
