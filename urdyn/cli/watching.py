"""Terminal output for an arm that is being tracked."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Table

from urdyn.cli.voice import Printable, Voice, redrawn
from urdyn.io.run_folder import MISSES
from urdyn.model.friction import WORKING_SPEED
from urdyn.report.digits import interval90, number
from urdyn.report.names import spoken
from urdyn.report.setting import set_to
from urdyn.report.terminal import terminal_table
from urdyn.tracking import RunProgress
from urdyn.tracking.belief.payload_setting import compared
from urdyn.tracking.belief.physical import weighed
from urdyn.tracking.output.progress import LATE, Watch

JOINT = {"friction": f"friction at {WORKING_SPEED} rad/s", "health": "health"}
PAUSE = 0.25  # [s] between two updates
LISTED = 6  # changes of the payload that a sentence has room for
QUICKNESS = "quick enough for {:.0f} Hz"  # a rate that no stream need have
ASTRAY = (
    "begun anew {} times, for no arm's drives are as these currents say: is it this arm's twin, "
    "are the currents in amperes, is every sensor sound, and was it moved by hand?"
)
LOST = (
    "nothing is tracked since stamp {:.1f} s: {} told no angle that can be from then on; "
    "see to the sensor, or to the recorder"
)
FROZEN = "speed of {joint} that stays while it moves {samples}, since stamp {since:.1f} s"
SPARSE = (
    "nothing is tracked for {for_s:.1f} s, the first from stamp {since:.1f} s on: samples came "
    "{step_s:.3g} s apart there, and the period of this run is {period_s:.3g} s; see to it that a "
    "stream keeps its rate, and track parts of a log by --rows"
)
MISSING = (
    "the average surprise is {}, where 1 or less is expected: something is missing from the model, "
    "and its intervals are too narrow"
)
TOUCHING = "in contact for {} of {} samples: nothing is learnt from their currents"
UNWEIGHED = "payload not known: the currents say too little of it"
SILENT = 1e-3  # [-] of a joint's samples without a current: fewer do not matter
QUICK = "mode {} is less accurate than full: `urdyn bench track` prints by how much"
SLOW = "it fell behind the robot: --mode realtime is quicker, and --rate asks for fewer samples"
BUSY = (
    "samples waited for longer than a second, though it is quick enough for them: something else "
    "kept this computer busy"
)


@contextmanager
def watching(joints: Sequence[str], voice: Voice) -> Iterator[Watch | None]:
    """A table that is kept up to date where it can be redrawn, elsewhere a line now and then."""
    if voice.quiet:
        yield None
        return
    if not redrawn(sys.stderr):
        with voice.progress("no sample yet") as told:
            yield lambda glance: told(f"tracked {_reached(glance)}", glance.share)
        return
    shown = -PAUSE
    with Live(console=Console(stderr=True), auto_refresh=False, transient=True) as live:

        def watch(glance: RunProgress) -> None:
            nonlocal shown
            if glance.ended or time.monotonic() - shown > PAUSE:
                live.update(Printable(table(glance, joints)), refresh=True)
                shown = time.monotonic()

        yield watch


def table(glance: RunProgress, joints: Sequence[str]) -> Table:
    """Friction and health of every joint, and the payload."""
    rows = zip(glance.mean, glance.sd, glance.units, strict=True)
    told = dict(zip(glance.names, rows, strict=True))
    mass, sd, _ = told["payload.mass"]
    known = weighed(glance.reading.belief, glance.quantities.currents)
    setting = compared(glance.setting, mass, sd, glance.quantities.whole, known)
    carried = f"{_carried(mass, sd, known)}{_set(setting)}"
    caption = f"{carried}; {_reached(glance)}; ± holds 90 %"
    heads = (f"{words} [{told[f'{joints[0]}.{name}'][2]}]" for name, words in JOINT.items())
    cells = (
        (spoken(joint), *(interval90(*told[f"{joint}.{name}"][:2]) for name in JOINT))
        for joint in joints
    )
    grid = terminal_table("", ("joint", *heads), cells)
    grid.caption = caption
    return grid


def _reached(glance: RunProgress) -> str:
    """How far the run has come, and how quickly."""
    share = f", {100 * glance.share:.0f} %" if glance.share else ""
    quick = ", ".join(filter(None, (QUICKNESS.format(glance.rate), glance.behind)))
    return f"{glance.t:.1f} s{', ending' if glance.ended else share}; {quick}"


def verdict(summary: dict[str, Any]) -> str:
    """A run in a sentence; what limits it follows in lines."""
    mass, latency = summary["final"]["payload.mass"], summary["latency_ms"]
    astray, lost = summary["quality"]["restarts"], summary["quality"]["lost"]
    sparse, surprise = summary["quality"]["too_sparse"], summary.get("surprise") or 0.0
    touching = summary["quality"]["in_contact"]
    sentence = (
        f"{summary['samples']} samples, {summary['data_s']:.1f} s, "
        f"{QUICKNESS.format(summary['rate_hz'])}; 99 % within {number(latency['p99'])} ms; "
        + _carried(mass["mean"], mass["sd"], summary["payload_known"])
        + _set(summary.get("payload_setting"))
        + _changes(summary["payload_changes"])
    )
    lines = (
        sentence,
        TOUCHING.format(touching, summary["samples"]) if touching else "",
        _lacked(summary),
        LOST.format(lost["since"], " and ".join(lost["joints"])) if lost else "",
        SPARSE.format(**sparse) if sparse else "",
        QUICK.format(summary["mode"]) if summary["mode"] != "full" else "",
        _why_late(summary) if latency["p99"] > 1e3 * LATE else "",
        ASTRAY.format(astray) if astray else "",
        MISSING.format(number(surprise)) if surprise > MISSES and not astray else "",
    )
    return "\n".join(filter(None, lines))


def _why_late(summary: dict[str, Any]) -> str:
    """Why samples waited: this computer is too slow, or busy with other work."""
    return BUSY if summary["rate_hz"] * summary["data_s"] > summary["samples"] else SLOW


def _carried(mass: float, sd: float, known: bool) -> str:
    """The payload [kg], where the motion has told it."""
    return f"payload {interval90(mass, sd)} kg" if known else UNWEIGHED


def _set(setting: Mapping[str, Any] | None) -> str:
    """The payload set in the controller, to follow what is carried."""
    return f" ({told})" if (told := set_to(setting)) else ""


def _lacked(summary: dict[str, Any]) -> str:
    """What the stream lacked, if anything; the page has the rest."""
    quality, samples = summary["quality"], summary["samples"]
    unit = " (are they in A?)" if quality["undrawn"] > samples else ""
    counts = {
        "gaps": f"gaps {quality['gaps']} ({quality['missing']} samples)",
        "repeated": f"stamps that came twice {quality['repeated']}",
        "clock_set": f"clock set {quality['clock_set']}",
        "refused": f"impossible angles or speeds {quality['refused']}",
        "undriven": f"samples of an arm moved by hand or without power {quality['undriven']}",
        "undrawn": f"currents that no motor draws {quality['undrawn']}{unit}",
    }
    if any(" gap " in defect for defect in quality["defects"]):  # its reader has reported it
        del counts["gaps"]
    told = [text for name, text in counts.items() if quality[name]] + quality["defects"]
    told += _stuck(quality["stuck"], summary)
    told += [FROZEN.format(**joint) for joint in quality["frozen"]]
    if (share := max(quality["without_current"])) > SILENT:
        told.append(f"of a joint's currents up to {number(100.0 * share)} % missing")
    return f"the stream was not whole: {'; '.join(told)}" if told else ""


def _stuck(counts: Sequence[int], summary: dict[str, Any]) -> list[str]:
    """Joints whose currents were left out, for they did not change while the joints moved."""
    names = (joint["name"] for joint in summary["quantities"]["joints"])
    return [
        f"currents of {name} that stay while it moves {count}"
        for name, count in zip(names, counts, strict=True)
        if count > SILENT * summary["samples"]
    ]


def _changes(times: Sequence[float]) -> str:
    """When the tracker found payload changes [s]; an arm that handles pieces has many."""
    if len(times) > LISTED:
        return f", changed {len(times)} times, last at stamp {times[-1]:.1f} s"
    return f", changed at stamp {', '.join(f'{t:.1f} s' for t in times)}" if times else ""
