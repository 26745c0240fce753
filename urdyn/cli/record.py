"""urdyn record: a controller's data stream, into a file."""

from __future__ import annotations

from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any

import typer

from urdyn.cli.ending import ended_by
from urdyn.cli.options import Json, Quiet
from urdyn.cli.voice import Voice
from urdyn.progress import Progress
from urdyn.report.digits import counted

if TYPE_CHECKING:
    from urdyn.io.rtde import Summary

NEAR = 1e-3  # relative difference within which a rate is the requested one

Host = Annotated[str, typer.Argument(metavar="HOST", show_default=False)]
Out = Annotated[
    Path, typer.Option(metavar="LOG", help="Where to write it: .parquet, .mcap, .csv or .csv.zst.")
]
Frequency = Annotated[
    float | None, typer.Option(metavar="HZ", help="Samples per second; by default all of them.")
]
Recipe = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Variables to record: UR's recipe XML, or one name a line."),
]
Duration = Annotated[
    float | None, typer.Option(metavar="S", help="Stop after so long; Ctrl-C stops at any time.")
]


def record(
    host: Host,
    out: Out,
    frequency: Frequency = None,
    recipe: Recipe = None,
    duration: Duration = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Record a robot by RTDE, every packet of it; HOST is an address, with :PORT if not 30004.

    A process that is killed leaves a file that can be read. What a file holds is not overwritten,
    but kept beside under another name.

    Example: [bold]urdyn record 192.168.0.10 --out monday.parquet[/bold]
    """
    from urdyn.io.rtde import record as record_rtde

    voice, stop = Voice(json, quiet), Event()

    def end() -> None:
        if stop.is_set():  # second request: end at any cost
            raise KeyboardInterrupt
        stop.set()

    with voice.progress(f"recording {host}") as progress, ended_by(end):
        tell = _telling(progress, duration)
        summary = record_rtde(host, out, frequency, recipe, duration, tell, stop)
    voice.show(_sentence(summary))
    if summary.aside:
        voice.note(f"what {summary.path} held before is now {summary.aside}")
    if frequency is not None and abs(summary.frequency - frequency) > NEAR * frequency:
        voice.note(
            f"sent at {summary.frequency:g} Hz, for {frequency:g} Hz cannot be had: a controller "
            "sends in every cycle, every second, every third, ..."
        )
    if summary.left_out:
        voice.note(f"the controller does not know: {', '.join(summary.left_out)}")
    voice.result(_document(summary))


def _telling(progress: Progress, duration: float | None) -> Any:
    def tell(summary: Summary) -> None:
        share = summary.seconds / duration if duration else 0.0
        down = f", nothing for {summary.silent:.0f} s" if summary.silent else ""
        aged = f", age {1e3 * summary.age_p99:.1f} ms" if summary.age_p99 is not None else ""
        progress(f"{summary.rate:.0f} Hz, {summary.lost} lost{down}{aged}", share)

    return tell


def _sentence(summary: Summary) -> str:
    gaps = counted(len(summary.gaps), "gap")
    troubles = [
        f"{summary.lost} lost in {gaps}" if summary.lost else "none lost",
        f"{summary.torn} torn" if summary.torn else "none torn",
    ]
    if summary.reconnects:
        troubles.append(f"{counted(summary.reconnects, 'connection')} dropped and taken up again")
    if summary.silent:
        troubles[0] += " while connected"
        troubles.append(
            f"nothing for {summary.silent:.1f} s while the connection was down, and what was sent "
            "meanwhile is lost"
        )
    age, unknown = _ms(summary.age_p99), "how late they came no stamp tells"
    return (
        f"{summary.path}: {summary.samples} samples in {summary.seconds:.1f} s, "
        f"{summary.rate:.1f} Hz; {', '.join(troubles)}; "
        f"{unknown if age is None else f'99 % came within {age:.2f} ms'}"
    )


def _ms(age: float | None) -> float | None:
    return None if age is None else 1e3 * age


def _document(summary: Summary) -> dict[str, Any]:
    return {
        "path": summary.path,
        "samples": summary.samples,
        "seconds": summary.seconds,
        "rate_hz": summary.rate,
        "frequency_hz": summary.frequency,
        "lost": summary.lost,
        "gaps": [{"row": row, "lost": lost} for row, lost in summary.gaps],
        "torn": summary.torn,
        "reconnects": summary.reconnects,
        "silent_s": summary.silent,
        "age_ms": {"p50": _ms(summary.age_p50), "p99": _ms(summary.age_p99)},
        "bytes": summary.bytes,
        "left_out": list(summary.left_out),
        "aside": summary.aside or None,
    }
