"""The paper's Table III: its rates of detection, and ours on its scenario and on a whole arm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from urdyn.report.bench.shares import rate_of, share_of
from urdyn.report.digits import MISSING, number, percent

TOGETHER = "Shiryaev-Roberts, six joints"
HEADS = ("fault", "who", "found (95 %)", "false in 1000 steps", "delay [steps]", "sure")


@dataclass(frozen=True)
class Row:
    """One detector on one fault at one level of noise."""

    fault: str  # "friction increase" or "health degradation"
    sigma: float  # [unit]
    ratio: float  # [-] growth in one step over sigma
    detector: str
    found: float  # share of lives, before the true parameter crosses the warning level
    delay: float  # [steps] from onset to alarm, mean; NaN where 1 % or more are never found
    against_oracle: float  # [-] delay over the oracle's
    false_per_1000: float  # alarms in 1000 healthy steps
    lives: int  # of which `found` is a share: those without an alarm before the onset


@dataclass(frozen=True)
class OnArm:
    """One kind of fault on a virtual arm that is tracked as a whole."""

    fault: str  # as Table III has it
    found: float  # share of the faults that were reported, on their joint
    runs: int  # of which `found` is a share
    hidden: int  # of them, those that the motion cannot show
    delay: float  # [steps] from onset to alarm, median of those found; NaN where none was
    delay_s: float  # [s] the same
    sure: float  # [-] confidence of those found, median
    false: int  # findings of the kind that were wrong
    steps: int  # [samples] in which those occurred

    @property
    def false_per_1000(self) -> float:
        """Wrong findings of this kind in 1000 steps."""
        return 1000.0 * self.false / self.steps


def table_three(
    rows: Sequence[Row], on_arm: Sequence[OnArm], paper: Mapping[str, tuple[float, float, float]]
) -> Iterator[tuple[str, ...]]:
    """Cells under `HEADS`: for each fault the paper's, then ours.

    Args:
        paper: detection rate, "FP rate" and latency [steps] of each fault.
    """
    for fault, (found, false, latency) in paper.items():
        told = (percent(found), f"{percent(false)} FP rate", f"{latency:g}", MISSING)
        yield fault, "the paper", *told
        for row in rows:
            if row.fault == fault and row.detector == TOGETHER:
                yield fault, f"urdyn, {row.ratio:g} sigma a step", *_on_scenario(row)
        for arm in on_arm:
            if arm.fault == fault:
                yield fault, "urdyn, virtual arm", *_on_arm(arm)


def _on_scenario(row: Row) -> tuple[str, ...]:
    mine = share_of(row.found, row.lives)
    return mine, f"{row.false_per_1000:.2g}", steps_of(row.delay), MISSING


def _on_arm(arm: OnArm) -> tuple[str, ...]:
    shown = f", {arm.hidden} not to be seen" if arm.hidden else ""
    found = f"{share_of(arm.found, arm.runs)}{shown}"
    delay = f"{arm.delay:.0f} ({number(arm.delay_s)} s)" if arm.delay_s > 0.0 else MISSING
    return found, rate_of(arm.false, arm.steps), delay, percent(arm.sure)


def steps_of(delay: float) -> str:
    """A delay in steps; a dash where too few alarms came."""
    return f"{delay:.1f}" if delay > 0.0 else "-"
