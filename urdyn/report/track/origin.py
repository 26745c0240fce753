"""What a tracked run was made from, and how fast it went."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from urdyn.io.spans import clock
from urdyn.report.digits import number
from urdyn.report.markup import Html, section, table, tag, text
from urdyn.report.track.history import History
from urdyn.version import __version__

SETTINGS = "settings"  # in the provenance: the filter, its drift, the period, streams


def track_origin(history: History, summary: Mapping[str, Any]) -> Html:
    """Speed, and hashes of the twin and of its data."""
    speed = [[text(name), text(value)] for name, value in _speed(summary).items()]
    made = [
        [text(k), tag("span", text(_settings(v) if k == SETTINGS else v), kind="hash")]
        for k, v in _flat(history.provenance)
    ]
    return section(
        "Speed and provenance",
        f"urdyn {__version__} · {summary['filter']} · {summary['mode']}",
        table(["", "measured"], speed, "words"),
        *([table(["made of", ""], made, "words")] if made else []),
    )


def _speed(summary: Mapping[str, Any]) -> dict[str, str]:
    latency = summary["latency_ms"]
    times = summary["data_s"] / summary["wall_s"] if summary["wall_s"] else float("nan")
    return {
        "samples": f"{summary['samples']:,}",
        "data": clock(summary["data_s"])(summary["data_s"]),
        "time taken": f"{number(summary['wall_s'], 3)} s, {number(times)} times as fast as the arm",
        "quick enough for": f"{number(summary['rate_hz'], 3)} Hz",
        "latency, median": f"{number(latency['p50'])} ms",
        "latency, 99 %": f"{number(latency['p99'])} ms",
        "latency, longest": f"{number(latency['max'])} ms",
        "memory": f"{number(summary['rss_mb'], 3)} MB",
    }


def _settings(told: str) -> str:
    """Stored settings in words, without defaults."""
    said = re.sub(r",? ?\w+=None\b|\bNone\b|\(\)", "", told).replace("(, ", "(")
    said = re.sub(r"\d+\.\d+(e[-+]?\d+)?", lambda m: f"{float(m[0]):.6g}", said)
    said = re.sub(r"(?<= )(\d[\d.e-]*)(?= |$)", r"every \1 s", said)
    return " ".join(said.replace("=", " ").replace("'", "").replace("(", " (").split())


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Leaves of nested JSON, each under its path."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(inner, f"{name} {key}".strip())
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from _flat(inner, f"{name} {k + 1}".strip())
    else:
        yield name, str(value)
