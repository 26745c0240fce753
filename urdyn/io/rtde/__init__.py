"""UR's Real-Time Data Exchange: a client, a recorder, and a controller to try them on."""

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.io.rtde.client import Client, Connected, Dropped, connect, parse_address
    from urdyn.io.rtde.link import Package
    from urdyn.io.rtde.play import play
    from urdyn.io.rtde.recipe import DEFAULT, Recipe
    from urdyn.io.rtde.recipe_file import read_recipe
    from urdyn.io.rtde.recorder import record
    from urdyn.io.rtde.server import PORT, Server, serve
    from urdyn.io.rtde.session import Session
    from urdyn.io.rtde.tally import Summary

__all__ = [
    "DEFAULT",
    "PORT",
    "Client",
    "Connected",
    "Dropped",
    "Package",
    "Recipe",
    "Server",
    "Session",
    "Summary",
    "connect",
    "parse_address",
    "play",
    "read_recipe",
    "record",
    "serve",
]

# Listening to a controller needs neither a recorder nor a server.
__getattr__ = lookup(
    __name__,
    {
        "urdyn.io.rtde.client": (
            "Client",
            "Connected",
            "Dropped",
            "connect",
            "parse_address",
        ),
        "urdyn.io.rtde.link": ("Package",),
        "urdyn.io.rtde.play": ("play",),
        "urdyn.io.rtde.recipe": (
            "DEFAULT",
            "Recipe",
        ),
        "urdyn.io.rtde.recipe_file": ("read_recipe",),
        "urdyn.io.rtde.recorder": ("record",),
        "urdyn.io.rtde.server": (
            "PORT",
            "Server",
            "serve",
        ),
        "urdyn.io.rtde.session": ("Session",),
        "urdyn.io.rtde.tally": ("Summary",),
    },
)
