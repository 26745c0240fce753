"""urdyn bench simulate: how much faster than real time the virtual arm runs, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

import urdyn as ud
from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice
from urdyn.report.terminal import terminal_table

if TYPE_CHECKING:
    from urdyn.simulate import Fidelity


def bench_simulate(json: Json = False, quiet: Quiet = False) -> None:
    """Measure the virtual arm: closed loop, elastic closed loop, and currents from a plan.

    Example: [bold]urdyn bench simulate[/bold]
    """
    from threadpoolctl import threadpool_limits

    voice = Voice(json, quiet)
    with voice.progress("simulating"), threadpool_limits(1):
        paces = list(_paces())
    voice.show(_table(paces))
    voice.result({"cases": paces})


def _paces() -> Iterator[dict[str, Any]]:
    from urdyn.simulate import forward, inverse, typical_gears

    arm = ud.load_arm("ur10e")
    elastic = partial(forward, gears=typical_gears(arm))
    yield _lived("forward", forward, 500.0, 20.0, 20.0)
    yield _lived("forward, elastic gears", elastic, 500.0, 4.0, 2.0)
    yield _lived("inverse, currents", inverse, 125.0, 600.0, 1000.0)
    yield _lived("inverse, currents", inverse, 20.0, 3600.0, 1000.0)


def _lived(
    name: str, fidelity: Fidelity, rate: float, duration: float, least: float
) -> dict[str, Any]:
    """Simulated time over wall time of one fidelity alone: the motion is planned beforehand."""
    from urdyn.simulate import fourier, virtual_arm

    arm = ud.load_arm("ur10e")
    dynamics = virtual_arm(arm, 0)
    asked = fourier(arm, duration, rate, np.random.default_rng(0))

    def live() -> None:
        for _ in fidelity(dynamics, asked, asked.t, ()):
            pass

    ratio = duration / min(_wall(live) for _ in range(3))
    return {
        "name": name,
        "rate_hz": rate,
        "duration_s": duration,
        "times_real_time": ratio,
        "target": least,
        "pass": ratio >= least,
    }


def _wall(call: Callable[[], None]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def _table(paces: list[dict[str, Any]]) -> Table:
    heads = ("simulate", "rows [Hz]", "simulated [s]", "times real time", "target", "verdict")
    rows = (
        (
            pace["name"],
            f"{pace['rate_hz']:g}",
            f"{pace['duration_s']:g}",
            f"{pace['times_real_time']:,.0f}",
            f"{pace['target']:g}",
            "pass" if pace["pass"] else "fail",
        )
        for pace in paces
    )
    return terminal_table("", heads, rows)
