"""How far a participant looks for others, by ROS 2's environment variables.

ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_STATIC_PEERS are those of Iron and later, ROS_LOCALHOST_ONLY
that of Humble, which the later ones still honour. Limited to this computer, nodes of Humble use
its loopback alone; later ones use its usual interface and also call on the loopback. To be heard
by both, use both.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

from urdyn.errors import InputError

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
LO = '<NetworkInterface name="lo"/>'
# The usual one goes first: a node that is on it alone does not answer calls from the loopback.
BOTH = '<NetworkInterface name="lo" priority="-1"/><NetworkInterface autodetermine="true"/>'
FORM = (
    '<CycloneDDS><Domain Id="any"><General>{general}</General>'
    "<Discovery>{discovery}</Discovery></Domain></CycloneDDS>"
)
SILENT = "<AllowMulticast>false</AllowMulticast>"
# Found by index, for there is no multicast; ROS has as many processes on a computer.
COUNTED = (
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
)


def configurations(environ: Mapping[str, str]) -> tuple[str, ...]:
    """Cyclone's configurations; use the first that this computer's interfaces allow.

    Raises:
        InputError: a range that ROS does not know.
    """
    reach = environ.get(RANGE) or RANGES[0]
    if reach not in RANGES:
        raise InputError(f"{RANGE} {reach!r}: is to be one of {', '.join(RANGES)}")
    peers = [peer for peer in environ.get("ROS_STATIC_PEERS", "").split(";") if peer]
    if environ.get("ROS_LOCALHOST_ONLY") == "1":
        reach, peers = "LOCALHOST", []
    if reach == "OFF":
        tag = f"<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_{os.getpid()}</Tag>"
        return (FORM.format(general=SILENT, discovery=tag),)
    if reach == "LOCALHOST":
        speaking = (f"<Interfaces>{on}</Interfaces>{SILENT}" for on in (BOTH, LO))
        called = _called(["localhost", *peers])
        return tuple(FORM.format(general=general, discovery=called) for general in speaking)
    if reach == "SUBNET" and peers:
        return (FORM.format(general="", discovery=_called(peers)),)
    return ("",)


def _called(peers: Sequence[str]) -> str:
    return f"{COUNTED}<Peers>{''.join(f'<Peer Address={quoteattr(p)}/>' for p in peers)}</Peers>"
