"""`python -m urdyn`."""

from urdyn.cli import main

main()
