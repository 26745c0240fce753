"""Which arm a log is of, by what its controller works out of the angles alone.

Where the tool is, and the torques that bear the arm at rest: a controller has the numbers that are
published, and calibrated ones are near them. Of the arms that urdyn ships the one whose numbers
these are is told, where it is not the one that was named. An arm of the user's own drawing is
taken at his word: its base may be anywhere, and nobody else knows it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdyn.errors import LogError
from urdyn.model.arm import Arm, controller_base, described, load_arm
from urdyn.model.library import names
from urdyn.types import STANDSTILL, Array, Index, Log, Mask

ROWS = 300  # that are asked
FEW = 10  # rows that tell nothing
CLEARLY = 3.0  # [-] times as far off as another arm; calibrated ones are up to 1.7 times by chance
# [m] a tool that wanders by less in an arm's own flange may be this arm's; twelve calibrated arms,
# as drawn, were within 12 mm.
STEADY, CALIBRATED = 0.003, 0.015
# [-] of the torques at rest: what another arm's are off at least, and an arm's own at most.
OTHER, EXACT = 0.01, 0.003
AT_REST = 1e-3  # [N·m] by which torques of an arm that moves change from row to row

Off = Callable[[Arm], float]


def require_own(arm: Arm, log: Log) -> None:
    """LogError where the tool of a log is not where this arm has it, and where another has it."""
    if why := misplaced(arm, log):
        raise LogError(why, log.source.path)


def misplaced(arm: Arm, log: Log) -> str:
    """Whose tool is where the controller says that it is, if not this arm's; "" where it may be."""
    if not _asked(arm, log, "actual_TCP_pose"):
        return ""
    q, place = log.channels["actual_q"], log.channels["actual_TCP_pose"][:, :3]
    rows = _some(np.asarray(np.isfinite(np.hstack([q, place])).all(axis=1)))
    q, place = q[rows], place[rows]

    def wandering(of: Arm) -> float:
        """How far the tool strays in the last joint's frame, by the median [m]."""
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
    """Whose torques at rest a controller asks for, if not this arm's; "" where they may be.

    With the payload that it is set to; with none, where the log does not say.
    """
    if not _asked(arm, log, "target_moment"):
        return ""
    moment = log.channels["target_moment"]
    rows = _some(_resting(log, moment))
    q, moment, payload = log.channels["actual_q"][rows], moment[rows], _payload(log)[rows]
    still, size = np.zeros_like(q), np.linalg.norm(moment, axis=1)

    def amiss(of: Arm) -> float:
        """What its torques are off, by the median [-]."""
        Y = of.regressor(q, still, still)
        due = Y @ of.inertials.ravel() + np.einsum("njp,np->nj", Y[..., -10:-6], payload)
        return float(np.median(np.linalg.norm(moment - due, axis=1) / size))

    other, own, its = _nearer(arm, amiss, OTHER, EXACT) if len(rows) >= FEW else NOBODY
    return other and (
        f"target_moment at rest is what a {other} takes, to {100 * its:.1g} %, and "
        f"{100 * own:.1f} % off what a {arm.name} does: was it a {other} that was recorded?"
    )


NOBODY = ("", 0.0, 0.0)


def _nearer(arm: Arm, off: Off, least: float, near: float) -> tuple[str, float, float]:
    """Which other arm is near, how far off this one is, and how far that; else NOBODY."""
    own = off(arm)
    if own <= least:
        return NOBODY
    its, other = min((off(load_arm(name)), name) for name in names() if name != arm.name)
    return (other, own, its) if its < min(near, own / CLEARLY) else NOBODY


def _asked(arm: Arm, log: Log, channel: str) -> bool:
    """Whether a log tells of six joints, and of an arm as urdyn ships it."""
    told = channel in log and log.channels[channel].shape[1:] == (6,)
    return told and "actual_q" in log and log.joints == arm.joints == 6 and not described(arm)


def _some(which: Mask) -> Index:
    """Some of these rows (N,), evenly."""
    rows = np.flatnonzero(which)
    return rows[:: 1 + len(rows) // ROWS]


def _resting(log: Log, moment: Array) -> Mask:
    """Rows (N,) in which nothing moves: torques that a controller asks for have no noise."""
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
