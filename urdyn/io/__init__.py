"""Files <-> types; units are converted here and nowhere else."""

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.io.bags.forms import is_log
    from urdyn.io.document import dump_toml, load_toml
    from urdyn.io.effort import Effort
    from urdyn.io.files import alone, sha256, write_folder, write_text, writing
    from urdyn.io.reader import read, read_table
    from urdyn.io.writer import write

__all__ = [
    "Effort",
    "alone",
    "dump_toml",
    "is_log",
    "load_toml",
    "read",
    "read_table",
    "sha256",
    "write",
    "write_folder",
    "write_text",
    "writing",
]

# Listening to a robot reads no logs, and needs no Arrow.
__getattr__ = lookup(
    __name__,
    {
        "urdyn.io.bags.forms": ("is_log",),
        "urdyn.io.document": ("dump_toml", "load_toml"),
        "urdyn.io.effort": ("Effort",),
        "urdyn.io.files": ("alone", "sha256", "write_folder", "write_text", "writing"),
        "urdyn.io.reader": ("read", "read_table"),
        "urdyn.io.writer": ("write",),
    },
)
