"""Faults of every kind on a virtual arm at work, and what is told of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from urdyn.diagnose import diagnose
from urdyn.identify import Fit, identify
from urdyn.model.arm import load_arm
from urdyn.report.bench.confusion import Kinds
from urdyn.report.bench.table_three import OnArm
from urdyn.signal import condition
from urdyn.simulate import (
    Work,
    happening,
    observe,
    parse_fault,
    plan,
    to_and_fro,
    virtual_arm,
)

if TYPE_CHECKING:
    from urdyn.model.dynamics import Dynamics
    from urdyn.simulate import Sensors

DURATION, ONSET, RATE = 90.0, 30.0, 100.0  # [s], [s], [Hz]
# One fault of each kind, large enough to be found in a minute: which, where and when follow.
FAULTS = {
    "friction_increase": "friction_increase:joint={j},onset={t},rate=0.4,shape=step",
    "health_degradation": "health_degradation:joint={j},onset={t},rate=0.15,shape=step",
    "joint_backlash": "joint_backlash:joint={j},onset={t},rate=0.001,shape=step",
    "controller_instability": "controller_instability:joint={j},onset={t},rate=1.5,shape=step",
    "payload_change": "payload_change:onset={t},mass={m}",
    "collision": "collision:link={l},force={f},onset={t}",
    "encoder_offset": "encoder_offset:joint={g},offset=0.03,onset={t}",
    "sensor_fault": "sensor_fault:joint={j},mode={mode},size=2,onset={t}",
}
PAIRS = (
    ("friction_increase", "health_degradation"),
    ("friction_increase", "payload_change"),
    ("health_degradation", "sensor_fault"),
    ("collision", "friction_increase"),
)
Sets = tuple[tuple[str, ...], ...]  # kinds that are there at once
ALONE: Sets = ((), *((kind,) for kind in FAULTS))
PROBED = "joint_backlash"  # shows where the load turns over quickly: its joint goes to and fro
NOTHING = "nothing"
BINS = (0.0, 0.5, 0.8, 0.95, 0.985, 1.01)  # [-] of confidence


@dataclass(frozen=True)
class Trial:
    """What was wrong in a run, and what was told: kinds with their joints."""

    truth: tuple[tuple[str, int | None], ...]
    told: tuple[tuple[str, int | None], ...]
    confidence: tuple[float, ...]  # [-] of each that was told
    delays: tuple[float, ...]  # [s] from the onset to the alarm of each
    hidden: tuple[tuple[str, int | None], ...] = ()  # of the truth, what its motion cannot show

    @property
    def delay(self) -> float | None:
        """[s] of the first alarm; None: none."""
        return min(self.delays, default=None)

    @property
    def right(self) -> bool:
        """Every fault was found, on its joint, and nothing else."""
        return sorted(map(str, self.truth)) == sorted(map(str, self.told))


def commissioned(robot: str, seed: int, sensors: Sensors) -> tuple[Dynamics, Fit]:
    """A virtual arm, and the twin that forty seconds make of it."""
    arm = load_arm(robot)
    dynamics = virtual_arm(arm, seed)
    rng = np.random.default_rng([seed, 0])
    work = plan("fourier", dynamics.arm, 40.0, RATE, rng)
    log = observe(dynamics, work.trajectory, sensors, rng)
    return dynamics, identify(arm, condition(log))


def trials(
    dynamics: Dynamics, fit: Fit, sensors: Sensors, runs: int, seed: int, sets: Sets
) -> Iterator[Trial]:
    """As many runs of each set of kinds."""
    for k in range(runs * len(sets)):
        rng = np.random.default_rng([seed, k])
        yield _trial(dynamics, fit, sensors, sets[k % len(sets)], rng)


def _trial(
    dynamics: Dynamics, fit: Fit, sensors: Sensors, kinds: tuple[str, ...], rng: np.random.Generator
) -> Trial:
    joints = rng.permutation(dynamics.arm.joints)
    texts, truth = [], []
    for kind, joint in zip(kinds, joints, strict=False):
        text, where = _fault(kind, int(joint), rng)
        texts.append(text)
        truth.append((kind, where))
    faults = tuple(parse_fault(text, dynamics.arm.joints) for text in texts)
    work = plan("fourier", dynamics.arm, DURATION, RATE, rng)
    if kinds == (PROBED,):
        work = Work(to_and_fro(dynamics.arm, int(joints[0]), DURATION, RATE))
    events = happening(dynamics, work, faults, False)
    report = diagnose(fit, observe(dynamics, work.trajectory, sensors, rng, events))
    told = {(f.kind, f.joint): f for f in report.findings}
    sure = tuple(float(f.confidence) for f in told.values())
    delays = tuple(float(f.alarm_s) - ONSET for f in told.values())
    gears = report.document["observability"][PROBED]
    blind = [(PROBED, row["joint"]) for row in gears if not row["observable"]]
    hidden = tuple(fault for fault in truth if fault in blind)
    return Trial(tuple(truth), tuple(told), sure, delays, hidden)


def _fault(kind: str, joint: int, rng: np.random.Generator) -> tuple[str, int | None]:
    """A fault as `urdyn simulate` has it, and the joint that is to be told."""
    force = rng.standard_normal(3)
    force *= rng.uniform(80.0, 200.0) / np.linalg.norm(force)
    link, gravity = int(rng.integers(3, 6)), int(rng.integers(1, 3))
    text = FAULTS[kind].format(
        j=joint, l=link, g=gravity, t=ONSET,
        m=f"{rng.uniform(0.5, 3.0):.2f}",
        f="/".join(f"{x:.1f}" for x in force),
        mode=rng.choice(["stuck", "biased", "noisy", "dropped"]),
    )  # fmt: skip
    where = {"payload_change": None, "collision": link, "encoder_offset": gravity}
    return text, where.get(kind, joint)


def counted(done: list[Trial]) -> Kinds:
    """How often each true kind was told as which, on the right joint or on another."""
    truth = [*FAULTS, NOTHING]
    told = [*FAULTS, "another joint", NOTHING]
    counts = np.zeros((len(truth), len(told)), dtype=np.int64)
    for trial in done:
        left = list(trial.told)
        missed = []
        for kind, joint in trial.truth:
            if (kind, joint) in left:
                left.remove((kind, joint))
                counts[truth.index(kind), told.index(kind)] += 1
            else:
                missed.append(kind)
        for kind in missed:
            as_what = left.pop(0)[0] if left else NOTHING
            as_what = "another joint" if as_what == kind else as_what
            counts[truth.index(kind), told.index(as_what)] += 1
        for kind, _ in left or ([] if trial.truth else [(NOTHING, None)]):
            counts[truth.index(NOTHING), told.index(kind)] += 1
    return Kinds(counts, tuple(truth), tuple(told))


def on_arm(done: list[Trial], kind: str, name: str) -> OnArm:
    """What came of a kind; `name` is what it is called there."""
    broken = [(t, fault) for t in done for fault in t.truth if fault[0] == kind]
    found = [
        (t.delays[i], t.confidence[i])
        for t, fault in broken
        for i, told in enumerate(t.told)
        if told == fault
    ]
    delay, sure = np.median(found, axis=0).tolist() if found else (np.nan, np.nan)
    return OnArm(
        fault=name,
        found=len(found) / len(broken),
        runs=len(broken),
        hidden=sum(fault in t.hidden for t, fault in broken),
        delay=RATE * delay,
        delay_s=delay,
        sure=sure,
        false=sum(told[0] == kind and told not in t.truth for t in done for told in t.told),
        steps=round(len(done) * DURATION * RATE),
    )


def named(done: list[Trial]) -> dict[str, list[int]]:
    """By kind, findings that had the right kind and joint, and all."""
    counts = {kind: [0, 0] for kind in FAULTS}
    for trial in done:
        for kind, joint in trial.told:
            counts[kind][0] += (kind, joint) in trial.truth
            counts[kind][1] += 1
    return counts


def reliability(done: list[Trial]) -> list[tuple[float, float, int]]:
    """How confident findings were, which share of them was right, and how many, by BINS."""
    each = [
        (confidence, told in trial.truth)
        for trial in done
        for told, confidence in zip(trial.told, trial.confidence, strict=True)
    ]
    bins = []
    for lo, hi in pairwise(BINS):
        inside = [row for row in each if lo <= row[0] < hi]
        if inside:
            confidence, right = np.mean(np.array(inside, dtype=np.float64), axis=0)
            bins.append((float(confidence), float(right), len(inside)))
    return bins
