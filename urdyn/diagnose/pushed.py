"""What a push was like: which link, how hard, and whether it was one at all.

tau_j = J_j(q)' F        for the joints below the link that is pushed; the others feel nothing
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.carried import ANYTHING
from urdyn.diagnose.event import Event
from urdyn.diagnose.space import Space
from urdyn.types import Array, Mask

BIN = 0.04  # [s]
LOUD = 90.0  # [-] sum of squares above which something happens
MODEL = 0.05  # [-] of a torque that changes, which the model may have wrong
FORCE = 100.0  # [N] sd of a push
STRONG = 0.5  # [-] of the loudest bin, from which on bins tell what it was like
ENDING = 3  # bins, the last ones, by which a load that stood is still there


@dataclass(frozen=True, eq=False)
class Bin:
    """What was felt in some hundredths of a second."""

    t: float  # [s]
    stood: bool  # the arm did
    felt: Array  # (J,) [N·m] beside the baseline
    sd: Array  # (J,) [N·m] of that for no push at all
    q: Array  # (J,) [rad]
    tool: Array  # (J, 10) [N·m] per unit of payload
    carried: Array  # (10,) what was taken to be carried


def sizes(bins: tuple[Bin, ...]) -> Array:
    """Sum of squares of what was felt, in its sd, (B,) [-]."""
    return np.array([np.sum((each.felt / each.sd) ** 2) for each in bins])


@dataclass(frozen=True, eq=False)
class Pushed:
    """Settings."""

    space: Space
    least: float  # [N] below, pushes are not told

    def event(self, bins: tuple[Bin, ...], calm: int, carried: Array, ill: Mask) -> Event | None:
        """What the push was like, if it was one.

        Args:
            calm: bins at the end in which it was over.
            carried: inertials that may be at the tool, (k, 10).
            ill: joints whose sensor is not to be believed, (J,).
        """
        felt, stood = np.array([each.felt for each in bins]), np.array([b.stood for b in bins])
        sd = np.where(ill, np.inf, np.array([each.sd for each in bins]))
        size = np.sum((felt / sd) ** 2, axis=1)
        if size.max() < LOUD:  # it was the sensor
            return None
        if _handled(bins, sd, size, carried) or _held(bins, sd, size, calm):
            return None
        if _left_with_it(stood, felt, sd):
            return None
        peak = int(np.argmax(size))
        strong = size > STRONG * size[peak]
        # What is there still has come meanwhile, nobody knows when, and is no part of the push.
        stayed = felt[-calm:].mean(axis=0)
        mean = felt[strong].mean(axis=0) - 0.5 * stayed
        doubt = np.hypot(sd[peak] / np.sqrt(strong.sum()), stayed / np.sqrt(12.0))
        link, share, force = self._place(bins[peak].q, mean, doubt, np.isfinite(doubt))
        strength = float(np.linalg.norm(force))
        if strength < self.least:
            return None
        begin, last = bins[0].t, bins[-1].t
        end = bins[-1 - calm].t + BIN if len(bins) > calm else last
        evidence = {
            "link": self.space.reference.arm.link_names[link],
            "force_N": force.tolist(),
            "strength_N": strength,
            "duration_s": float(end - begin),
            "peak_s": bins[peak].t,
            "torque_Nm": felt[peak].tolist(),
            "statistic": float(size[peak]),
            "threshold": LOUD,
        }
        return Event("collision", link, begin, last + BIN, share, strength, evidence)

    def _place(self, q: Array, felt: Array, sd: Array, told: Mask) -> tuple[int, float, Array]:
        """The link that explains the torques best, its share of the evidence, and the force [N]."""
        arm, weights, forces = self.space.reference.arm, [], []
        frames = [(k, name) for k, name in enumerate(arm.link_names) if k]
        frames.append((arm.joints - 1, arm.tool))
        V = np.diag(sd[told] ** 2 + (MODEL * felt[told]) ** 2)
        for link, frame in frames:
            J = arm.jacobian(q, frame)[:3, :]
            J = np.where(np.arange(arm.joints) <= link, J, 0.0)[:, told]
            # The drives hold against the push: what they give more is -J' F.
            S = V + FORCE**2 * J.T @ J
            gain = -(FORCE**2) * J @ np.linalg.inv(S)
            weights.append(
                -0.5 * np.linalg.slogdet(S)[1] - 0.5 * felt[told] @ np.linalg.solve(S, felt[told])
            )
            forces.append(gain @ felt[told])
        share = np.exp(np.array(weights) - max(weights))
        share /= share.sum()
        links = np.array([link for link, _ in frames])
        best = int(np.argmax(share))
        return int(links[best]), float(share[links == links[best]].sum()), forces[best]


def _handled(bins: tuple[Bin, ...], sd: Array, size: Array, carried: Array) -> bool:
    """Whether a piece that was taken or put down says most of it.

    Where others changed their mind about it meanwhile, the baseline may have had some of it before.
    """
    had = -bins[0].tool @ (bins[-1].carried - bins[0].carried)
    for other in carried:
        left = np.array([each.felt - each.tool @ (other - each.carried) for each in bins])
        left -= np.clip(left.mean(axis=0), np.minimum(had, 0.0), np.maximum(had, 0.0))
        if np.minimum(size, np.sum((left / sd) ** 2, axis=1)).sum() < 0.5 * size.sum():
            return True
    return False


def _held(bins: tuple[Bin, ...], sd: Array, size: Array, calm: int) -> bool:
    """Whether one piece that nobody knows says most of it, and is there when it seems over."""
    felt, tool = (np.array([getattr(each, name) for each in bins]) for name in ("felt", "tool"))
    scaled = (tool / sd[..., None]).reshape(-1, tool.shape[-1])
    precision = scaled.T @ scaled + np.diag(ANYTHING**-2.0)
    piece = np.linalg.solve(precision, scaled.T @ (felt / sd).ravel())
    left = np.sum(((felt - tool @ piece) / sd) ** 2, axis=1)
    return bool(left.sum() < 0.5 * size.sum() and left[-calm:].sum() < size[-calm:].sum())


def _left_with_it(stood: Mask, felt: Array, sd: Array) -> bool:
    """Whether an arm that stood went away with what it felt: a piece, as far as anybody can tell.

    What a joint felt that began to move is doubtful; if it were not, half of the force would be
    there still.

    Args:
        stood: in each bin, (B,).
        felt, sd: (B, J) [N·m].
    """
    sizes = np.sum((felt / sd.min(axis=0)) ** 2, axis=1)
    return bool(
        stood.any() and not stood.all() and sizes[-ENDING:].mean() > 0.25 * sizes[stood].max()
    )
