"""Options that have no effect beside another one are refused: their user expects an effect."""

from __future__ import annotations

import typer

from urdyn.errors import InputError

GIVEN = "COMMANDLINE"


def idle(context: typer.Context, where: str, *names: str) -> None:
    """InputError at the first of these parameters that was given; `where` it has no effect."""
    spelt = {param.name: param.opts[0] for param in context.command.params}
    for name in names:
        source = context.get_parameter_source(name)
        if source is not None and source.name == GIVEN:
            raise InputError(f"{spelt[name]} does nothing {where}; leave it out")
