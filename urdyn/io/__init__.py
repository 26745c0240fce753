"""Files <-> types; units are converted here and nowhere else."""

from urdyn.io.document import dump_toml, load_toml
from urdyn.io.effort import Effort
from urdyn.io.files import alone, sha256, write_text, writing
from urdyn.io.reader import read, read_table
from urdyn.io.writer import write

__all__ = [
    "Effort",
    "alone",
    "dump_toml",
    "load_toml",
    "read",
    "read_table",
    "sha256",
    "write",
    "write_text",
    "writing",
]
