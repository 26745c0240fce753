"""ROS bags and MCAP <-> tables: sqlite3 and MCAP bags of ROS 2, bags of ROS 1, and our own.

`rosbags` and `mcap` are an extra; they are imported when the first bag is met.
"""

from typing import TYPE_CHECKING

from urdyn.io.bags.forms import is_bag
from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.io.bags.table import read_bag

__all__ = ["is_bag", "read_bag"]

__getattr__ = lookup(__name__, {"urdyn.io.bags.table": ("read_bag",)})
