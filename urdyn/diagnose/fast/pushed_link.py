"""The description of a push: which link, how hard, and whether it was one at all.

tau_j = J_j(q)' F        for the joints below the pushed link; the others feel nothing
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.load.carried import PRIOR
from urdyn.diagnose.residual.space import Space
from urdyn.estimate.mixture import log_density, moments, normalised
from urdyn.model.arm import controller_base, describes_base
from urdyn.types import Array, Gaussian, Mask

BIN = 0.04  # [s]
LOUD = 90.0  # [-] sum of squares above which something happens
QUIET = 30.0  # [-] and below which nothing happens
MODEL = 0.05  # [-] of a changing torque, by which the model may be wrong
MOST = 2.5  # [-] sd of a prediction, most that it is off by
FORCE = 100.0  # [N] sd of a push
PARTS = (0.0, 0.25, 0.5, 0.75, 1.0)  # [-] of the way to the next joint: where links are pushed
STRONG = 0.5  # [-] of the loudest bin, above which bins describe the push
LASTS = 3  # bins that a push must last beside a piece
ENDING = 3  # last bins, by which a load on a standing arm is still there


@dataclass(frozen=True, eq=False)
class Bin:
    """Residual torques of some hundredths of a second."""

    t: float  # [s]
    stood: bool  # the arm stood still
    felt: Array  # (J,) [N·m] relative to the baseline
    bare: Array  # (J,) [N·m] the same without a load
    noise: Array  # (J,) [N·m] sd of that without a push, given a perfect prediction
    doubt: Array  # (J,) [N·m] sd of the prediction
    slack: Array  # (2, J) [N·m] range that changed friction may explain
    q: Array  # (J,) [rad]
    tool: Array  # (J, 10) [N·m] per unit of payload
    carried: Array  # (10,) assumed load

    @property
    def sd(self) -> Array:
        """sd of both, (J,) [N·m]."""
        return np.hypot(self.noise, self.doubt)


def beyond(felt: Array, slack: Array) -> Array:
    """The part of `felt` (..., J) beyond the slack (..., 2, J), [N·m]."""
    return np.asarray(felt - np.clip(felt, slack[..., 0, :], slack[..., 1, :]))


def sizes(bins: tuple[Bin, ...]) -> Array:
    """Sum of squares of what was felt, in its sd, (B,) [-]: the smaller with or without load."""
    (bare,) = _stacked(bins, "bare")
    return np.minimum(laden_sizes(bins), _sizes(bare, bins))


def laden_sizes(bins: tuple[Bin, ...]) -> Array:
    """The same with the assumed load, (B,) [-]."""
    (felt,) = _stacked(bins, "felt")
    return _sizes(felt, bins)


def _sizes(felt: Array, bins: tuple[Bin, ...]) -> Array:
    """Sum of squares of `felt` in bins, (B, J) [N·m]: the greater of two, (B,) [-].

    In the total sd, or in the noise's sd beyond the largest doubt: a push that jerks the arm makes
    the prediction doubtful, and would be hidden if doubt counted like noise.
    """
    sd, noise, doubt, slack = _stacked(bins, "sd", "noise", "doubt", "slack")
    wide = slack + MOST * np.stack([-doubt, doubt], axis=1)
    return np.maximum(_squares(felt, slack, sd), _squares(felt, wide, noise))


def _squares(felt: Array, slack: Array, sd: Array) -> Array:
    return np.asarray(np.sum((beyond(felt, slack) / sd) ** 2, axis=-1))


@dataclass(frozen=True, eq=False)
class Pushed:
    """Link and force of a push, from the torques of its bins."""

    space: Space
    least: float  # [N] weaker pushes are not reported

    def event(self, bins: tuple[Bin, ...], calm: int, known: Array, ill: Mask) -> Event | None:
        """The event of the push, if it was one.

        Args:
            calm: bins at the end in which it was over.
            known: possible inertials at the tool when it began, (k, 10); what has since been taken
                for one may be the push.
            ill: joints whose sensor is not trusted, (J,).
        """
        bins = tuple(replace(each, noise=np.where(ill, np.inf, each.noise)) for each in bins)
        felt, sd = _stacked(bins, "felt", "sd")
        size = sizes(bins)
        if size.max() < LOUD or _of_one_value(bins, size):  # it was the sensor
            return None
        if (bins[-1].carried != bins[0].carried).any():
            felt = _beside_the_piece(bins)
            size = _sizes(felt, bins)
            if not _lasts(size):
                return None
        elif _handled(bins, size, known) or _held(bins, size, calm):
            return None
        if _left_with_it(np.array([each.stood for each in bins]), felt, sd):
            return None
        return self._event(bins, calm, felt, size)

    def _event(self, bins: tuple[Bin, ...], calm: int, felt: Array, size: Array) -> Event | None:
        """The event of a push; None where it is too weak to be reported.

        Args:
            felt: net of a piece that was taken or put down meanwhile, (B, J) [N·m].
            size: sum of squares of that, in its sd, (B,) [-].
        """
        mean, doubt = _loudest(bins, calm, felt, size)
        peak = int(np.argmax(size))
        link, share, force = self._place(bins[peak].q, mean, doubt, np.isfinite(doubt))
        strength = float(np.linalg.norm(force.mean))
        if strength < self.least:
            return None
        begin, last = bins[0].t, bins[-1].t
        end = bins[-1 - calm].t + BIN if len(bins) > calm else last
        arm = self.space.reference.arm
        evidence = {
            "link": arm.link_names[link],
            "force_N": force.mean.tolist(),
            "force_sd_N": force.sd.tolist(),
            "frame": "base" if describes_base(arm) else "root",
            "strength_N": strength,
            "duration_s": float(end - begin),
            "peak_s": bins[peak].t,
            "torque_Nm": felt[peak].tolist(),
            "alone": _alone(bins, size),
            "statistic": float(size[peak]),
            "threshold": LOUD,
        }
        return Event(
            kind="collision",
            joint=link,
            onset=begin,
            alarm=last + BIN,
            confidence=share,
            size=strength,
            size_sd=float(np.sqrt(force.mean @ force.cov @ force.mean)) / strength,
            evidence=evidence,
        )

    def _place(self, q: Array, felt: Array, sd: Array, known: Mask) -> tuple[int, float, Gaussian]:
        """The likeliest link, its probability, and the force wherever it acts [N].

        Args:
            known: joints with a current, (J,).
        """
        links, J = self._points(q)
        J, felt = J[..., known], felt[known]
        Jt = np.swapaxes(J, 1, 2)
        S = np.diag(sd[known] ** 2 + (MODEL * felt) ** 2) + FORCE**2 * Jt @ J
        # The drives hold against the push: their extra torque is -J' F.
        gain = -(FORCE**2) * J @ np.linalg.inv(S)
        share = np.exp(normalised(log_density(felt, S))[0])
        each = np.bincount(links, share)
        link = int(np.argmax(each))
        cov = FORCE**2 * (np.eye(3) + gain @ Jt)
        return link, min(float(each[link]), 1.0), moments(share, gain @ felt, cov)

    def _points(self, q: Array) -> tuple[Array, Array]:
        """Points of links but the first of several: the link (P,), and the Jacobian (P, 3, J).

        In the axes of the controller's base. The next joint does not move its own frame's origin:
        both ends belong to the link.
        """
        arm = self.space.reference.arm
        first = min(1, arm.joints - 1)
        names = (*arm.link_names[first:], arm.tool)
        links = np.arange(first, arm.joints)
        ends = controller_base(arm)[:3, :3].T @ [arm.jacobian(q, name)[:3] for name in names]
        own = np.arange(arm.joints) <= links[:, None, None]
        points = [np.where(own, ends[:-1] + part * np.diff(ends, axis=0), 0.0) for part in PARTS]
        return np.tile(links, len(PARTS)), np.concatenate(points)


def _of_one_value(bins: tuple[Bin, ...], size: Array) -> bool:
    """Whether nothing is left without the loudest joint's value in the loudest bin.

    A push lasts, and other joints feel it; a single value is a sensor's fault, at any rate.
    """
    peak = int(np.argmax(size))
    without = _without(bins[peak], _most(bins[peak]))
    return bool(sizes((*bins[:peak], without, *bins[peak + 1 :])).max() < QUIET)


def _alone(bins: tuple[Bin, ...], size: Array) -> int | None:
    """The joint without which there is no push; None: several felt it."""
    j = _most(bins[int(np.argmax(size))])
    return j if sizes(tuple(_without(each, j) for each in bins)).max() < LOUD else None


def _most(seen: Bin) -> int:
    """The joint that felt most."""
    return int(np.argmax(np.abs(seen.felt) / seen.sd))


def _without(seen: Bin, j: int) -> Bin:
    """A bin without one joint's value."""
    return replace(seen, noise=np.where(np.arange(len(seen.felt)) == j, np.inf, seen.noise))


