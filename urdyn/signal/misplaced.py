"""Velocities that are not of their joints: of the opposite sign, or in another joint's column."""

from __future__ import annotations

from itertools import permutations

from urdyn.signal.channels import MOTION, has_motion
from urdyn.signal.units import DECADES, EXACT, near_one, quartiles
from urdyn.types import Log


def misplaced(log: Log) -> str:
    """What is wrong with velocities that fit their angles reversed, or those of other joints.

    "" where nothing is. One that fits nothing is not misplaced: it is late, or of a stuck sensor.
    """
    if not has_motion(log):
        return ""
    (q, v), joints = map(log.joint, MOTION), range(log.joints)
    own = [quartiles(log.t, q[:, [j]], v[:, [j]]) for j in joints]
    if against := [j for j in joints if near_one(-own[j], DECADES)]:
        which = ", ".join(map(str, against))
        return f"its velocities go against its angles in joints {which}: change their sign"
    odd = [j for j in joints if not near_one(own[j], EXACT)]
    pairs = permutations(odd, 2)
    fit = (j for j, k in pairs if near_one(quartiles(log.t, q[:, [k]], v[:, [j]]), EXACT))
    if other := sorted(set(fit)):
        which = ", ".join(map(str, other))
        return f"its velocities of joints {which} fit the angles of others: exchange their columns"
    return ""
