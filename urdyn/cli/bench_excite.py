"""urdyn bench excite: our excitation beside random ones and recorded ones, of the same length."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

import urdyn as ud
from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice
from urdyn.progress import Progress
from urdyn.report.terminal import terminal_table

if TYPE_CHECKING:
    from urdyn.identify.excite import Excitation
    from urdyn.identify.excite.rating import Scale
    from urdyn.types import Motion

MOMENTS = 120  # of a motion, at which it is rated
WINDOW = 2.0  # [s] from one cut of a longer recording to the next
RECORDED = "ur10e_dynamics"  # folder of recorded excitations of a UR10e
COLUMNS = "timestamp,actual_q*6,actual_qd*6,actual_current*6,target_current*6,target_moment*6"
AT_MOST = 120.0  # [s] that 20 s of motion may take

Count = Annotated[int, typer.Option(metavar="N", min=1, help="Random trajectories.")]
Duration = Annotated[float, typer.Option(metavar="S", help="Length of every motion.")]
Seed = Annotated[int, typer.Option(min=0, help="Of ours, and of the random ones.")]


@dataclass(frozen=True)
class Rated:
    """Some motions, and the best of them by either measure."""

    name: str
    count: int
    log_det: float
    condition: float


def bench_excite(
    random: Count = 10_000,
    duration: Duration = 20.0,
    seed: Seed = 0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Rate our excitation of a UR10e beside random ones, and recorded ones where there are any.

    Recordings are those in the folder that URDYN_RECORDINGS names. What is rated is the information
    on the base parameters, without prior, at the same limits and length; collisions, which rule out
    many of the random ones, are not held against them.

    Example: [bold]urdyn bench excite --random 1000[/bold]
    """
    from threadpoolctl import threadpool_limits

    from urdyn.identify.excite import Ask, excite
    from urdyn.identify.excite.rating import scale

    voice, begin = Voice(json, quiet), time.perf_counter()
    ask = Ask(duration=duration, seed=seed)
    with voice.progress("looking for a motion") as progress, threadpool_limits(1):
        found = excite(ud.load_arm("ur10e"), ask, None, progress, processes=2)
        wall = time.perf_counter() - begin
        ruler = scale(found.question)
        t = np.linspace(0.0, found.trajectory.t[-1], MOMENTS, endpoint=False)
        mine = ruler.rate(*found.path.at(t), float(len(found.trajectory)))
        ours = Rated("ours", 1, mine.log_det, mine.condition)
        others = [_random(found, ruler, random, progress), *_recorded(ruler, duration)]
    cases = [_beside(ours, other) for other in others]
    voice.show(_table(ours, cases, wall))
    voice.result(
        {
            "wall_s": wall,
            "wall_target_s": AT_MOST,
            "log_det": ours.log_det,
            "condition": ours.condition,
            "cases": cases,
        }
    )


def _random(found: Excitation, ruler: Scale, count: int, progress: Progress) -> Rated:
    """The best of `count` random series within the same limits."""
    from urdyn.identify.excite.restart import loaded
    from urdyn.simulate.fourier import HARMONICS, draw, series_within

    arm, period = loaded(found.question), found.path.lasting
    rng = np.random.default_rng((found.ask.seed, 1))
    t = np.linspace(0.0, period, MOMENTS, endpoint=False)
    ratings = []
    for k in range(count):
        progress("random motions", k / count)
        series = series_within(arm, draw(arm.joints, period, rng, HARMONICS), found.ask.limits)
        ratings.append(ruler.rate(*series.at(t), float(len(found.trajectory))))
    return Rated(
        "random",
        count,
        max(one.log_det for one in ratings),
        min(one.condition for one in ratings),
    )


def _recorded(ruler: Scale, duration: float) -> Iterator[Rated]:
    """Recorded excitations, each by its best cut of the length."""
    folder = Path(os.environ.get("URDYN_RECORDINGS", "")) / RECORDED
    for path in sorted(folder.glob("*harm*.csv")):
        motion = ud.condition(ud.read(path, columns=COLUMNS))
        ratings = [ruler.rate(*cut, 500.0 * duration) for cut in _cuts(motion, duration)]
        if ratings:
            best = max(one.log_det for one in ratings)
            yield Rated(path.stem, len(ratings), best, min(one.condition for one in ratings))


def _cuts(motion: Motion, duration: float) -> Iterator[tuple[Any, Any, Any]]:
    """Every cut of a recording that is as long as ours, at four times as many moments."""
    for begin in np.arange(motion.t[0], motion.t[-1] - duration, WINDOW):
        rows = np.searchsorted(motion.t, np.linspace(begin, begin + duration, 4 * MOMENTS))
        rows = rows[np.isfinite(motion.a[rows]).all(axis=1)]
        yield motion.q[rows], motion.v[rows], motion.a[rows]


def _beside(ours: Rated, other: Rated) -> dict[str, Any]:
    beaten = ours.log_det >= other.log_det and ours.condition <= other.condition
    return asdict(other) | {"pass": beaten}


def _table(ours: Rated, cases: list[dict[str, Any]], wall: float) -> Table:
    heads = (
        "motion",
        "count",
        "log det",
        "ours better by",
        "condition",
        "ours smaller by",
        "verdict",
    )
    verdict = f"{wall:.0f} s, {'pass' if wall <= AT_MOST else 'fail'}"
    first = (ours.name, "1", f"{ours.log_det:.1f}", "", f"{ours.condition:.0f}", "", verdict)
    rows = (
        (
            other["name"],
            str(other["count"]),
            f"{other['log_det']:.1f}",
            f"{ours.log_det - other['log_det']:.1f}",
            f"{other['condition']:.0f}",
            f"{100.0 * (1.0 - ours.condition / other['condition']):.0f} %",
            "pass" if other["pass"] else "fail",
        )
        for other in cases
    )
    return terminal_table("", heads, [first, *rows])
