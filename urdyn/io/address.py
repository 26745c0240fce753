"""HOST:PORT as people write it; the loopback where they name no host."""

from __future__ import annotations

import socket
from urllib.parse import urlsplit

from urdyn.errors import InputError

LOOPBACK = "127.0.0.1"


def parse(text: str, port: int, what: str) -> tuple[str, int]:
    """Host and port of "9100", "0.0.0.0:9100", "broker" or "[::1]:9100"; `port` by default."""
    found = host_and_port(f":{text}" if text.isdecimal() else text)
    if found is None or not text:
        raise InputError(f"{what} {text!r}: write PORT, HOST or HOST:PORT")
    host, number = found
    if number == 0:
        raise InputError(f"{what} {text!r}: 0 is no port; name one from 1 to 65535")
    return host or LOOPBACK, port if number is None else number


def host_and_port(text: str) -> tuple[str, int | None] | None:
    """Parts of HOST:PORT, HOST or PORT, an IPv6 host in brackets; None if it is none of these."""
    try:
        at = urlsplit(f"//{text}")
        host, port = at.hostname or "", at.port
    except ValueError:
        return None
    whole = at.netloc == text and at.username is None and not text.endswith(":")
    return (host, port) if whole and _is_host(host) else None


def door(host: str, port: int, backlog: int | None = None) -> socket.socket:
    """A socket that listens there, of the host's address family; OSError or UnicodeError."""
    family = socket.getaddrinfo(host, port)[0][0]
    return socket.create_server((host, port), family=family, backlog=backlog)


def joined(host: str, port: int) -> str:
    """HOST:PORT, as `host_and_port` takes it apart."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _is_host(name: str) -> bool:
    """Whether a host can have this name: its labels are neither empty nor too long."""
    try:
        return not name or bool(name.encode("idna"))
    except UnicodeError:
        return False