def _stacked(bins: tuple[Bin, ...], *names: str) -> Iterator[Array]:
    """These fields of all bins, (B, ...) each."""
    return (np.array([getattr(each, name) for each in bins]) for name in names)


def _loudest(bins: tuple[Bin, ...], calm: int, felt: Array, size: Array) -> tuple[Array, Array]:
    """Torques in the loudest bins: mean and sd, (J,) [N·m].

    What remains at the end came at an unknown time, and is no part of the push; nor is changed
    friction.
    """
    sd, slack = _stacked(bins, "sd", "slack")
    peak = int(np.argmax(size))
    strong = size > STRONG * size[peak]
    stayed, of_friction = felt[-calm:].mean(axis=0), slack[peak]
    mean = felt[strong].mean(axis=0) - 0.5 * stayed - of_friction.mean(axis=0)
    unknown = (stayed**2 + np.ptp(of_friction, axis=0) ** 2) / 12.0
    return mean, np.sqrt(sd[peak] ** 2 / strong.sum() + unknown)


def _beside_the_piece(bins: tuple[Bin, ...]) -> Array:
    """Torques net of the piece that was taken or put down meanwhile, (B, J) [N·m]."""
    before, since = bins[0].carried, bins[-1].carried
    felt = np.array([each.felt + each.tool @ (each.carried - before) for each in bins])
    return _beside(felt, np.array([each.tool @ (since - before) for each in bins]), bins)


