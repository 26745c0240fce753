"""Options of a few words take those that the library has, and refuse any other in the same way."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, get_args, get_origin

import pytest
from typer.testing import CliRunner

from urdyn import estimate
from urdyn.bench.truth import SENSORS
from urdyn.cli import excite_options, options, simulate_options, track_options
from urdyn.cli.app import app
from urdyn.cli.bench_diagnose import Noise
from urdyn.identify.excite import KINDS
from urdyn.identify.excite.criterion import CRITERIA
from urdyn.io.effort import UNITS
from urdyn.simulate import RECORDERS
from urdyn.simulate.motions import MOTIONS
from urdyn.tracking import MODES

KNOWN: list[tuple[object, Collection[str]]] = [
    (simulate_options.Motion, MOTIONS),
    (simulate_options.RecorderKind, RECORDERS),
    (excite_options.Kind, KINDS),
    (excite_options.Criterion, CRITERIA),
    (track_options.FilterName, track_options.FILTERS),
    (track_options.ModeName, MODES),
    (options.Unit, UNITS),
    (Noise, SENSORS),
]
SIMULATE = "simulate --robot ur5e --duration 1 --out {out}"
EXCITE, TRACK = "excite --robot ur5e --out {out}", "track twin.toml log.csv --out {out}"
WRONG = [
    *((SIMULATE, option) for option in ("--motion", "--recorder", "--fidelity", "--noise")),
    *((EXCITE, option) for option in ("--kind", "--criterion")),
    *((TRACK, option) for option in ("--filter", "--mode", "--publish", "--hand-over")),
    *((f"{verb} log.csv", "--effort-unit") for verb in ("identify", "convert", "track")),
    ("bench diagnose", "--noise"),
]


def words(option: object) -> list[str]:
    """What an option can be given."""
    if get_origin(option) is Annotated:
        return words(get_args(option)[0])
    parts = get_args(option)
    return [w for part in parts for w in ([part] if isinstance(part, str) else words(part))]


@pytest.mark.parametrize(("option", "known"), KNOWN)
def test_an_option_s_words_are_those_that_the_library_has(
    option: object, known: Collection[str]
) -> None:
    assert words(option) == [*known]


def test_every_filter_that_can_be_asked_for_is_there() -> None:
    assert all(hasattr(estimate, name) for name in track_options.FILTERS.values())


@pytest.mark.parametrize(("command", "option"), WRONG)
def test_a_word_that_there_is_not_is_a_usage_error(command: str, option: str, tmp_path) -> None:
    out = tmp_path / "run.csv"
    asked = [*command.format(out=out).split(), option, "wrong"]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 2, done.output
    assert option in done.stderr and "wrong" in done.stderr
    assert not out.exists()


@pytest.mark.parametrize("other", ["--wrench", "--mode realtime"])
def test_particles_are_refused_with_what_they_cannot_do(other: str) -> None:
    told = CliRunner().invoke(
        app, f"track twin.toml log.csv --out out --filter particle {other}".split()
    )
    assert told.exit_code == 2 and "leave" in told.stderr
