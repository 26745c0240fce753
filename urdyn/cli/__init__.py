"""The command line: one file per verb."""


def main() -> None:
    """Entry point of `urdyn`."""
    import sys

    from urdyn.cli.app import app
    from urdyn.cli.legible import legible

    legible(sys.stdout, sys.stderr)
    app(prog_name="urdyn")
