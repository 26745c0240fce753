"""The command line: one file per verb."""


def main() -> None:
    """Entry point of `urdyn`."""
    from urdyn.cli.app import app

    app(prog_name="urdyn")
