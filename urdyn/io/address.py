"""HOST:PORT as people write it; the loopback where they name no host."""

from __future__ import annotations

from urdyn.errors import InputError

LOOPBACK = "127.0.0.1"


def is_host(name: str) -> bool:
    """Whether a host can have this name: its labels are neither empty nor too long."""
    try:
        return bool(name.encode("idna"))
    except UnicodeError:
        return False


def parse(text: str, port: int, what: str) -> tuple[str, int]:
    """Host and port of "9100", "0.0.0.0:9100", "broker" or "[::1]:9100"; `port` unless told."""
    host, colon, number = text.rpartition(":")
    if not colon:
        host, number = ("", text) if text.isdecimal() else (text, "")
    host = host.strip("[]") or LOOPBACK
    known = not number or (number.isdecimal() and 0 <= int(number) < 65536)
    if not (known and is_host(host)):
        raise InputError(f"{what} {text!r}: write PORT, HOST or HOST:PORT")
    return host, int(number) if number else port
