"""urdyn bench track: the paper's Tables I, II and IV beside ours, and the best possible."""

from __future__ import annotations

import json as encode
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import urdyn as ud
from urdyn.cli.fresh import fresh
from urdyn.cli.options import Json, Page, Quiet
from urdyn.cli.voice import Voice
from urdyn.io.plain import jsonable
from urdyn.progress import Progress

if TYPE_CHECKING:
    from urdyn.bench import Followed, VirtualArm

SIGMAS = (0.05, 0.25)  # of the scenario: where the paper is 0.03 low, and its own noise
PACE = 100.0  # [Hz] of the arm's recording
ON_ARM = {"EKF": "ekf", "UKF": "ukf", "PF (1k particles)": "particle", "VI": "variational"}
FULL, BEST = "UKF", "EKF"  # the modes' filter; the one whose Jacobians make the bound
ARMS = {False: ("ur10e", "ur5e"), True: ("ur10e",)}  # whose intervals are tested; fewer if quick
NOISES = ("white", "real")
OTHER_MODES = ("simplified", "realtime")  # of Table IV, beside the full one, that `urdyn track` has
WAYS = {name: ("--filter", option) for name, option in ON_ARM.items()} | {
    mode: ("--mode", mode) for mode in OTHER_MODES
}

Quick = Annotated[bool, typer.Option("--quick", help="Fewer lives, and a shorter recording.")]
Count = Annotated[int, typer.Option(min=1, help="Arms of each kind that are set beside the truth.")]
Document = dict[str, Any]


