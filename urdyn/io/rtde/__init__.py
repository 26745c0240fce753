"""UR's Real-Time Data Exchange: a client, a recorder, and a controller to try them on."""

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