def _beside(felt: Array, piece: Array, bins: tuple[Bin, ...]) -> Array:
    """Torques net of a piece's, (B, J) [N·m].

    It comes and goes within a bin, or gradually when lifted: the tool may bear any part of it.
    """
    (sd,) = _stacked(bins, "sd")
    along = np.sum(felt * piece / sd**2, axis=1, keepdims=True)
    whole = np.sum((piece / sd) ** 2, axis=1, keepdims=True)
    share = np.clip(along / np.where(whole > 0.0, whole, 1.0), 0.0, 1.0)
    return np.asarray(felt - share * piece)


def _handled(bins: tuple[Bin, ...], size: Array, known: Array) -> bool:
    """Whether a piece released for a moment, or held, explains most of it, and leaves no push."""
    (felt,) = _stacked(bins, "felt")
    for other in known:
        piece = np.array([each.tool @ (other - each.carried) for each in bins])
        left = np.minimum(size, _sizes(_beside(felt, piece, bins), bins))
        if left.sum() < 0.5 * size.sum() and not _lasts(left):
            return True
    return False


def _lasts(size: Array) -> bool:
    """Whether what is left beside a piece is a push, by its sum of squares in bins, (B,) [-]."""
    return bool(np.count_nonzero(size > LOUD) >= LASTS)


def _held(bins: tuple[Bin, ...], size: Array, calm: int) -> bool:
    """Whether an unknown piece explains most of it, and is still there when it seems over."""
    felt, sd, slack, tool = _stacked(bins, "felt", "sd", "slack", "tool")
    wide = np.hypot(sd, np.ptp(slack, axis=1) / np.sqrt(12.0))
    scaled = (tool / wide[..., None]).reshape(-1, tool.shape[-1])
    precision = scaled.T @ scaled + PRIOR
    piece = np.linalg.solve(precision, scaled.T @ (felt / wide).ravel())
    left = _sizes(felt - tool @ piece, bins)
    return bool(left.sum() < 0.5 * size.sum() and left[-calm:].sum() < size[-calm:].sum())


def _left_with_it(stood: Mask, felt: Array, sd: Array) -> bool:
    """Whether a standing arm moved away still feeling it: then it is taken for a piece.

    The torque of a joint that began to move is doubtful; disregarding that doubt, half of the force
    must remain.

    Args:
        stood: in each bin, (B,).
        felt, sd: (B, J) [N·m].
    """
    sizes = np.sum((felt / sd.min(axis=0)) ** 2, axis=1)
    before = stood & np.append(np.cumsum(~stood[::-1])[::-1][1:] > 0, False)  # it moved later
    return bool(before.any() and sizes[-ENDING:].mean() > 0.25 * sizes[before].max())