def bench_track(
    quick: Quick = False,
    arms: Count = 4,
    out: Page = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Track ramps, the paper's scenario and a virtual arm; its Tables I, II and IV beside ours.

    Every error stands beside the posterior Cramer-Rao bound, which no filter betters but by luck;
    and what a twin says of its own errors beside those that virtual arms show.

    Example: [bold]urdyn bench track --quick --out bench.html[/bold]
    """
    from urdyn.cli.bench_tables import notes, tables
    from urdyn.cli.results import require_place

    require_place(out)
    voice = Voice(json, quiet)
    with (
        voice.progress("ramps") as progress,
        tempfile.TemporaryDirectory(prefix="urdyn-") as folder,
    ):
        kinds = [(robot, noise) for robot in ARMS[quick] for noise in NOISES]
        count, duration = (2, 10.0) if quick else (arms, 60.0)
        document = measure(Path(folder), 10 if quick else 40, count, 10.0, progress)
        document["truth"] = tried(kinds, count, duration, progress)
    voice.show(*tables(document), *notes(document))
    if out:
        from urdyn.io import write_text
        from urdyn.report.bench.track import bench_page

        write_text(out, bench_page(document))
        voice.note(f"written: {out}")
    voice.result(document)


def measure(folder: Path, lives: int, arms: int, duration: float, progress: Progress) -> Document:
    """All figures, from `lives` of the scenario and recordings of `arms` arms, `duration` [s] each.

    Time and memory are those of the first arm.
    """
    from threadpoolctl import threadpool_limits

    from urdyn import bench
    from urdyn.simulate.paper import FRICTION_INCREASE, NOISE_LEVELS, reconstruction

    with threadpool_limits(1):
        ramps = []
        for k, sigma in enumerate(NOISE_LEVELS):
            progress(f"ramps, sigma {sigma:g}", 0.05 * k)
            ramps.append(bench.ramps(sigma, 2 * lives))
        progress("the paper's scenario", 0.3)
        scenario = {sigma: _scenario(sigma, lives) for sigma in SIGMAS}
    built, took = [], []
    for k in range(arms):
        progress(f"virtual arm {k + 1}", 0.4 + 0.6 * k / arms)
        with threadpool_limits(1):
            built.append(bench.virtual_run(folder / str(k + 1), duration, PACE, seed=k + 1))
        took.append(_each_way(built[k], progress, 0.4 + 0.6 * k / arms))
    runs, found = took[0], {name: _groups(built, name) for name in WAYS}
    modes = {"full": FULL} | {mode: mode for mode in OTHER_MODES}
    return {
        "urdyn": ud.__version__,
        "reconstruction": reconstruction(replace(FRICTION_INCREASE, sigma=SIGMAS[0])),
        "arm": {"robot": "ur10e", "arms": arms, "duration_s": duration, "rate_hz": PACE},
        "ramps": [asdict(r) | {"ratio": r.ratio, "pass": r.honest} for r in ramps],
        "table_1": _table_1(scenario, found[FULL]),
        "table_2": _table_2(scenario[SIGMAS[-1]], found, runs),
        "table_4": [
            asdict(c)
            | {"ours": runs.get(modes.get(c.mode, "")), "accuracy": _friction(found, modes, c.mode)}
            for c in bench.CONFIGURATIONS
        ],
    }


def tried(
    kinds: list[tuple[str, str]], count: int, duration: float, progress: Progress
) -> list[Document]:
    """Coverage of intervals, by type of arm and noise: `count` of each, for `duration` [s]."""
    from threadpoolctl import threadpool_limits

    from urdyn import bench
    from urdyn.estimate import UKF

    found = []
    for k, (robot, noise) in enumerate(kinds):
        runs = []
        for seed in range(1, count + 1):
            progress(f"{robot}, {noise} noise, arm {seed}", (k + (seed - 1) / count) / len(kinds))
            with threadpool_limits(1):
                runs.append(bench.trials(robot, noise, seed, duration, PACE, UKF()))
        nis, spread = bench.surprise(runs)
        rows = [asdict(truth) | {"pass": truth.honest} for truth in bench.truths(runs)]
        arms = {"robot": robot, "noise": noise, "arms": count, "duration_s": duration}
        found.append(arms | jsonable({"groups": rows, "nis": nis, "sd": spread}))
    return found


def _scenario(sigma: float, lives: int) -> list[Followed]:
    """Both of the paper's faults at one noise level."""
    from urdyn.bench import follow_friction, follow_health
    from urdyn.simulate.paper import FRICTION_INCREASE, HEALTH_DEGRADATION

    return [
        *follow_friction(replace(FRICTION_INCREASE, sigma=sigma), lives),
        *follow_health(replace(HEALTH_DEGRADATION, sigma=sigma), lives),
    ]


def _each_way(arm: VirtualArm, progress: Progress, share: float) -> dict[str, Document]:
    """Time and memory of tracking it with every filter, and in every mode."""
    took = {}
    for name, how in WAYS.items():
        progress(f"virtual arm {arm.log.parent.name}, {name}", share)
        took[name] = _tracked(arm, name, *how)
    return took


def _tracked(arm: VirtualArm, name: str, *how: str) -> Document:
    """Pace and memory of `urdyn track` in a process of its own."""
    out = arm.log.parent / name
    took = fresh("track", str(arm.twin), str(arm.log), "--out", str(out), *how, "--json")
    said = encode.loads(took.said)
    latency = {f"{name}_ms": said["latency_ms"][name] for name in ("p50", "p99")}
    return {"hz": said["rate_hz"], **latency, "mb": said["rss_mb"]}


def _groups(arms: list[VirtualArm], name: str) -> dict[str, Document]:
    """Errors of tracked histories by group."""
    from urdyn.bench import Tracked, groups
    from urdyn.io.run_folder import HISTORY

    def history(arm: VirtualArm, name: str) -> Path:
        return arm.log.parent / name / HISTORY

    runs = [Tracked(arm.truth, history(arm, name), history(arm, BEST)) for arm in arms]
    return {group.symbol: asdict(group) | {"ratio": group.ratio} for group in groups(runs)}


def _friction(
    found: dict[str, dict[str, Document]], modes: dict[str, str], mode: str
) -> Document | None:
    """Its error in a mode of Table IV; None where there is no such mode."""
    return found[modes[mode]]["f"] if mode in modes else None


def _table_1(scenario: dict[float, list[Followed]], arm: dict[str, Document]) -> list[Document]:
    from urdyn.bench import GROUPS

    rows = []
    for group in GROUPS:
        ours = [
            asdict(f) | {"sigma": sigma, "ratio": f.ratio}
            for sigma, followed in scenario.items()
            for f in followed
            if f.symbol == group.symbol and f.filter == "bank"
        ]
        rows.append(asdict(group) | {"scenario": ours, "arm": arm[group.symbol]})
    return rows


def _table_2(
    scenario: list[Followed], arm: dict[str, dict[str, Document]], runs: dict[str, Document]
) -> list[Document]:
    """The paper's four, then the bank, which the paper does not have."""
    from urdyn.bench import ALGORITHMS

    theirs = {a.name: {f"paper_{k}": v for k, v in asdict(a).items()} for a in ALGORITHMS}
    return [
        theirs.get(f.filter, {})
        | {"name": f.filter, "process": f.process, "scenario": asdict(f) | {"ratio": f.ratio}}
        | {"arm": arm[f.filter]["f"] | runs[f.filter] if f.filter in runs else None}
        for f in scenario
        if f.symbol == "f"
    ]
