"""The verbs under one name. They import what they need when they run, so that --help is quick."""

from __future__ import annotations

import os
from inspect import cleandoc
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from urdyn.cli.acknowledge import acknowledge
from urdyn.cli.bench import bench_identify
from urdyn.cli.bench_diagnose import bench_diagnose
from urdyn.cli.bench_excite import bench_excite
from urdyn.cli.bench_faults import bench_faults
from urdyn.cli.bench_simulate import bench_simulate
from urdyn.cli.bench_track import bench_track
from urdyn.cli.calibrate import calibrate
from urdyn.cli.convert import convert
from urdyn.cli.demo import demo
from urdyn.cli.excite import excite
from urdyn.cli.failure import DEBUG, guarded
from urdyn.cli.fleet import fleet
from urdyn.cli.identify import identify
from urdyn.cli.record import record
from urdyn.cli.simulate import simulate
from urdyn.cli.track import track
from urdyn.cli.validate import validate
from urdyn.cli.view import view
from urdyn.version import __version__


class Verb(TyperCommand):
    """A verb of the command line."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Arguments and options."""
        return _bare(super().get_params(ctx))


class Verbs(TyperGroup):
    """Verbs under one name."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Options before the verb."""
        return _bare(super().get_params(ctx))


def _bare(params: list[Any]) -> list[Any]:
    """Parameters whose help shows no type behind a switch, which takes no value."""
    for param in params:
        if isinstance(param, TyperOption) and param.is_flag:
            param.metavar = ""
    return params


app = typer.Typer(
    name="urdyn",
    cls=Verbs,
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
bench = typer.Typer(
    cls=Verbs,
    no_args_is_help=True,
    help="Measure time, memory and errors on this machine, beside truth and paper.",
)
app.add_typer(bench, name="bench")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"urdyn {__version__}")
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help=f"Show where an error arose, as {DEBUG}=1 does.")
    ] = False,
) -> None:
    """Digital twin of a Universal Robots arm: finds out from its own data what the arm is.

    Begin with: [bold]urdyn demo[/bold]
    """
    if debug:
        os.environ[DEBUG] = "1"  # for processes that a verb starts, too


def flowing(text: str | None) -> str:
    """A docstring with one line per paragraph, which the terminal wraps."""
    paragraphs = cleandoc(text or "").split("\n\n")
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


for verb in (
    identify,
    validate,
    calibrate,
    excite,
    simulate,
    record,
    track,
    acknowledge,
    fleet,
    view,
    convert,
    demo,
):
    app.command(cls=Verb, help=flowing(verb.__doc__))(guarded(verb))
for trial in (
    bench_identify,
    bench_excite,
    bench_simulate,
    bench_track,
    bench_faults,
    bench_diagnose,
):
    name = trial.__name__.removeprefix("bench_")
    bench.command(name, cls=Verb, help=flowing(trial.__doc__))(guarded(trial))
