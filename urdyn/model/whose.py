"""Which arm a log is of, by what its controller computes from the angles alone.

These are the tool's position and the torques that hold the arm at rest: a controller uses the
published numbers, or calibrated ones near them. If they are those of another arm that urdyn ships
than the one that was named, that one is reported. An arm of the user's own drawing is not checked:
its base may be anywhere.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdyn.errors import LogError
from urdyn.model.arm import Arm, controller_base, load_arm
from urdyn.model.library import names, robots
from urdyn.types import STANDSTILL, Array, Index, Log, Mask

ROWS = 300  # that are examined
FEW = 10  # rows that show nothing
CLEARLY = 3.0  # [-] times as far off as another arm; calibrated arms are up to 1.7 times by chance
# [m] scatter of the tool in the flange: below the first it may be the named arm's, below the second
# another's; twelve calibrated arms, as drawn, were within 12 mm.
STEADY, CALIBRATED = 0.003, 0.015
# [-] of the torques at rest: the least misfit of another arm's, and the largest of an arm's own.
OTHER, EXACT = 0.01, 0.003
AT_REST = 1e-3  # [N·m] from row to row, by which torques of a moving arm change

Off = Callable[[Arm], float]
NOBODY = ("", 0.0, 0.0)


def require_own(arm: Arm, log: Log) -> None:
    """LogError where the tool of a log is not where this arm has it, and where another has it."""
    if why := misplaced(arm, log):
        raise LogError(why, log.source.path)


def misplaced(arm: Arm, log: Log) -> str:
    """Whose tool the controller's pose fits, if not this arm's; "" where it may be this arm's."""
    if not _asked(arm, log, "actual_TCP_pose"):
        return ""
    q, place = log.channels["actual_q"], log.channels["actual_TCP_pose"][:, :3]
    rows = _some(np.asarray(np.isfinite(np.hstack([q, place])).all(axis=1)))
    q, place = q[rows], place[rows]

    def wandering(of: Arm) -> float:
        """Median distance of the tool from its median place in the last joint's frame [m]."""
        last = np.linalg.inv(controller_base(of)) @ of.pose(q, of.link_names[-1])
        tool = np.einsum("nji,nj->ni", last[:, :3, :3], place - last[:, :3, 3])
        return float(np.median(np.linalg.norm(tool - np.median(tool, axis=0), axis=1)))

    other, own, its = _nearer(arm, wandering, STEADY, CALIBRATED) if len(rows) >= FEW else NOBODY
    return other and (
        f"is of another arm: its actual_TCP_pose is where a {other} has its tool, to "
        f"{1e3 * its:.1f} mm, and {1e3 * own:.0f} mm off where a {arm.name} has it; name that "
        f"robot, like {other}, or give its own URDF, or a log, or the address, of this one"
    )


def misweighed(arm: Arm, log: Log) -> str:
    """Whose torques at rest a controller commands, if not this arm's; "" where they may be.

    With the payload that it is set to; with none, where the log does not give it.
    """
    if not _asked(arm, log, "target_moment"):
        return ""
    moment = log.channels["target_moment"]
    rows = _some(_resting(log, moment))
    q, moment, payload = log.channels["actual_q"][rows], moment[rows], _payload(log)[rows]
    still, size = np.zeros_like(q), np.linalg.norm(moment, axis=1)

    def amiss(of: Arm) -> float:
        """Median error of its torques [-]."""
        Y = of.regressor(q, still, still)
        due = Y @ of.inertials.ravel() + np.einsum("njp,np->nj", Y[..., -10:-6], payload)
        return float(np.median(np.linalg.norm(moment - due, axis=1) / size))

    other, own, its = _nearer(arm, amiss, OTHER, EXACT) if len(rows) >= FEW else NOBODY
    return other and (
        f"target_moment at rest is what a {other} takes, to {100 * its:.1g} %, and "
        f"{100 * own:.1f} % off what a {arm.name} does: was it a {other} that was recorded?"
    )


def _nearer(arm: Arm, off: Off, least: float, near: float) -> tuple[str, float, float]:
    """Which other arm fits, the misfit of this arm, and that of the other; else NOBODY."""
    own = off(arm)
    if own <= least:
        return NOBODY
    its, other = min((off(load_arm(name)), name) for name in names() if name != arm.name)
    return (other, own, its) if its < min(near, own / CLEARLY) else NOBODY


def _asked(arm: Arm, log: Log, channel: str) -> bool:
    """Whether a log has the channel for six joints, and the arm is as urdyn ships it."""
    told = channel in log and log.channels[channel].shape[1:] == (6,)
    if not (told and "actual_q" in log and log.joints == arm.joints == 6):
        return False
    return arm.name in robots() and arm.urdf == load_arm(arm.name).urdf


def _some(which: Mask) -> Index:
    """Some of these rows (N,), evenly spaced."""
    rows = np.flatnonzero(which)
    return rows[:: 1 + len(rows) // ROWS]


def _resting(log: Log, moment: Array) -> Mask:
    """Rows (N,) in which nothing moves: torques that a controller commands have no noise."""
    alike = np.zeros(len(log), dtype=bool)
    alike[1:] = (np.abs(np.diff(moment, axis=0)) < AT_REST).all(axis=1)
    stands = (np.nan_to_num(np.abs(log.joint("actual_qd"))) < STANDSTILL).all(axis=1)
    borne = np.linalg.norm(moment, axis=1) > AT_REST / EXACT
    told = np.isfinite(log.channels["actual_q"]).all(axis=1)
    return np.asarray(alike & stands & borne & told)


def _payload(log: Log) -> Array:
    """Mass [kg] and first moments [kg·m] that the controller is set to, (N, 4)."""
    mass, centre = log.channels.get("payload"), log.channels.get("payload_cog")
    if mass is None or centre is None or centre.shape[1:] != (3,):
        return np.zeros((len(log), 4))
    return np.nan_to_num(mass[:, None] * np.column_stack([np.ones(len(log)), centre]))
