"""Names of columns: what recorders call them, and which columns make a channel."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

# What other recorders call a column -> its RTDE name; tried in this order, "" leaves a column out.
ALIASES: tuple[tuple[str, str], ...] = (
    (r"(?i)(time|t|time_?stamps?|timestamp \[?\(?s\)?\]?)", "timestamp"),
    (r"(?i)(num|unnamed: *\d+)", ""),  # a row counter
    (r"Current_J(\d)", r"actual_current_\1"),
    (r"Temperature_[JT](\d)", r"joint_temperatures_\1"),
    (r"Speed_J(\d)", r"actual_qd_\1"),
    (r"Tool_current", "tool_current"),
    (r"(\w+)\[(\d+)\]", r"\1_\2"),  # a vector's value, as programs write it
)

# RTDE's vectors of one value per joint or axis: these keep their width if a column is missing.
SIX_WIDE = re.compile(
    r"(target|actual)_(q|qd|qdd|current|moment|TCP_pose|TCP_speed|TCP_force)"
    r"|joint_(temperatures|mode|control_output|control_currents)|actual_(joint_voltage|current_window)"
)

FROM_ONE = frozenset(range(1, 7))  # no vector of six that is counted from 0 has all of these

# Registers are scalars that end in a number of their own.
NUMBERED = re.compile(r"(?!.*register_\d+$)(?P<base>.+)_(?P<index>0|[1-9]\d{0,2})")

# Stamps of a row: by the robot's clock, and by the recorder's.
CLOCKS = frozenset({"timestamp", "received"})
DOZEN = 12  # columns that a sentence names

Layout = dict[str, int | tuple[int, ...]]  # channel -> its column, or its columns; -1: is missing


def rename(column: str) -> str:
    """RTDE name of a column; its own where no other is known."""
    column = column.strip().strip("\"'").strip()
    for pattern, name in ALIASES:
        if match := re.fullmatch(pattern, column):
            return match.expand(name)
    return column


def expand(spec: str) -> tuple[str, ...]:
    """Columns that a `--columns` line names: `q*2,-,t` is q_0, q_1, one without a name, t."""
    names: list[str] = []
    for word in spec.split(","):
        name, star, times = word.strip().partition("*")
        name = "" if name.strip() == "-" else name.strip()
        count = int(times) if star else 1  # ValueError: the caller reports it
        if not 0 < count < 1000 or (not name and word.strip()[:1] != "-"):
            raise ValueError(f"{word!r} is neither name, name*count nor -")
        names += [f"{name}_{k}" if name and star else name for k in range(count)]
    return tuple(names)


def example(width: int) -> str:
    """What a `--columns` line for `width` columns looks like."""
    joints, rest = divmod(width - 1, 6)
    vectors = ("actual_q", "actual_qd", "actual_current", "target_current", "target_moment")
    words = ["timestamp", *(f"{name}*6" for name in vectors[:joints])]
    skipped = rest + 6 * max(joints - len(vectors), 0)
    return ",".join([*words, f"-*{skipped}"] if skipped else words)


def layout(columns: Sequence[str], wanted: Collection[str] | None = None) -> Layout:
    """Channels that named columns make: `x_0 ... x_k` are one, everything else is a scalar.

    `wanted` keeps only these channels, and CLOCKS, which are always wanted.
    """
    groups: defaultdict[str, dict[int, int]] = defaultdict(dict)
    for place, name in enumerate(columns):
        match = NUMBERED.fullmatch(name)
        if match and match["base"] not in columns:
            groups[match["base"]][int(match["index"])] = place
    for base, places in groups.items():
        if SIX_WIDE.fullmatch(base) and set(places) == FROM_ONE:
            groups[base] = {index - 1: place for index, place in places.items()}
    made: Layout = {}
    for place, name in enumerate(columns):
        match = NUMBERED.fullmatch(name)
        width = _width(match["base"], groups[match["base"]]) if match else 0
        if match and width:
            places = groups[match["base"]]
            made[match["base"]] = tuple(places.get(k, -1) for k in range(width))
        elif name:
            made[name] = place
    if wanted is None:
        return made
    return {name: places for name, places in made.items() if name in {*wanted, *CLOCKS}}


def spread(channels: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Column -> values, (N,), of channels, a column per vector element; undone by `layout`."""
    columns: dict[str, NDArray[Any]] = {}
    for name, values in channels.items():
        vector = values.ndim > 1
        columns |= {f"{name}_{k}": x for k, x in enumerate(values.T)} if vector else {name: values}
    return columns


def _width(base: str, indices: Collection[int]) -> int:
    """Width of the vector that these indices make; 0: they make none."""
    if not indices:
        return 0
    if sorted(indices) == list(range(len(indices))):
        return len(indices)
    return 6 if SIX_WIDE.fullmatch(base) and max(indices) < 6 else 0


def used(layout: Layout) -> list[int]:
    """Columns that a layout needs, in the order of the file."""
    return sorted({place for places in layout.values() for place in listed(places) if place >= 0})


def listed(places: int | tuple[int, ...]) -> tuple[int, ...]:
    """Columns of a channel, scalar or not."""
    return (places,) if isinstance(places, int) else places


def some(columns: Iterable[str]) -> str:
    """Columns for a sentence, a dozen of them at most and how many more there are."""
    names = sorted(columns)
    more = f" and {len(names) - DOZEN} more" if len(names) > DOZEN else ""
    return ", ".join(names[:DOZEN]) + more


def duplicates(columns: Iterable[str]) -> list[str]:
    """Names that more than one column has."""
    return [name for name, count in Counter(columns).items() if name and count > 1]
