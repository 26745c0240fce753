"""Faults of every kind on a virtual arm at work, and the findings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from urdyn.diagnose import diagnose
from urdyn.diagnose.slow.slow import BLOCK
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

DURATION, ONSET, RATE = 90.0, 30.0, 100.0  # [s], [s] earliest, within a block of it, [Hz]
# One fault of each kind, large enough to be found in a minute; joints and times are filled in.
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
    ("friction_increase+health_degradation",),
)
Fault = tuple[str, int | None]  # a kind and its joint
Sets = tuple[tuple[str, ...], ...]  # kinds that are present at once; with a +, on one joint
ALONE: Sets = ((), *((kind,) for kind in FAULTS))
PROBED = "joint_backlash"  # shows where the load changes sign quickly: its joint moves to and fro
NOTHING = "nothing"
BINS = (0.0, 0.5, 0.8, 0.95, 0.985, 1.01)  # [-] of confidence


@dataclass(frozen=True)
class Trial:
    """The faults of a run, and all findings in the order of alarm."""

    truth: tuple[Fault, ...]
    told: tuple[Fault, ...]
    confidence: tuple[float, ...]  # [-] of each finding
    delays: tuple[float, ...]  # [s] from the onset to each finding's alarm; < 0: before the onset
    hidden: tuple[Fault, ...] = ()  # true faults that the motion cannot show
    held: tuple[bool, ...] = ()  # whether each finding's interval holds the onset

    @property
    def found(self) -> dict[Fault, int]:
        """For each fault found after its onset, the first index in `told`."""
        places: dict[Fault, int] = {}
        for place, (fault, delay) in enumerate(zip(self.told, self.delays, strict=True)):
            if fault in self.truth and delay >= 0.0:
                places.setdefault(fault, place)
        return places

    @property
    def wrong(self) -> list[int]:
        """Indices in `told` of all others: no such fault, before its onset, or repeated."""
        found = self.found.values()
        return [place for place in range(len(self.told)) if place not in found]

    @property
    def delay(self) -> float | None:
        """Time until a fault was found [s]; None: none was."""
        return min((self.delays[place] for place in self.found.values()), default=None)

    @property
    def timed(self) -> list[bool]:
        """For each fault found, whether its interval holds the onset."""
        return [self.held[place] for place in self.found.values()]

    @property
    def right(self) -> bool:
        """Whether every fault was found, on its joint, and nothing else."""
        return len(self.found) == len(self.truth) == len(self.told)


def commissioned(robot: str, seed: int, sensors: Sensors) -> tuple[Dynamics, Fit]:
    """A virtual arm, and its twin from forty seconds of commissioning."""
    arm = load_arm(robot)
    dynamics = virtual_arm(arm, seed)
    rng = np.random.default_rng([seed, 0])
    work = plan("fourier", dynamics.arm, 40.0, RATE, rng)
    log = observe(dynamics, work.trajectory, sensors, rng)
    return dynamics, identify(arm, condition(log))


def trials(
    dynamics: Dynamics, fit: Fit, sensors: Sensors, runs: int, seed: int, sets: Sets
) -> Iterator[Trial]:
    """`runs` trials of each set of kinds."""
    for k in range(runs * len(sets)):
        rng = np.random.default_rng([seed, k])
        yield _trial(dynamics, fit, sensors, sets[k % len(sets)], rng)


def _trial(
    dynamics: Dynamics, fit: Fit, sensors: Sensors, kinds: tuple[str, ...], rng: np.random.Generator
) -> Trial:
    joints, onset = rng.permutation(dynamics.arm.joints), ONSET + rng.uniform(0.0, BLOCK)
    texts, truth = [], []
    for alike, joint in zip(kinds, joints, strict=False):
        for kind in alike.split("+"):
            text, where = _fault(kind, int(joint), onset, rng)
            texts.append(text)
            truth.append((kind, where))
    faults = tuple(parse_fault(text, dynamics.arm.joints) for text in texts)
    work = plan("fourier", dynamics.arm, DURATION, RATE, rng)
    if kinds == (PROBED,):
        work = Work(to_and_fro(dynamics.arm, int(joints[0]), DURATION, RATE))
    events = happening(dynamics, work, faults, False)
    report = diagnose(fit, observe(dynamics, work.trajectory, sensors, rng, events))
    findings = sorted(report.findings, key=lambda f: f.alarm_s)
    told = tuple((f.kind, f.joint) for f in findings)
    sure = tuple(float(f.confidence) for f in findings)
    delays = tuple(float(f.alarm_s) - onset for f in findings)
    began = [f.onset_interval_s for f in findings]
    held = tuple(bool(first <= onset <= last) for first, last in began)
    gears = report.document["observability"][PROBED]
    blind = [(PROBED, row["joint"]) for row in gears if not row["observable"]]
    hidden = tuple(fault for fault in truth if fault in blind)
    return Trial(tuple(truth), told, sure, delays, hidden, held)


def _fault(kind: str, joint: int, onset: float, rng: np.random.Generator) -> tuple[str, int | None]:
    """A fault as `urdyn simulate` takes it, and the joint that is to be reported."""
    force = rng.standard_normal(3)
    force *= rng.uniform(80.0, 200.0) / np.linalg.norm(force)
    link, gravity = int(rng.integers(3, 6)), int(rng.integers(1, 3))
    text = FAULTS[kind].format(
        j=joint, l=link, g=gravity, t=onset,
        m=f"{rng.uniform(0.5, 3.0):.2f}",
        f="/".join(f"{x:.1f}" for x in force),
        mode=rng.choice(["stuck", "biased", "noisy", "dropped"]),
    )  # fmt: skip
    where = {"payload_change": None, "collision": link, "encoder_offset": gravity}
    return text, where.get(kind, joint)


def counted(done: list[Trial]) -> Kinds:
    """How often each true kind was reported as which, on the right joint or on another."""
    truth = [*FAULTS, NOTHING]
    told = [*FAULTS, "another joint", NOTHING]
    counts = np.zeros((len(truth), len(told)), dtype=np.int64)
    for trial in done:
        for kind, said in _pairs(trial):
            counts[truth.index(kind), told.index(said)] += 1
    return Kinds(counts, tuple(truth), tuple(told))


def _pairs(trial: Trial) -> Iterator[tuple[str, str]]:
    """True and reported kind of every fault, then of every finding without a fault.

    A missed fault is paired with the first finding of a fault that is not present.
    """
    wrong = trial.wrong
    shadows = [k for k in wrong if trial.told[k] not in trial.truth and trial.delays[k] >= 0.0]
    for fault in trial.truth:
        kind = said = fault[0]
        if fault not in trial.found:
            said = NOTHING
            if shadows:
                wrong.remove(shadows[0])
                said = trial.told[shadows.pop(0)][0]
                said = "another joint" if said == kind else said
        yield kind, said
    for place in wrong:
        yield NOTHING, trial.told[place][0]
    if not trial.truth and not trial.told:
        yield NOTHING, NOTHING


def on_arm(done: list[Trial], kind: str, name: str) -> OnArm:
    """Results for a kind of fault, with its display `name`."""
    broken = [(t, fault) for t in done for fault in t.truth if fault[0] == kind]
    found = [
        (t.delays[t.found[fault]], t.confidence[t.found[fault]])
        for t, fault in broken
        if fault in t.found
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
        false=sum(t.told[place][0] == kind for t in done for place in t.wrong),
        steps=round(len(done) * DURATION * RATE),
    )


def named(done: list[Trial]) -> dict[str, list[int]]:
    """By reported kind, the number of right findings (kind and joint), and of all."""
    counts = {kind: [0, 0] for kind in FAULTS}
    for trial in done:
        for place, (kind, _) in enumerate(trial.told):
            counts[kind][0] += place in trial.found.values()
            counts[kind][1] += 1
    return counts


def reliability(done: list[Trial]) -> list[tuple[float, float, int]]:
    """Mean confidence of findings, share that was right, and number, by BINS."""
    each = [
        (confidence, place in trial.found.values())
        for trial in done
        for place, confidence in enumerate(trial.confidence)
    ]
    bins = []
    for lo, hi in pairwise(BINS):
        inside = [row for row in each if lo <= row[0] < hi]
        if inside:
            confidence, right = np.mean(np.array(inside, dtype=np.float64), axis=0)
            bins.append((float(confidence), float(right), len(inside)))
    return bins
