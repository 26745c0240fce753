"""The command line: one file per verb."""

import os


def main() -> None:
    """Entry point of `urdyn`."""
    # The matrices are some 80 columns wide: threads of BLAS would spend their time on waiting for
    # each other, most of all on a machine that has other work. Read when NumPy is first imported.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from urdyn.cli.app import app

    app(prog_name="urdyn")
